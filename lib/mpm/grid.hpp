// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace ductile::mpm {

/// What a scene makes of its third direction.
enum class Geometry {
    plane_strain,
    plane_stress, ///< sigma_zz = 0 at every particle
    axisymmetric, ///< x is the radius, y the axis; masses and forces are those of one radian
};

/// What holds at a side of the grid.
enum class SideCondition {
    free,    ///< nothing; a particle that crosses it ends the run
    slip,    ///< no velocity across; also a plane of symmetry, and the axis of an axisymmetric scene
    fixed,   ///< no velocity at all
    periodic ///< left and right are one side: what crosses the one comes in at the other
};

/// The background grid: cells_x x cells_y equal cells on the rectangle with the corner (left, bottom), in metres.
struct Grid {
    int cells_x = 0;
    int cells_y = 0;
    double width = 0.0;
    double height = 0.0;
    double left = 0.0;
    double bottom = 0.0;
    struct Sides {
        SideCondition left = SideCondition::free, right = SideCondition::free;
        SideCondition bottom = SideCondition::free, top = SideCondition::free;
    } sides = {};

    /// In x.
    [[nodiscard]] bool periodic() const { return sides.left == SideCondition::periodic; }
    [[nodiscard]] double dx() const { return width / cells_x; }
    [[nodiscard]] double dy() const { return height / cells_y; }
    [[nodiscard]] double smallest_spacing() const { return dx() < dy() ? dx() : dy(); }
};

inline constexpr int most_cells = 20'000; ///< of a grid, each way

/// Whether a point lies in the grid, its edge included.
[[nodiscard]] bool contains(const Grid& grid, double x, double y);

/// Throws InputError unless there are 3 to most_cells cells each way, and memory for them, the extents are positive and finite,
/// the place is finite and not so far from the origin that cells vanish in round-off, an axisymmetric grid begins at a radius of
/// zero or more, and either left and right are periodic, in a plane geometry, or no side is.
void check(const Grid& grid, Geometry geometry);

} // namespace ductile::mpm
