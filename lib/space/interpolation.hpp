// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/space/field.hpp>

#include <utility>
#include <vector>

namespace ductile {

/// A linear map from the values of a field to values at other places, the same for all of its rows and for all of its columns.
class Interpolation {
public:
    /// The weights of some points.
    using Weights = std::vector<std::pair<int, double>>;

    /// For each place, those of the columns (x) and those of the rows (y).
    Interpolation(std::vector<Weights> x, std::vector<Weights> y) : x_(std::move(x)), y_(std::move(y)) {}

    /// Values at the places, [y][x], of rows of values that lie `stride` apart.
    [[nodiscard]] Field operator()(const double* values, std::ptrdiff_t stride, int columns) const;
    [[nodiscard]] Field operator()(const Field& field) const { return (*this)(field.row(0), field.stride(), field.columns()); }

private:
    std::vector<Weights> x_, y_;
};

/// Middles of the equal parts of a side, in units of its cells.
[[nodiscard]] std::vector<double> middles(int parts, int cells);
/// Linear between `points`, which rise, and beyond the first and the last.
[[nodiscard]] std::vector<Interpolation::Weights> linear_weights(const std::vector<double>& points,
                                                                 const std::vector<double>& places);
/// Linear between points at (0, 1, ...) + `shift` of a line of that period.
[[nodiscard]] std::vector<Interpolation::Weights> periodic_linear_weights(int points, double shift,
                                                                          const std::vector<double>& places);

} // namespace ductile
