// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/mpm/newton.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace ductile::mpm {

SolverCounts& SolverCounts::operator+=(const SolverCounts& o) {
    newton_iterations += o.newton_iterations;
    linear_iterations += o.linear_iterations;
    residual_evaluations += o.residual_evaluations;
    jacobian_products += o.jacobian_products;
    backtracks += o.backtracks;
    return *this;
}

/// F at u + length * step, into trial_ and trial_f_. Returns its norm.
double NewtonKrylov::evaluate(const NonlinearSystem& system, std::span<const double> u, double length, SolverCounts& counts) {
    trial_.resize(u.size());
    trial_f_.resize(u.size());
    for (std::size_t i = 0; i < u.size(); ++i)
        trial_[i] = u[i] + length * step_[i];
    trial_scale_ = system.residual(trial_, trial_f_);
    ++counts.residual_evaluations;
    return norm(trial_f_);
}

LinearResult NewtonKrylov::find_step(const NonlinearSystem& system, std::span<const double> u, double tolerance, int iterations,
                                     SolverCounts& counts) {
    const bool analytic = options_.product == JacobianProduct::analytic;
    if (analytic || system.precondition)
        system.linearise(u);
    const double length_u = norm(u);
    const auto difference = [&](std::span<const double> s, std::span<double> result) {
        const double length = norm(s);
        if (length == 0.0) {
            std::fill(result.begin(), result.end(), 0.0);
            return;
        }
        const double h = options_.difference_increment * (length_u > 0.0 ? length_u : 1.0) / length;
        for (std::size_t i = 0; i < s.size(); ++i)
            shifted_[i] = u[i] + h * s[i];
        system.residual(shifted_, result);
        ++counts.residual_evaluations;
        for (std::size_t i = 0; i < s.size(); ++i)
            result[i] = (result[i] - f_[i]) / h;
    };
    const auto product = [&](std::span<const double> s, std::span<double> result) {
        system.jacobian_times(s, result);
        ++counts.jacobian_products;
    };
    shifted_.resize(u.size());
    step_.resize(u.size());
    negative_f_.resize(u.size());
    for (std::size_t i = 0; i < u.size(); ++i)
        negative_f_[i] = -f_[i];
    const LinearMap map = analytic ? LinearMap(product) : LinearMap(difference);
    const LinearResult result =
        options_.linear == LinearMethod::gmres
            ? krylov_.gmres(map, system.precondition, negative_f_, step_, tolerance, iterations)
            : krylov_.conjugate_gradients(map, system.precondition, negative_f_, step_, tolerance, iterations);
    counts.linear_iterations += result.iterations;
    return result;
}

bool NewtonKrylov::search(const NonlinearSystem& system, std::span<double> u, double before, SolverCounts& counts) {
    const auto accept = [&] {
        std::copy(trial_.begin(), trial_.end(), u.begin());
        f_.swap(trial_f_);
        scale_ = trial_scale_;
        return true;
    };
    double now = evaluate(system, u, 1.0, counts);
    if (options_.line_search == LineSearch::none)
        return std::isfinite(now) && accept();
    if (options_.line_search == LineSearch::residual) {
        double length = 1.0;
        while (!(now <= (1.0 - 1e-4 * length) * before)) {
            if (length < 1e-6)
                return false;
            counts.backtracks += length == 1.0 ? 1 : 0;
            length *= 0.5;
            now = evaluate(system, u, length, counts);
        }
        return accept();
    }
    // energy: the root of g(a) = w.F(u + a s), bracketed once it has changed its sign (regula falsi, Illinois)
    velocity_change_.resize(step_.size());
    system.velocity_change(step_, velocity_change_);
    const double start = dot(velocity_change_, f_);
    double g = dot(velocity_change_, trial_f_);
    double low = 0.0, g_low = start, high = 1.0, g_high = g;
    if (std::isfinite(g) && (std::abs(g) <= 0.5 * std::abs(start) || now <= 0.5 * before))
        return accept();
    if (std::isfinite(g) && (g > 0.0) == (start > 0.0))
        return now <= 2.0 * before && accept(); // the step is too short: the next Newton step goes on
    ++counts.backtracks;
    for (int tries = 0; tries < 20; ++tries) {
        const double root = std::isfinite(g_high) ? low - g_low * (high - low) / (g_high - g_low) : 0.5 * (low + high);
        const double length = std::clamp(root, low + 0.05 * (high - low), high - 0.05 * (high - low));
        now = evaluate(system, u, length, counts);
        g = dot(velocity_change_, trial_f_);
        if (std::isfinite(g) && (std::abs(g) <= 0.5 * std::abs(start) || now <= 0.5 * before))
            return accept();
        if (std::isfinite(g) && (g > 0.0) == (start > 0.0)) {
            low = length;
            g_low = g;
            g_high *= 0.5;
        } else {
            high = length;
            g_high = g;
            g_low *= 0.5;
        }
    }
    return false;
}

SolverResult NewtonKrylov::solve(const NonlinearSystem& system, std::span<double> u, SolverCounts& counts) {
    f_.resize(u.size());
    scale_ = system.residual(u, f_);
    ++counts.residual_evaluations;
    double now = norm(f_), forcing = options_.linear_tolerance;
    for (int iteration = 0;; ++iteration) {
        if (now <= options_.tolerance * scale_)
            return {true, now > 0.0 ? now / scale_ : 0.0, {}};
        if (!std::isfinite(now))
            return {false, now, "the residual is not finite"};
        if (iteration == options_.largest_newton_iterations)
            return {false, now / scale_,
                    fmt::format("Newton's method needs more than {} iterations: the residual is {:.3g}, the tolerance {:.3g}",
                                iteration, now / scale_, options_.tolerance)};
        find_step(system, u, forcing, options_.largest_linear_iterations, counts);
        ++counts.newton_iterations;
        const double before = now;
        if (!search(system, u, before, counts))
            return {
                false, before / scale_,
                fmt::format("the line search found no step that helps: the residual is {:.3g} after {} Newton iterations, the "
                            "tolerance {:.3g}",
                            before / scale_, iteration + 1, options_.tolerance)};
        now = norm(f_);
        if (options_.eisenstat_walker) {
            const double ratio = now / before, safeguard = 0.9 * forcing * forcing;
            double next = 0.9 * ratio * ratio;
            if (safeguard > 0.1)
                next = std::max(next, safeguard);
            // no smaller than what the nonlinear tolerance can use
            next = std::max(next, 0.5 * options_.tolerance * scale_ / std::max(now, 1e-300));
            forcing = std::clamp(next, 1e-8, options_.linear_tolerance);
        }
    }
}

SolverResult NewtonKrylov::solve_linear(const NonlinearSystem& system, std::span<double> u, SolverCounts& counts) {
    f_.resize(u.size());
    scale_ = system.residual(u, f_);
    ++counts.residual_evaluations;
    double now = norm(f_);
    constexpr int largest_cycles = 100;
    for (int cycle = 0; !(now <= options_.tolerance * scale_); ++cycle) {
        if (cycle == largest_cycles || !std::isfinite(now))
            return {false, now / scale_,
                    fmt::format(
                        "the linear solver left the residual {:.3g} after {} cycles of {} iterations, the tolerance is {:.3g}",
                        now / scale_, cycle, options_.largest_linear_iterations, options_.tolerance)};
        find_step(system, u, 0.5 * options_.tolerance * scale_ / now, options_.largest_linear_iterations, counts);
        now = evaluate(system, u, 1.0, counts);
        std::copy(trial_.begin(), trial_.end(), u.begin());
        f_.swap(trial_f_);
        scale_ = trial_scale_;
    }
    return {true, now > 0.0 ? now / scale_ : 0.0, {}};
}

} // namespace ductile::mpm
