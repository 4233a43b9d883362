// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/space/gauss.hpp>

#include <cmath>
#include <numbers>

namespace ductile {

namespace {

/// P_n and P'_n at x, |x| < 1 for the slope: n P_n = (2 n - 1) x P_{n-1} - (n - 1) P_{n-2}, (1 - x^2) P'_n = n (P_{n-1} - x P_n).
struct Legendre {
    double value = 1.0, slope = 0.0;

    Legendre(int n, double x) {
        double before = 0.0;
        for (int k = 1; k <= n; ++k) {
            const double next = ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k;
            before = value;
            value = next;
        }
        if (n > 0)
            slope = n * (before - x * value) / (1.0 - x * x);
    }
};

/// Newton's method from `x`, to round-off, on a function given as value over slope.
double zero_near(double x, const auto& value_over_slope) {
    for (int pass = 0; pass < 100; ++pass) {
        const double change = value_over_slope(x);
        x -= change;
        if (std::abs(change) < 1e-15)
            break;
    }
    return x;
}

/// 1/prod_{k != j} (x_j - x_k)
std::vector<double> barycentric_weights(std::span<const double> x) {
    std::vector<double> weights(x.size(), 1.0);
    for (std::size_t j = 0; j < x.size(); ++j)
        for (std::size_t k = 0; k < x.size(); ++k)
            if (k != j)
                weights[j] /= x[j] - x[k];
    return weights;
}

} // namespace

Quadrature gauss_legendre(int n) {
    Quadrature rule;
    for (int k = n; k >= 1; --k) {
        const double start = std::cos(std::numbers::pi * (k - 0.25) / (n + 0.5));
        const double x = 2 * k == n + 1 ? 0.0 : zero_near(start, [&](double at) {
            const Legendre p(n, at);
            return p.value / p.slope;
        });
        const double slope = Legendre(n, x).slope;
        rule.points.push_back(x);
        rule.weights.push_back(2.0 / ((1.0 - x * x) * slope * slope));
    }
    return rule;
}

std::vector<double> gauss_lobatto_points(int n) {
    // by Legendre's equation (1 - x^2) P'' = 2 x P' - m (m + 1) P
    const int m = n - 1;
    std::vector<double> points{-1.0};
    for (int k = m - 1; k >= 1; --k)
        points.push_back(2 * k == m ? 0.0 : zero_near(std::cos(std::numbers::pi * k / m), [&](double at) {
            const Legendre p(m, at);
            return p.slope * (1.0 - at * at) / (2.0 * at * p.slope - m * (m + 1.0) * p.value);
        }));
    points.push_back(1.0);
    return points;
}

std::vector<double> interpolation_matrix(std::span<const double> from, std::span<const double> to) {
    const std::vector<double> weights = barycentric_weights(from);
    std::vector<double> matrix;
    for (const double x : to) {
        double sum = 0.0;
        bool meets = false;
        for (std::size_t j = 0; j < from.size(); ++j) {
            meets = meets || x == from[j];
            sum += weights[j] / (x - from[j]);
        }
        for (std::size_t j = 0; j < from.size(); ++j)
            matrix.push_back(meets ? (x == from[j] ? 1.0 : 0.0) : weights[j] / (x - from[j]) / sum);
    }
    return matrix;
}

std::vector<double> slope_matrix(std::span<const double> from, std::span<const double> to) {
    const std::size_t n = from.size();
    const std::vector<double> weights = barycentric_weights(from), values = interpolation_matrix(from, to);
    std::vector<double> there(n * n, 0.0); // slopes at `from`
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = 0; j < n; ++j)
            if (i != j) {
                there[i * n + j] = weights[j] / weights[i] / (from[i] - from[j]);
                there[i * n + i] -= there[i * n + j];
            }
    std::vector<double> matrix(to.size() * n, 0.0);
    for (std::size_t g = 0; g < to.size(); ++g)
        for (std::size_t i = 0; i < n; ++i)
            for (std::size_t j = 0; j < n; ++j)
                matrix[g * n + j] += values[g * n + i] * there[i * n + j];
    return matrix;
}

std::vector<double> legendre_matrix(const Quadrature& from) {
    const std::size_t n = from.points.size();
    std::vector<double> matrix;
    for (std::size_t l = 0; l < n; ++l)
        for (std::size_t g = 0; g < n; ++g)
            matrix.push_back(std::sqrt(static_cast<double>(l) + 0.5) * from.weights[g] *
                             Legendre(static_cast<int>(l), from.points[g]).value);
    return matrix;
}

} // namespace ductile
