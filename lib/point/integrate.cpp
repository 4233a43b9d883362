// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/material/point_rates.hpp>
#include <ductile/ode/rk21.hpp>
#include <ductile/point/integrate.hpp>
#include <ductile/sundials/cvode.hpp>
#include <ductile/sundials/erk.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <span>

namespace ductile::point {

namespace {

sundials::RightHandSide right_hand_side(const Law& law, const VelocityGradient<double>& gradient) {
    return [law, gradient](double, std::span<const double> y, std::span<double> slope) { rate(law, gradient, y, slope); };
}

/// Appends the steps of a segment that begins at the last time of the trajectory.
class Appender {
public:
    explicit Appender(Trajectory& trajectory) : trajectory_(trajectory), start_(trajectory.time.back()) {}

    void operator()(double t, std::span<const double> y) const {
        trajectory_.time.push_back(start_ + t);
        trajectory_.state.emplace_back(y.begin(), y.end());
    }

private:
    Trajectory& trajectory_;
    double start_;
};

/// Of a law with n internal variables.
template <std::size_t n> void append_rk21(const Law& law, const Segment& segment, double tolerance, Trajectory& trajectory) {
    if (law->variables().size() != n) {
        if constexpr (n < most_variables)
            append_rk21<n + 1>(law, segment, tolerance, trajectory);
        return;
    }
    using Point = std::array<double, 4 + n>;
    const Appender append(trajectory);
    Point y;
    std::ranges::copy(trajectory.state.back(), y.begin());
    Rk21Counts counts;
    double t = 0.0;
    const auto observe = [&](bool accepted, double h, const Point& state) {
        if (!accepted)
            return;
        t = std::min(t + h, segment.duration);
        append(t, state);
    };
    const auto f = [&](const Point& state) {
        Point slope;
        rate(law, segment.gradient, state, slope);
        return slope;
    };
    integrate_rk21(f, y, true, segment.duration, {.absolute_tolerance = tolerance, .relative_tolerance = tolerance}, counts,
                   observe);
    if (counts.failed)
        throw RunError(fmt::format("the step shrank to nothing at t = {:.6g}: the rates are not finite or hopelessly stiff",
                                   trajectory.time.back()));
    trajectory.counts.steps += counts.accepted;
    trajectory.counts.rejected += counts.rejected;
    trajectory.counts.evaluations += 1 + 2 * (counts.accepted + counts.rejected);
}

void add(sundials::Counts& sum, const sundials::Counts& counts) {
    sum.steps += counts.steps;
    sum.rejected += counts.rejected;
    sum.evaluations += counts.evaluations;
}

void append_with(auto&& integrator, const Segment& segment, Trajectory& trajectory) {
    State y = trajectory.state.back();
    integrator.integrate(y, 0.0, segment.duration, Appender(trajectory));
    add(trajectory.counts, integrator.counts());
}

sundials::ErkOptions erk_options(Method method, double tolerance) {
    sundials::ErkOptions options{.relative_tolerance = tolerance, .absolute_tolerance = tolerance};
    switch (method) {
    case Method::arkode_rk21:
        options.table = sundials::paper_rk21();
        options.step_control = sundials::StepControl::lu_rycroft;
        break;
    case Method::bogacki_shampine:
        options.method = sundials::ErkMethod::bogacki_shampine;
        break;
    case Method::zonneveld:
        options.method = sundials::ErkMethod::zonneveld;
        break;
    case Method::cash_karp:
        options.method = sundials::ErkMethod::cash_karp;
        break;
    default:
        options.method = sundials::ErkMethod::dormand_prince;
        break;
    }
    return options;
}

void append(const Law& law, const Segment& segment, Method method, double tolerance, Trajectory& trajectory) {
    if (method == Method::rk21)
        return append_rk21<0>(law, segment, tolerance, trajectory);
    const sundials::RightHandSide f = right_hand_side(law, segment.gradient);
    const std::size_t size = trajectory.state.back().size();
    if (method == Method::adams || method == Method::bdf)
        append_with(sundials::CvodeIntegrator(
                        f, size,
                        {.method = method == Method::bdf ? sundials::CvodeMethod::bdf : sundials::CvodeMethod::adams,
                         .relative_tolerance = tolerance,
                         .absolute_tolerance = tolerance}),
                    segment, trajectory);
    else
        append_with(sundials::ErkIntegrator(f, size, erk_options(method, tolerance)), segment, trajectory);
}

} // namespace

void rate(const Law& law, const VelocityGradient<double>& g, std::span<const double> y, std::span<double> slope) {
    const StressComponents<double> elastic = elastic_rate(law->elasticity(), g);
    const double turn = g.uy - g.vx;
    slope[0] = elastic.p;
    slope[1] = elastic.s + turn * y[2];
    slope[2] = elastic.tau - turn * y[1];
    slope[3] = elastic.q;
    std::fill(slope.begin() + 4, slope.end(), 0.0);
    law->add_flow_rate(y.data() + 1, slope.data() + 1);
}

std::string_view name(Method method) {
    switch (method) {
    case Method::rk21:
        return "rk21";
    case Method::arkode_rk21:
        return "arkode-2-rk21";
    case Method::bogacki_shampine:
        return "arkode-3-bogacki-shampine";
    case Method::zonneveld:
        return "arkode-4-zonneveld";
    case Method::cash_karp:
        return "arkode-5-cash-karp";
    case Method::dormand_prince:
        return "arkode-5-dormand-prince";
    case Method::adams:
        return "cvode-adams";
    case Method::bdf:
        return "cvode-bdf";
    }
    __builtin_unreachable();
}

Trajectory integrate(const Law& law, const GradientHistory& history, const State& start, Method method, double tolerance) {
    check(history);
    Trajectory trajectory{.time = {0.0}, .state = {start}};
    try {
        for (const Segment& segment : history) {
            append(law, segment, method, tolerance, trajectory);
            trajectory.segment_end.push_back(trajectory.time.size() - 1);
        }
    } catch (const RunError& error) {
        throw RunError(fmt::format("{}, tolerance {:g}, segment {} of the loading: {} (times in natural units); change the "
                                   "tolerance, the rate of loading or the material",
                                   name(method), tolerance, trajectory.segment_end.size() + 1, error.what()));
    }
    return trajectory;
}

double largest_error(const Law& law, const GradientHistory& history, const Trajectory& trajectory) {
    State scale(4, 1.0);
    for (const InternalVariable& variable : law->variables())
        scale.push_back(variable.natural_scale());
    State y = trajectory.state.front();
    double largest = 0.0;
    std::size_t i = 1;
    for (std::size_t k = 0; k < history.size(); ++k) {
        sundials::ErkIntegrator reference(
            right_hand_side(law, history[k].gradient), y.size(),
            {.relative_tolerance = 1e-13, .absolute_tolerance = 1e-14, .first_step = history[k].duration});
        for (; i <= trajectory.segment_end[k]; ++i) {
            if (trajectory.time[i] > trajectory.time[i - 1])
                reference.integrate(y, trajectory.time[i - 1], trajectory.time[i]);
            for (std::size_t c = 0; c < y.size(); ++c)
                largest = std::max(largest, std::abs(trajectory.state[i][c] - y[c]) / scale[c]);
        }
    }
    return largest;
}

} // namespace ductile::point
