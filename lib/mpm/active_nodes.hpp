#pragma once
#include <ductile/base/aligned.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace ductile::mpm {

/// The nodes that carry mass in this step, numbered from 0 row by row. Vectors over nodes hold x and y components in turn.
struct ActiveNodes {
    int lattice_width = 0, lattice_height = 0;
    std::vector<std::int32_t> lattice;    ///< place of each active node on the lattice of all nodes, row by row
    aligned_vector<double> mass;          ///< m_i (2.2.12), one a node
    aligned_vector<double> velocity;      ///< v^k of (2.2.14), prescribed values where the velocity is prescribed
    std::vector<char> prescribed;         ///< whether a component is, by a side of the grid or a rigid body
    std::vector<std::int32_t> rigid_body; ///< number of the rigid body that touches the node, or -1

    [[nodiscard]] std::size_t count() const { return mass.size(); }
    [[nodiscard]] std::size_t components() const { return velocity.size(); }
};

} // namespace ductile::mpm
