// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/time/chebyshev.hpp>

namespace ductile::time {

namespace {

/// The real stability interval of s stages, with damping.
double stability(int s) { return 2.0 / 3.0 * (s * s - 1.0) * (1.0 - 2.0 / 15.0 * 2.0 / 13.0); }

/// Round-off grows with the square of the number of stages: 1e-11 of the stress at most.
constexpr int most_stages = 300;

/// The rate of decay may grow during the step.
constexpr double margin = 1.1;

} // namespace

int chebyshev_stages(double dt, double relaxation) {
    int s = 2;
    while (s < most_stages && stability(s) < margin * dt * relaxation)
        ++s;
    return s;
}

double longest_chebyshev_step(double relaxation) { return stability(most_stages) / (margin * relaxation); }

ChebyshevCoefficients::ChebyshevCoefficients(int s) : stages(static_cast<std::size_t>(s) + 1) {
    const double w0 = 1.0 + 2.0 / 13.0 / (s * s);
    const std::size_t n = stages.size();
    std::vector<double> t(n), d1(n), d2(n), b(n); // T_j, T_j', T_j'' at w0
    t[0] = 1.0;
    t[1] = w0;
    d1[1] = 1.0;
    for (std::size_t j = 2; j < n; ++j) {
        t[j] = 2.0 * w0 * t[j - 1] - t[j - 2];
        d1[j] = 2.0 * t[j - 1] + 2.0 * w0 * d1[j - 1] - d1[j - 2];
        d2[j] = 4.0 * d1[j - 1] + 2.0 * w0 * d2[j - 1] - d2[j - 2];
    }
    const double w1 = d1[n - 1] / d2[n - 1];
    for (std::size_t j = 2; j < n; ++j)
        b[j] = d2[j] / (d1[j] * d1[j]);
    b[0] = b[1] = b[2];
    stages[1].mu_tilde = b[1] * w1;
    for (std::size_t j = 2; j < n; ++j) {
        Stage& stage = stages[j];
        stage.mu = 2.0 * b[j] * w0 / b[j - 1];
        stage.nu = -b[j] / b[j - 2];
        stage.mu_tilde = 2.0 * b[j] * w1 / b[j - 1];
        stage.gamma_tilde = -(1.0 - b[j - 1] * t[j - 1]) * stage.mu_tilde;
        stage.c = w1 * d2[j] / d1[j];
    }
    stages[1].c = stages[2].c / (4.0 * w0);
}

} // namespace ductile::time
