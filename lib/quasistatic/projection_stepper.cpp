// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/base/timer.hpp>
#include <ductile/material/point_rates.hpp>
#include <ductile/quasistatic/projection_stepper.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <utility>

namespace ductile::quasistatic {

namespace {

/// Increments dt C : D(v) of the first-order schemes, in units of stress, that make no error worth a look.
constexpr double short_increment = 5e-3;

/// The memory of a state as this stepper lays it out: y_{n-1}, for extrapolation or the change of increments of
/// Predictor::euler, and v_{n-1}, for extrapolation.
struct Earlier {
    CellState& cells;
    double& last_step; ///< dt_n, zero before there is one
};
struct EarlierVelocity {
    VectorField& velocity;
    double& step_before; ///< dt_{n-1}, zero before there is one
};

Earlier earlier_in(State& state) { return {state.memory.cells[0].second, state.memory.numbers[0]}; }
EarlierVelocity earlier_velocity_in(State& state) { return {state.memory.velocities[0].second, state.memory.numbers[1]}; }

} // namespace

Rk21Options PointwiseTolerance::options(const Grid& grid, double dt) const {
    const double tolerance = factor * (scale == Scale::step ? dt * dt : grid.cell_area());
    return {.absolute_tolerance = std::max(tolerance, 1e-16),
            .relative_tolerance = std::max(tolerance, 1e-17),
            .exact_components = 1};
}

ProjectionStepper::ProjectionStepper(const Scene& scene, Predictor predictor, const PointwiseTolerance& pointwise,
                                     std::unique_ptr<Space> space, Transport transport)
    : scene_(scene), predictor_(predictor), pointwise_(pointwise), space_(std::move(space)), transport_(transport),
      projection_(scene, *space_), next_(space_->make_cells()), base_velocity_(space_->make_velocity()),
      correction_(space_->make_velocity()) {
    if (extrapolated() || freezes_transport())
        middle_ = space_->make_cells();
}

void ProjectionStepper::adopt(State& state) const {
    if (state.memory.scheme == scheme())
        return;
    state.memory = {.scheme = std::string(scheme())};
    if (predictor_ != Predictor::euler && !extrapolated())
        return;
    state.memory.cells.emplace_back("earlier", space_->make_cells());
    state.memory.names = {"last_step"};
    if (extrapolated()) {
        state.memory.velocities.emplace_back("earlier_velocity", space_->make_velocity());
        state.memory.names.emplace_back("step_before");
    }
    state.memory.numbers.assign(state.memory.names.size(), 0.0);
}

StepAttempt ProjectionStepper::attempt(State& state, double dt, double end, const Judge& judge, const Within& within) {
    if (within.times.empty())
        return make_step(state, dt, end, judge);
    // what lies within is where shorter steps from the same start end
    before_ = state;
    const StepAttempt result = make_step(state, dt, end, judge);
    if (!result.accepted)
        return result;
    try {
        for (const double time : within.times) {
            within_ = before_;
            make_step(*within_, time - before_->time, time, [](const StepAttempt&) { return true; });
            within_->step = before_->step;
            within.show(*within_);
        }
    } catch (...) {
        state = *before_;
        throw;
    }
    return result;
}

StepAttempt ProjectionStepper::make_step(State& state, double dt, double end, const Judge& judge) {
    Timer timer;
    adopt(state);
    const int top = scene_.grid.cells_y;
    const VectorField* velocity = &state.velocity;
    CellState* transported = &state.cells;
    WallVelocity elastic_past = elastic_walls(state.time > 0.0 ? scene_.walls.before(state.time) : scene_.walls.after(0.0));
    if (extrapolated() && earlier_in(state).last_step > 0.0) {
        const auto [earlier, last_step] = earlier_in(state);
        const auto [earlier_velocity, step_before] = earlier_velocity_in(state);
        const double half = 0.5 * dt / last_step;
        space_->combine(std::array{Space::Term{&state.cells, 1.0 + half}, Space::Term{&earlier, -half}}, middle_);
        transported = &middle_;
        const double weight = (dt + last_step) / (last_step + step_before);
        extrapolate(earlier_velocity, state.velocity, weight, base_velocity_);
        const double before = state.time - last_step - 0.5 * step_before; // the middle of the step before
        elastic_past = elastic_past + weight * (elastic_past - elastic_walls(scene_.walls.after(before)));
        velocity = &base_velocity_;
    }
    // walls under force control: the elastic part of their velocity jumps with the rate of the traction, the rest goes on
    const WallVelocity jump = elastic_walls(scene_.walls.after(state.time)) - elastic_past;
    const auto expected = [&](const WallControl& control, double past, double jump_of_component) {
        return control.by == WallControl::By::velocity ? control.history.mean(state.time, end) : past + jump_of_component;
    };
    WallVelocity wall{expected(scene_.walls.shear, velocity->u(0, top), jump.u),
                      expected(scene_.walls.opening, velocity->v(0, top), jump.v)};
    const WallVelocity change{wall.u - velocity->u(0, top), wall.v - velocity->v(0, top)};
    if (change != WallVelocity{}) {
        if (velocity != &base_velocity_)
            base_velocity_ = state.velocity;
        space_->add_affine(change, base_velocity_);
        velocity = &base_velocity_;
    }

    const auto fail = [&](const char* what) {
        return RunError(
            fmt::format("step {} at t = {:.6g} s with dt = {:.3g} s: {}. The step is too large for this scene or the material "
                        "data are extreme: use a smaller --dt (fixed steps) or --tolerance (adaptive steps)",
                        state.step + 1, state.time * scene_.units.time, dt * scene_.units.time, what));
    };
    const Rk21Counts counts = space_->predict(predictor_, state.cells, *transported, *velocity, dt,
                                              pointwise_.options(scene_.grid, dt), next_, correction_);
    substeps_ += counts.accepted;
    rejected_substeps_ += counts.rejected;
    predictor_seconds_ += timer.lap();
    if (counts.failed)
        throw fail("the plastic flow of a cell is not finite, or its substep shrank below 1e-12 of the step");

    const bool incremental = predictor_ == Predictor::incremental;
    WallVelocity added = incremental ? WallVelocity{} : wall; // that the predictor left out
    if (scene_.walls.by_traction()) {
        const WallVelocity forced =
            wall_velocity_between(scene_, space_->mean_traction(next_.stress), wanted_traction(scene_, end), dt);
        if (scene_.walls.shear.by == WallControl::By::traction)
            added.u = forced.u;
        if (scene_.walls.opening.by == WallControl::By::traction)
            added.v = forced.v;
        wall = incremental ? wall + added : added;
    }
    next_.wall = state.cells.wall + dt * wall;
    StepAttempt result;
    try {
        result.measure = projection_.apply(correction_, added, dt, next_);
        if (incremental)
            result.measure = std::hypot(result.measure, projection_.measure_of(added, dt));
    } catch (const RunError& error) {
        throw fail(error.what());
    }
    timer.lap();
    space_->add_affine(added, correction_);
    if (incremental)
        add(*velocity, correction_);
    next_.energy.work += 0.5 * dt * (space_->wall_power(state.cells.stress, wall) + space_->wall_power(next_.stress, wall));
    velocity_seconds_ += timer.lap();
    result.error = estimate_error(state, dt, wall, result.measure, counts);
    result.accepted = judge(result);
    if (result.accepted)
        accept(state, dt, end);
    return result;
}

WallVelocity ProjectionStepper::elastic_walls(const WallRates& told) const {
    return wall_velocity_between(scene_, {}, {told.shear, told.opening}, 1.0);
}

double ProjectionStepper::estimate_error(State& state, double dt, const WallVelocity& wall, double measure,
                                         const Rk21Counts& counts) {
    const double half_height = 0.5 * scene_.grid.height;
    const StressComponents<double> rate =
        elastic_rate(scene_.law->elasticity(), VelocityGradient<double>{0.0, wall.u / half_height, 0.0, wall.v / half_height});
    const double by_walls =
        dt * std::sqrt(3.0 * rate.p * rate.p + 2.0 * (rate.s * rate.s + rate.tau * rate.tau) + 6.0 * rate.q * rate.q);
    const double by_correction = std::sqrt(2.0) * scene_.law->elasticity().shear_modulus * measure;
    const double spin = freezes_transport() ? 0.5 * dt * std::abs(wall.u) / half_height * by_walls : 0.0;
    const Rk21Options options = pointwise_.options(scene_.grid, dt);
    const double pointwise =
        std::sqrt(10.0 * counts.largest_error_square) * (options.absolute_tolerance + options.relative_tolerance);
    if (predictor_ == Predictor::incremental)
        return spin + pointwise + (counts.accepted > 0 ? by_correction : 0.0);

    const double increment = by_walls + by_correction;
    if (increment < short_increment)
        return 0.0;
    if (predictor_ == Predictor::euler && state.step > 0)
        return earlier_in(state).last_step > 0.0 ? change_of_increment(state, dt) : 0.0;
    if (counts.accepted > 0)
        return spin + pointwise + increment;
    const double excess = space_->yield_ratio(next_, 0.0, next_) - 1.0; // of cells that the predictor left elastic
    return spin + std::min(increment, std::sqrt(2.0) * std::max(excess, 0.0));
}

double ProjectionStepper::frozen_transport(State& state) {
    if (!freezes_transport())
        return 0.0;
    space_->transport(state.cells, state.velocity, next_, correction_);
    space_->transport(next_, state.velocity, middle_, correction_);
    return 0.5 * space_->norm(std::array{Space::Term{&middle_, 1.0}}).largest();
}

double ProjectionStepper::change_of_increment(State& state, double dt) {
    const auto [earlier, last_step] = earlier_in(state);
    const double ratio = dt / last_step;
    const double change =
        largest_norm(scene_, *space_,
                     std::array{Space::Term{&next_, 1.0}, Space::Term{&state.cells, -1.0 - ratio}, Space::Term{&earlier, ratio}});
    return change * dt / (dt + last_step);
}

void ProjectionStepper::accept(State& state, double dt, double end) {
    std::swap(state.cells, next_); // y_n in next_
    std::swap(state.velocity, correction_);
    if (extrapolated()) {
        const auto [earlier_velocity, step_before] = earlier_velocity_in(state);
        std::swap(earlier_velocity, correction_);
        step_before = earlier_in(state).last_step;
    }
    if (!state.memory.cells.empty()) {
        const auto [earlier, last_step] = earlier_in(state);
        std::swap(earlier, next_);
        last_step = dt;
    }
    state.time = end;
    ++state.step;
}

std::string_view ProjectionStepper::scheme() const {
    switch (predictor_) {
    case Predictor::euler:
        return "euler";
    case Predictor::substepped:
        return "substepped";
    case Predictor::incremental:
        return extrapolated() ? "extrapolated" : "incremental";
    }
    __builtin_unreachable();
}

StepperCounts ProjectionStepper::counts() const {
    return {.elliptic_solves = projection_.solves(), .pointwise_substeps = substeps_, .rejected_substeps = rejected_substeps_};
}

PhaseSeconds ProjectionStepper::phase_seconds() const {
    return {{"predictor", predictor_seconds_},
            {"elliptic solve", projection_.solve_seconds()},
            {"update", projection_.update_seconds() + velocity_seconds_}};
}

std::size_t ProjectionStepper::memory_bytes() const {
    const Field& cell = next_.stress.p;
    const Field& corner = correction_.u;
    const int states = (extrapolated() ? 4 : predictor_ == Predictor::euler ? 3 : 2) + (freezes_transport() ? 1 : 0);
    const std::size_t cells = static_cast<std::size_t>(next_.count()) * static_cast<std::size_t>(states);
    const std::size_t corners = extrapolated() ? 8 : 6;
    return cells * cell.storage().size() * sizeof(double) + corners * corner.storage().size() * sizeof(double) +
           space_->memory_bytes();
}

} // namespace ductile::quasistatic
