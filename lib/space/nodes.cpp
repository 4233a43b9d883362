// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/space/nodes.hpp>

namespace ductile {

NodeNumbering::NodeNumbering(const Grid& grid, const BoundaryConditions& boundary)
    : columns_(boundary.node_columns(grid)), rows_(boundary.node_rows(grid)) {
    indices_.reserve(static_cast<std::size_t>(2 * columns_ * rows_));
    int prescribed_count = 0;
    for (int j = 0; j < rows_; ++j)
        for (int i = 0; i < columns_; ++i)
            for (const auto component : {&SideConditions::u, &SideConditions::v}) {
                const auto prescribes = [&](const SideConditions& side) { return side.*component == Condition::prescribed; };
                const bool prescribed =
                    (i == 0 && prescribes(boundary.left)) || (i == grid.cells_x && prescribes(boundary.right)) ||
                    (j == 0 && prescribes(boundary.bottom)) || (j == grid.cells_y && prescribes(boundary.top));
                indices_.push_back(prescribed ? -1 - prescribed_count++ : free_count_++);
            }
}

std::array<int, 8> NodeNumbering::of_cell(int i, int j) const {
    const int right = (i + 1) % columns_, up = (j + 1) % rows_;
    return {index(i, j, 0),  index(i, j, 1),  index(right, j, 0),  index(right, j, 1),
            index(i, up, 0), index(i, up, 1), index(right, up, 0), index(right, up, 1)};
}

} // namespace ductile
