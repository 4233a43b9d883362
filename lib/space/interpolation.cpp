// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/space/interpolation.hpp>

#include <algorithm>
#include <cmath>

namespace ductile {

Field Interpolation::operator()(const double* values, std::ptrdiff_t stride, int columns) const {
    Field result(static_cast<int>(y_.size()), static_cast<int>(x_.size()));
    std::vector<double> row(static_cast<std::size_t>(columns)); // at the place in y, of all columns
    for (int j = 0; j < result.rows(); ++j) {
        std::ranges::fill(row, 0.0);
        for (const auto& [from, weight] : y_[static_cast<std::size_t>(j)])
            for (int i = 0; i < columns; ++i)
                row[static_cast<std::size_t>(i)] += weight * values[from * stride + i];
        for (int i = 0; i < result.columns(); ++i)
            for (const auto& [from, weight] : x_[static_cast<std::size_t>(i)])
                result(i, j) += weight * row[static_cast<std::size_t>(from)];
    }
    return result;
}

std::vector<double> middles(int parts, int cells) {
    std::vector<double> places;
    for (int k = 0; k < parts; ++k)
        places.push_back((k + 0.5) * cells / parts);
    return places;
}

std::vector<Interpolation::Weights> linear_weights(const std::vector<double>& points, const std::vector<double>& places) {
    std::vector<Interpolation::Weights> all;
    for (const double place : places) {
        const auto above = std::upper_bound(points.begin() + 1, points.end() - 1, place);
        const auto k = static_cast<std::size_t>(above - points.begin());
        const double share = (place - points[k - 1]) / (points[k] - points[k - 1]);
        all.push_back({{static_cast<int>(k) - 1, 1.0 - share}, {static_cast<int>(k), share}});
    }
    return all;
}

std::vector<Interpolation::Weights> periodic_linear_weights(int points, double shift, const std::vector<double>& places) {
    std::vector<Interpolation::Weights> all;
    for (const double place : places) {
        const double at = place - shift, below = std::floor(at);
        const int k = (static_cast<int>(below) % points + points) % points;
        all.push_back({{k, 1.0 - (at - below)}, {(k + 1) % points, at - below}});
    }
    return all;
}

} // namespace ductile
