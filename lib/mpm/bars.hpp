// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/mpm/setup.hpp>

namespace ductile::mpm {

enum class BarDirection { tension, compression };

/// The bar of Sulsky & Kaul, Sec. 3.1: what its programs let users choose.
struct BarOptions {
    MaterialData material;
    double speed = 1e-3; ///< of the rigid body [m/s]
    BarDirection direction = BarDirection::tension;
    Geometry geometry = Geometry::plane_strain;
};

/// Declares them in a group of their own.
void declare(io::Program& program, BarOptions& bar);

/// The bar [0.4, 0.7] x [0.1, 0.4] m in a grid of 0.7 x 0.5 m, held at the grid's right end, with a rigid body [0.3, 0.4] x
/// [0.1, 0.4] m at its left end. Observables: nominal strain, mean axial stress, and its spread along the bar.
/// Throws InputError for a cell size that does not divide 0.1 m, so that the bar would not fill its cells.
[[nodiscard]] Setup make_bar(const BarOptions& bar, const Options& options);

} // namespace ductile::mpm
