// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/space/periodic_line.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace ductile {

PeriodicLine::PeriodicLine(int points, double width, LineRule rule)
    : points_(points), padded_(round_up_to_row_unit(points)), rule_(rule), spacing_(width / points) {
    const auto m = static_cast<std::size_t>(points), n = static_cast<std::size_t>(padded_);
    for (int l = 0; l < modes(); ++l) {
        const double half_angle = std::numbers::pi * l / points;
        const bool nyquist = 2 * l == points, spectral = rule == LineRule::spectral;
        kappa_.push_back(2.0 / spacing_ * (spectral ? half_angle : std::sin(half_angle)));
        iota_.push_back(nyquist ? 0.0 : spectral ? 1.0 : std::cos(half_angle));
    }
    // what a value 1 at one point becomes `shift` spacings to the right of it
    const auto sum = [&](double shift, const auto& wave) {
        double total = 0.0;
        for (int l = 0; l < modes(); ++l)
            total +=
                (l == 0 || 2 * l == points ? 1.0 : 2.0) * wave(l, 2.0 * std::numbers::pi * std::fmod(l * shift, points) / points);
        return total / points;
    };
    const auto slope = [&](int l, double angle) { return -kappa(l) * std::sin(angle); };
    const auto value = [&](int l, double angle) { return iota(l) * std::cos(angle); };
    const auto slope_of_cell = [&](int l, double angle) {
        return 2 * l == points ? 0.0 : -2.0 * std::numbers::pi * l / width * std::sin(angle);
    };
    const auto if_short = [&](int l, double angle) { return 8 * l > 3 * points ? std::cos(angle) : 0.0; };
    std::vector<double> slopes, values, slopes_of_cells, shares; // by the whole part of the shift
    for (int shift = 0; shift < points; ++shift) {
        slopes.push_back(sum(shift + 0.5, slope));
        values.push_back(sum(shift + 0.5, value));
        slopes_of_cells.push_back(sum(shift, slope_of_cell));
        shares.push_back(sum(shift, if_short));
    }
    for (auto* matrix :
         {&slope_at_cells_, &value_at_cells_, &slope_transposed_, &value_transposed_, &slope_between_cells_, &short_waves_})
        matrix->resize(m * n);
    for (std::size_t from = 0; from < m; ++from)
        for (std::size_t column = 0; column < n; ++column) {
            const std::size_t to = column % m, shift = (to + m - from) % m, back = (from + m - to) % m, at = from * n + column;
            slope_at_cells_[at] = slopes[shift];
            value_at_cells_[at] = values[shift];
            slope_transposed_[at] = slopes[back];
            value_transposed_[at] = values[back];
            slope_between_cells_[at] = slopes_of_cells[shift];
            short_waves_[at] = shares[shift];
        }
}

double PeriodicLine::value_between(double shift) const {
    if (rule_ == LineRule::staggered)
        return std::max(0.0, 1.0 - std::abs(std::remainder(shift, points_)));
    double sum = 0.0;
    for (int l = 0; l < modes(); ++l)
        sum +=
            (l == 0 || 2 * l == points_ ? 1.0 : 2.0) * std::cos(2.0 * std::numbers::pi * std::fmod(l * shift, points_) / points_);
    return sum / points_;
}

} // namespace ductile
