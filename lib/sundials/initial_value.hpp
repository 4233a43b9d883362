// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <functional>
#include <span>

namespace ductile::sundials {

/// dy/dt = f(t, y): writes the rate of `y` at time `t` into `rate`, which has as many components. It may throw: the exception
/// comes out of the integrator's integrate(). A rate that is not finite makes the integrator try a shorter step, if it chooses
/// its steps, and in the end give up.
using RightHandSide = std::function<void(double t, std::span<const double> y, std::span<double> rate)>;

/// Called after every accepted step with the time reached and the state there. It may throw, too.
using StepObserver = std::function<void(double t, std::span<const double> y)>;

/// Times within the interval of an integration, rising, for which `show` is called as it passes them, with the state there by the
/// integrator's own interpolant. It may throw, too.
struct DenseOutput {
    std::span<const double> times = {};
    std::function<void(double t, std::span<const double> y)> show = {};
};

/// What an integrator did since its construction.
struct Counts {
    long long steps = 0;       ///< accepted
    long long rejected = 0;    ///< by the error test
    long long evaluations = 0; ///< of the right-hand side, those for difference quotients included
};

} // namespace ductile::sundials
