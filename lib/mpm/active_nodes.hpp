// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/aligned.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace ductile::mpm {

/// Who prescribes a component of a node's velocity: a rigid body by its number in the list, or a side of the grid.
enum Side : std::int32_t { left_side = -1, right_side = -2, bottom_side = -3, top_side = -4 };
struct Hold {
    std::int32_t component;
    std::int32_t holder;
};

/// The nodes that carry mass in this step, numbered from 0 row by row. Vectors over nodes hold x and y components in turn. Where
/// bodies do not share the nodes' velocity (Scene::field_of_body) the lattices of the fields lie one above the other.
struct ActiveNodes {
    int lattice_width = 0, lattice_height = 0;
    int period = 0;                    ///< columns after which the lattice repeats itself; 0: never
    std::vector<std::int32_t> lattice; ///< place of each active node on the lattice of all nodes, row by row
    aligned_vector<double> mass;       ///< m_i (2.2.12), one a node
    aligned_vector<double> velocity;   ///< v^k of (2.2.14), prescribed values where the velocity is prescribed
    aligned_vector<double> mapped;     ///< the same before any is prescribed, where transfers are affine, else none
    std::vector<char> prescribed;      ///< how many rigid bodies and sides of the grid prescribe a component
    std::vector<Hold> holds;           ///< which they are

    [[nodiscard]] std::size_t count() const { return mass.size(); }
    [[nodiscard]] std::size_t components() const { return velocity.size(); }
};

} // namespace ductile::mpm
