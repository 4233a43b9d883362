// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/ode/rk21.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

/// Lu & Rycroft's App. B for one point, written line by line from Table A.4 and (B.1)-(B.4): what integrate_rk21 must reproduce.
template <std::size_t n> struct Rk21Reference {
    std::array<double, n> y{};
    long long accepted = 0, rejected = 0;
    bool failed = false;
};

template <std::size_t n>
Rk21Reference<n> reference_rk21(auto&& f, std::array<double, n> y0, double duration, const ductile::Rk21Options& options) {
    Rk21Reference<n> result{.y = y0};
    double t = 0.0, h = duration;
    bool after_rejection = false;
    while (t < duration) {
        const bool last = t + h >= duration * (1.0 - 1e-15);
        if (last)
            h = duration - t;
        std::array<double, n> stage, y1_hat, y1;
        const std::array<double, n> k1 = f(result.y);
        for (std::size_t i = 0; i < n; ++i)
            stage[i] = result.y[i] + h * (2.0 / 3.0) * k1[i];
        const std::array<double, n> k2 = f(stage);
        for (std::size_t i = 0; i < n; ++i)
            y1_hat[i] = result.y[i] + h * (k1[i] / 4.0 + 3.0 * k2[i] / 4.0);
        const std::array<double, n> k3 = f(y1_hat);
        double sum = 0.0;
        for (std::size_t i = 0; i < n; ++i) {
            y1[i] = result.y[i] + h * (k1[i] / 3.0 + k2[i] / 3.0 + k3[i] / 3.0);
            const double scale = options.absolute_tolerance +
                                 options.relative_tolerance * std::max(std::abs(result.y[i]), std::abs(y1_hat[i])); // (B.1)
            sum += std::pow((y1[i] - y1_hat[i]) / scale, 2);
        }
        const double error = std::sqrt(sum / (static_cast<double>(n) + options.exact_components)); // (B.2)
        const double step = h;
        const double factor = std::max(options.smallest_shrink, options.safety / std::sqrt(error)); // (B.3)
        if (error < 1.0) {
            t = last ? duration : t + step;
            result.y = y1_hat;
            ++result.accepted;
            h = step * std::min(after_rejection ? 1.0 : options.largest_growth, factor); // (B.4)
        } else {
            ++result.rejected;
            h = step * std::min(options.largest_growth, factor);
        }
        // The step after a rejection does not grow (Hairer, Norsett & Wanner, II.4): the limit counts for the attempt that
        // follows the rejection.
        after_rejection = !(error < 1.0);
        if (h < 1e-12 * duration) {
            result.failed = true;
            return result;
        }
    }
    return result;
}
