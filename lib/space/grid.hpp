// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <vector>

namespace ductile {

/// The staggered grid of Lu & Rycroft, Sec. 2.1: M x N cells on a rectangle, x periodic, walls at the lowest and highest y.
/// Stress and internal variable live at cell centres (i + 1/2, j + 1/2), 0 <= i < M, 0 <= j < N;
/// velocity lives at cell corners (i, j), 0 <= i < M (periodic images are not stored), 0 <= j <= N.
struct Grid {
    int cells_x = 0;     ///< M
    int cells_y = 0;     ///< N
    double width = 2.0;  ///< extent in x, in units of the length the scene is scaled with
    double height = 2.0; ///< extent in y

    [[nodiscard]] double dx() const { return width / cells_x; }
    [[nodiscard]] double dy() const { return height / cells_y; }
    [[nodiscard]] double cell_area() const { return dx() * dy(); }
    [[nodiscard]] double area() const { return width * height; }
    /// Coordinates with the origin in the middle of the rectangle: corners for whole i, j; centres for half ones.
    [[nodiscard]] double x(double i) const { return -0.5 * width + i * dx(); }
    [[nodiscard]] double y(double j) const { return -0.5 * height + j * dy(); }

    bool operator==(const Grid&) const = default;
};

/// How the rows of a space lie between the walls, in units of their mean height dy() and from the lower wall on: Grid::y() makes
/// coordinates of it.
struct RowSpacing {
    std::vector<double> cell;   ///< [N] of the points where stress lives
    std::vector<double> node;   ///< [N + 1] of those where velocity lives; node[j] <= cell[j] <= node[j + 1]
    std::vector<double> weight; ///< [N] of a row of cells in integrals, 1 on average

    bool operator==(const RowSpacing&) const = default;
};

/// Cells of equal height: centres at j + 1/2, corners at j, weights 1.
[[nodiscard]] RowSpacing uniform_rows(const Grid& grid);

/// Throws InputError, naming the option, unless there are at least 4 x 4 cells (the ENO stencil) and the rectangle has positive
/// sides.
void check(const Grid& grid);

} // namespace ductile
