// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/space/grid.hpp>

#include <cmath>
#include <fmt/format.h>

namespace ductile {

void check(const Grid& grid) {
    if (grid.cells_x < 4 || grid.cells_y < 4)
        throw InputError(
            fmt::format("{} x {} cells: at least 4 cells are needed in each direction (the upwind stencil spans five)",
                        grid.cells_x, grid.cells_y));
    if (!(grid.width > 0.0 && grid.height > 0.0 && std::isfinite(grid.width) && std::isfinite(grid.height)))
        throw InputError(fmt::format("the domain is {} x {}: both sides must be positive and finite", grid.width, grid.height));
}

RowSpacing uniform_rows(const Grid& grid) {
    RowSpacing rows;
    for (int j = 0; j <= grid.cells_y; ++j)
        rows.node.push_back(j);
    for (int j = 0; j < grid.cells_y; ++j)
        rows.cell.push_back(j + 0.5);
    rows.weight.assign(rows.cell.size(), 1.0);
    return rows;
}

} // namespace ductile
