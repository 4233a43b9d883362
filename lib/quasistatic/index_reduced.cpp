// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/base/timer.hpp>
#include <ductile/quasistatic/index_reduced.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace ductile::quasistatic {

namespace {

/// The memory of a state as this stepper lays it out.
struct Kept {
    CellState& rate; ///< complete
    VectorField& earlier_velocity;
    double &earlier_step, &relaxation;
    double &told_shear, &told_opening; ///< to the walls, for this rate; not a number before there is one
    std::span<double> of_method;
};

constexpr std::array own_numbers{"earlier_step", "relaxation", "told_shear", "told_opening"};

Kept kept_in(State& state) {
    std::vector<double>& n = state.memory.numbers;
    return {state.memory.cells[0].second,
            state.memory.velocities[0].second,
            n[0],
            n[1],
            n[2],
            n[3],
            std::span(n).subspan(own_numbers.size())};
}

} // namespace

IndexReducedStepper::IndexReducedStepper(std::string scheme, const Scene& scene, std::unique_ptr<Space> space,
                                         const PassOptions& passes, const MakeCellMethod& make_method)
    : scheme_(std::move(scheme)), scene_(scene), space_(std::move(space)), system_(scene, *space_, passes),
      method_(make_method(system_)), next_(space_->make_cells()), next_rate_(next_) {}

void IndexReducedStepper::adopt(State& state) const {
    if (state.memory.scheme == scheme_)
        return;
    state.memory = {.scheme = scheme_,
                    .cells = {{"rate", space_->make_cells()}},
                    .velocities = {{"earlier_velocity", space_->make_velocity()}}};
    for (const char* name : own_numbers)
        state.memory.names.push_back(name);
    for (const std::string& name : method_->memory())
        state.memory.names.push_back(name);
    state.memory.numbers.assign(state.memory.names.size(), 0.0);
    kept_in(state).told_shear = std::numeric_limits<double>::quiet_NaN();
}

void IndexReducedStepper::provide_rate(State& state) {
    adopt(state);
    const Kept kept = kept_in(state);
    // also where the walls' velocity jumps at t_n: v and the rate jump with it
    const WallRates told = scene_.walls.after(state.time);
    if (told == WallRates{kept.told_shear, kept.told_opening})
        return;
    const RateReport report = system_.lines().evaluate(state.cells, told, state.velocity, kept.rate);
    space_->close(state.velocity, kept.rate);
    kept.relaxation = report.largest_relaxation;
    kept.told_shear = told.shear;
    kept.told_opening = told.opening;
}

void IndexReducedStepper::renew(State& state) {
    adopt(state);
    kept_in(state).told_shear = std::numeric_limits<double>::quiet_NaN();
    provide_rate(state);
}

double IndexReducedStepper::time_scale(State& state) {
    provide_rate(state);
    return 1.0 / system_.norm(std::array{Space::Term{&kept_in(state).rate, 1.0}});
}

double IndexReducedStepper::limit_step(State& state, double dt) {
    provide_rate(state);
    const CellState &cells = state.cells, &rate = kept_in(state).rate;
    constexpr double touching = 1.0 - 1e-9;
    const double ratio = space_->yield_ratio(cells, 0.0, rate);
    if (ratio >= touching)
        return dt;
    // sbar is convex along the straight elastic path: the chord meets yield before the path does, and repeated chords converge
    double begin = 0.0, begin_ratio = ratio;
    const double end_ratio = space_->yield_ratio(cells, dt, rate);
    if (end_ratio <= 1.0)
        return dt;
    for (int pass = 0; pass < 20 && begin_ratio < touching; ++pass) {
        begin += (dt - begin) * (1.0 - begin_ratio) / (end_ratio - begin_ratio);
        begin_ratio = space_->yield_ratio(cells, begin, rate);
    }
    return begin;
}

StepAttempt IndexReducedStepper::attempt(State& state, double dt, double end, const Judge& judge, const Within& within) {
    const Timer timer;
    provide_rate(state);
    const Kept kept = kept_in(state);
    system_.begin_step(state.time, dt, end);
    system_.begin_velocities(state.velocity, kept.earlier_velocity, kept.earlier_step);
    fractions_.clear();
    for (const double time : within.times)
        fractions_.push_back(std::clamp((time - state.time) / dt, 0.0, 1.0));
    if (!fractions_.empty() && !within_) {
        within_ = State{.cells = space_->make_cells(), .velocity = space_->make_velocity()};
        rate_within_ = space_->make_cells();
    }
    // kept until the step is accepted: one that is broken off has shown nothing
    passed_.clear();
    const auto keep = [&](double, const CellState& cells) { passed_.push_back(cells); };
    const time::Step<CellState> step{.start = state.cells,
                                     .start_rate = kept.rate,
                                     .next = next_,
                                     .next_rate = next_rate_,
                                     .dt = dt,
                                     .relaxation = kept.relaxation,
                                     .memory = kept.of_method,
                                     .within = fractions_,
                                     .show = keep};
    const auto fail = [&](const char* what) {
        return RunError(fmt::format(
            "step {} at t = {:.6g} s with dt = {:.3g} s: {}. The step is too large for this scene or the material data "
            "are extreme: use a smaller --dt (fixed steps) or --tolerance (adaptive steps)",
            state.step + 1, state.time * scene_.units.time, dt * scene_.units.time, what));
    };
    double error = 0.0;
    try {
        error = method_->advance(step);
    } catch (const RunError& failure) {
        throw fail(failure.what());
    }
    if (!std::isfinite(error))
        throw fail("the error estimate is not finite");
    attempt_seconds_ += timer.seconds();
    StepAttempt result{.measure = error,
                       .error = error,
                       .relaxation_step = method_->relaxation_step(system_.latest().largest_relaxation, kept.of_method),
                       .advection_step = method_->courant_number(kept.of_method) / system_.latest().courant_rate};
    result.accepted = judge(result);
    if (!result.accepted)
        return result;
    for (std::size_t k = 0; k < fractions_.size(); ++k) {
        if (method_->interpolates())
            method_->interpolate(step, fractions_[k], within_->cells);
        else
            std::swap(within_->cells, passed_[k]);
        show(state, fractions_[k], within.times[k], within);
    }
    accept(state, dt, end, error);
    return result;
}

void IndexReducedStepper::show(const State& state, double fraction, double time, const Within& within) {
    within_->time = time;
    within_->step = state.step;
    // from a guess on the line through the beginning and the latest velocity
    extrapolate(state.velocity, system_.velocity(), fraction - 1.0, within_->velocity);
    system_.lines().evaluate(within_->cells, system_.told(fraction), within_->velocity, *rate_within_);
    within.show(*within_);
}

void IndexReducedStepper::accept(State& state, double dt, double end, double error) {
    const Kept kept = kept_in(state);
    const WallRates told = scene_.walls.before(end);
    std::swap(state.cells, next_);
    std::swap(kept.rate, next_rate_);
    std::swap(kept.earlier_velocity, state.velocity);
    system_.swap_velocity(state.velocity);
    kept.relaxation = system_.latest().largest_relaxation;
    kept.told_shear = told.shear;
    kept.told_opening = told.opening;
    kept.earlier_step = dt;
    state.time = end;
    ++state.step;
    method_->accept(dt, error, kept.relaxation, kept.of_method);
}

StepperCounts IndexReducedStepper::counts() const {
    StepperCounts counts = system_.counts();
    counts.inner_steps = method_->inner_counts().steps;
    counts.rejected_inner_steps = method_->inner_counts().rejected;
    return counts;
}

PhaseSeconds IndexReducedStepper::phase_seconds() const {
    const double rates = system_.lines().rate_seconds(), solves = system_.lines().solve_seconds();
    return {{"rates", rates}, {"elliptic solve", solves}, {"combination", std::max(attempt_seconds_ - rates - solves, 0.0)}};
}

std::size_t IndexReducedStepper::memory_bytes() const {
    const std::size_t cell = static_cast<std::size_t>(next_.count()) * next_.stress.p.storage().size() * sizeof(double);
    return static_cast<std::size_t>(4 + method_->buffers()) * cell + 6 * system_.velocity_bytes() + space_->memory_bytes();
}

std::vector<std::pair<std::string, long long>> IndexReducedStepper::steps_by_method(const State& state) const {
    if (state.memory.scheme != scheme_)
        return {};
    return method_->steps_by_method(std::span(state.memory.numbers).subspan(own_numbers.size()));
}

} // namespace ductile::quasistatic
