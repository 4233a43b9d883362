// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/base/memory.hpp>
#include <ductile/mpm/grid.hpp>

#include <cmath>
#include <fmt/format.h>

namespace ductile::mpm {

bool contains(const Grid& g, double x, double y) {
    const double cx = (x - g.left) * (1.0 / g.dx()), cy = (y - g.bottom) * (1.0 / g.dy());
    return cx >= 0.0 && cx <= g.cells_x && cy >= 0.0 && cy <= g.cells_y;
}

void check(const Grid& g, Geometry geometry) {
    if (g.cells_x < 3 || g.cells_y < 3 || g.cells_x > most_cells || g.cells_y > most_cells)
        throw InputError(fmt::format("the background grid has {} x {} cells: from 3 to {} are possible each way", g.cells_x,
                                     g.cells_y, most_cells));
    constexpr double node_bytes = 24.0; // of a node without mass
    require_memory(node_bytes * g.cells_x * g.cells_y, fmt::format("the background grid has {} x {} cells", g.cells_x, g.cells_y),
                   "use larger ones");
    if (!(g.width > 0.0 && g.height > 0.0 && std::isfinite(g.width) && std::isfinite(g.height)))
        throw InputError(
            fmt::format("the background grid is {} x {} m: both extents must be positive and finite", g.width, g.height));
    constexpr double finest = 1e-10; // of the distance from the origin: edges of cells are found to 1e-12 of a cell or so
    if (!(g.dx() > finest * std::abs(g.left) && g.dy() > finest * std::abs(g.bottom)))
        throw InputError(
            fmt::format("the background grid has its corner at ({}, {}) m: it must be finite, and not so far away that "
                        "cells of {:.3g} x {:.3g} m vanish in round-off",
                        g.left, g.bottom, g.dx(), g.dy()));
    if (geometry == Geometry::axisymmetric && !(g.left >= 0.0))
        throw InputError(fmt::format("the background grid begins at the radius {} m: it must not be negative", g.left));
    if ((g.sides.right == SideCondition::periodic) != g.periodic())
        throw InputError(
            "of the left and the right side of the grid one is periodic, and the other is not: make both periodic, or "
            "none");
    if (g.sides.bottom == SideCondition::periodic || g.sides.top == SideCondition::periodic)
        throw InputError(
            "the bottom or the top of the grid is periodic: only left and right can be; turn the scene by 90 degrees");
    if (g.periodic() && geometry == Geometry::axisymmetric)
        throw InputError(
            "the grid is periodic along the radius of an axisymmetric scene: make left and right free, slip or fixed, "
            "or take plane strain");
}

} // namespace ductile::mpm
