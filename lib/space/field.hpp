// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/aligned.hpp>
#include <ductile/space/grid.hpp>

#include <cassert>
#include <cstddef>

namespace ductile {

/// A scalar on the rows and columns of a grid that is periodic in x.
///
/// Shape: `rows` rows of `columns` values, plus `ghost_rows` rows below and above, plus a halo of periodic images left and
/// right. row(j)[i] is defined for -ghost_rows <= j < rows + ghost_rows and -row_unit <= i < padded_columns() + row_unit;
/// row(j) is 128-byte aligned. Images are filled by wrap_row(); kernels may then compute whole vectors up to
/// padded_columns() and read two columns further on both sides: padded lanes hold true copies of real values.
class Field {
public:
    Field() = default;
    Field(int rows, int columns, int ghost_rows = 0)
        : rows_(rows), columns_(columns), ghost_rows_(ghost_rows), stride_(round_up_to_row_unit(columns) + 2 * row_unit),
          values_(static_cast<std::size_t>(rows + 2 * ghost_rows) * static_cast<std::size_t>(stride_), 0.0) {}

    [[nodiscard]] int rows() const { return rows_; }
    [[nodiscard]] int columns() const { return columns_; }
    [[nodiscard]] int ghost_rows() const { return ghost_rows_; }
    [[nodiscard]] int padded_columns() const { return stride_ - 2 * row_unit; }
    [[nodiscard]] int stride() const { return stride_; }

    [[nodiscard]] double* row(int j) { return values_.data() + offset(j); }
    [[nodiscard]] const double* row(int j) const { return values_.data() + offset(j); }
    [[nodiscard]] double& operator()(int i, int j) { return row(j)[i]; }
    [[nodiscard]] double operator()(int i, int j) const { return row(j)[i]; }

    /// Fills the periodic images of row j: two columns to the left, everything to padded_columns() + 2 to the right.
    void wrap_row(int j) {
        double* f = row(j);
        f[-1] = f[columns_ - 1];
        f[-2] = f[columns_ >= 2 ? columns_ - 2 : 0];
        for (int i = columns_; i < padded_columns() + 3; ++i)
            f[i] = f[i - columns_];
    }

    void wrap() {
        for (int j = 0; j < rows_; ++j)
            wrap_row(j);
    }

    /// The whole storage, ghosts and images included (for copies and bitwise comparisons).
    [[nodiscard]] const aligned_vector<double>& storage() const { return values_; }

private:
    [[nodiscard]] std::size_t offset(int j) const {
        assert(j >= -ghost_rows_ && j < rows_ + ghost_rows_);
        return static_cast<std::size_t>(j + ghost_rows_) * static_cast<std::size_t>(stride_) + row_unit;
    }

    int rows_ = 0, columns_ = 0, ghost_rows_ = 0, stride_ = 0;
    aligned_vector<double> values_;
};

/// A vector at the corners of the grid: N + 1 rows of M values each; rows 0 and N are the walls.
struct VectorField {
    Field u, v;

    VectorField() = default;
    VectorField(int rows, int columns) : u(rows, columns), v(rows, columns) {}
    explicit VectorField(const Grid& grid) : VectorField(grid.cells_y + 1, grid.cells_x) {}
};

/// The in-plane stress of Eq. (1) at cell centres: pressure p, s = (sigma_xx - sigma_yy)/2, shear tau,
/// and q = deviatoric sigma_zz / 2. sigma_xx = -p + s - q, sigma_yy = -p - s - q, sigma_zz = -p + 2q.
struct StressField {
    Field p, s, tau, q;
};

} // namespace ductile
