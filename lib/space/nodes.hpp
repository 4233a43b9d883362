// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/space/boundary.hpp>

#include <array>
#include <vector>

namespace ductile {

/// Numbers the degrees of freedom of the rectangle's distinct nodes: free ones 0, 1, ... and prescribed ones 0, 1, ... apart,
/// row by row, u before v.
class NodeNumbering {
public:
    NodeNumbering(const Grid& grid, const BoundaryConditions& boundary);

    [[nodiscard]] int columns() const { return columns_; }
    [[nodiscard]] int rows() const { return rows_; }
    [[nodiscard]] int free_count() const { return free_count_; }
    [[nodiscard]] int prescribed_count() const { return 2 * rows_ * columns_ - free_count_; }

    /// Degree of freedom of component c (0: u, 1: v) at node (i, j): n >= 0 the free one n, n < 0 the prescribed one -1 - n.
    [[nodiscard]] int index(int i, int j, int c) const { return indices_[static_cast<std::size_t>(2 * (j * columns_ + i) + c)]; }
    /// index() of the eight degrees of freedom of cell (i, j), ordered as in CellStiffness.
    [[nodiscard]] std::array<int, 8> of_cell(int i, int j) const;

private:
    int columns_, rows_, free_count_ = 0;
    std::vector<int> indices_;
};

} // namespace ductile
