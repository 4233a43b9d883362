#include <ductile/base/error.hpp>
#include <ductile/base/threads.hpp>
#include <ductile/base/timer.hpp>
#include <ductile/material/point_rates.hpp>
#include <ductile/quasistatic/combination.hpp>
#include <ductile/quasistatic/method_of_lines.hpp>
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

void add_rows(const VectorField& from, VectorField& to) {
    for_each_row({to.u.rows(), to.u.columns()}, [&](int j) {
        for (const auto& [source, target] : {std::pair{&from.u, &to.u}, std::pair{&from.v, &to.v}}) {
            const double* f = source->row(j);
            double* g = target->row(j);
            for (int i = -2; i < target->padded_columns() + 3; ++i)
                g[i] += f[i];
        }
    });
}

} // namespace

Rk21Options PointwiseTolerance::options(const Grid& grid, double dt) const {
    const double tolerance = factor * (scale == Scale::step ? dt * dt : grid.cell_area());
    return {.absolute_tolerance = std::max(tolerance, 1e-16),
            .relative_tolerance = std::max(tolerance, 1e-17),
            .exact_components = 1};
}

ProjectionStepper::ProjectionStepper(const Scene& scene, Predictor predictor, const PointwiseTolerance& pointwise,
                                     std::unique_ptr<EquilibriumSolver> solver, State state, Transport transport)
    : scene_(scene), predictor_(predictor), pointwise_(pointwise), solver_(std::move(solver)), projection_(scene, *solver_),
      state_(std::move(state)), next_(scene), base_velocity_(scene.grid), correction_(scene.grid) {
    if (predictor == Predictor::euler)
        earlier_ = CellState(scene);
    if (transport == Transport::extrapolated)
        past_ = Past{CellState(scene), CellState(scene), VectorField(scene.grid)};
}

StepAttempt ProjectionStepper::attempt(double dt, double end) {
    Timer timer;
    const int top = scene_.grid.cells_y;
    const WallVelocity wall = scene_.walls.mean(state_.time, end);
    const VectorField* velocity = &state_.velocity;
    CellState* transported = &state_.cells;
    if (past_ && past_->last_step > 0.0) {
        const double half = 0.5 * dt / past_->last_step;
        combine(scene_, std::array{Term{&state_.cells, 1.0 + half}, Term{&past_->cells, -half}}, past_->middle);
        transported = &past_->middle;
        extrapolate(past_->velocity, state_.velocity, (dt + past_->last_step) / (past_->last_step + past_->step_before),
                    base_velocity_);
        velocity = &base_velocity_;
    }
    const WallVelocity change{wall.u - velocity->u(0, top), wall.v - velocity->v(0, top)};
    if (change != WallVelocity{}) {
        if (velocity != &base_velocity_)
            base_velocity_ = state_.velocity;
        add_affine_velocity(scene_.grid, change, base_velocity_);
        velocity = &base_velocity_;
    }

    const auto fail = [&](const char* what) {
        return RunError(
            fmt::format("step {} at t = {:.6g} s with dt = {:.3g} s: {}. The step is too large for this scene or the material "
                        "data are extreme: use a smaller --dt (fixed steps) or --tolerance (adaptive steps)",
                        state_.step + 1, state_.time * scene_.units.time, dt * scene_.units.time, what));
    };
    const Rk21Counts counts = predict(scene_, predictor_, state_.cells, *transported, *velocity, dt,
                                      pointwise_.options(scene_.grid, dt), next_, correction_)
                                  .counts;
    substeps_ += counts.accepted;
    rejected_substeps_ += counts.rejected;
    predictor_seconds_ += timer.lap();
    if (counts.failed)
        throw fail("the plastic flow of a cell is not finite, or its substep shrank below 1e-12 of the step");

    const bool incremental = predictor_ == Predictor::incremental;
    const double half_height = 0.5 * scene_.grid.height;
    const WallVelocity wall_gradient = incremental ? WallVelocity{} : WallVelocity{wall.u / half_height, wall.v / half_height};
    StepAttempt result;
    try {
        result.measure = projection_.apply(correction_, wall_gradient, dt, next_);
    } catch (const RunError& error) {
        throw fail(error.what());
    }
    timer.lap();
    if (incremental)
        add_rows(*velocity, correction_);
    else
        add_affine_velocity(scene_.grid, wall, correction_);
    length_ = dt;
    end_ = end;
    velocity_seconds_ += timer.lap();
    result.error = estimate_error(dt, wall, result.measure, counts);
    return result;
}

double ProjectionStepper::estimate_error(double dt, const WallVelocity& wall, double measure, const Rk21Counts& counts) {
    const double half_height = 0.5 * scene_.grid.height;
    const StressComponents<double> rate =
        elastic_rate(scene_.law->elasticity(), VelocityGradient<double>{0.0, wall.u / half_height, 0.0, wall.v / half_height});
    const double by_walls =
        dt * std::sqrt(3.0 * rate.p * rate.p + 2.0 * (rate.s * rate.s + rate.tau * rate.tau) + 6.0 * rate.q * rate.q);
    const double by_correction = std::sqrt(2.0) * scene_.law->elasticity().shear_modulus * measure;
    const double spin = scene_.model == Model::full && !past_ ? 0.5 * dt * std::abs(wall.u) / half_height * by_walls : 0.0;
    const Rk21Options options = pointwise_.options(scene_.grid, dt);
    const double pointwise =
        std::sqrt(10.0 * counts.largest_error_square) * (options.absolute_tolerance + options.relative_tolerance);
    if (predictor_ == Predictor::incremental)
        return spin + pointwise + (counts.accepted > 0 ? by_correction : 0.0);

    const double increment = by_walls + by_correction;
    if (increment < short_increment)
        return 0.0;
    if (predictor_ == Predictor::euler && state_.step > 0)
        return earlier_step_ > 0.0 ? change_of_increment(dt) : 0.0;
    if (counts.accepted > 0)
        return spin + pointwise + increment;
    const double excess = yield_ratio(scene_, next_, 0.0, next_) - 1.0; // of cells that the predictor left elastic
    return spin + std::min(increment, std::sqrt(2.0) * std::max(excess, 0.0));
}

double ProjectionStepper::change_of_increment(double dt) {
    const double ratio = dt / earlier_step_;
    const CombinationNorm change =
        norm(scene_, std::array{Term{&next_, 1.0}, Term{&state_.cells, -1.0 - ratio}, Term{&earlier_, ratio}});
    return change.largest() * dt / (dt + earlier_step_);
}

void ProjectionStepper::accept() {
    if (predictor_ == Predictor::euler) {
        std::swap(earlier_, next_); // y_{n+1} in earlier_
        std::swap(earlier_, state_.cells);
        earlier_step_ = length_;
    } else {
        std::swap(state_.cells, next_);
    }
    std::swap(state_.velocity, correction_);
    if (past_) {
        std::swap(past_->cells, next_);
        std::swap(past_->velocity, correction_);
        past_->step_before = past_->last_step;
        past_->last_step = length_;
    }
    state_.time = end_;
    ++state_.step;
}

Scheme ProjectionStepper::scheme() const {
    switch (predictor_) {
    case Predictor::euler:
        return Scheme::euler;
    case Predictor::substepped:
        return Scheme::substepped;
    case Predictor::incremental:
        return past_ ? Scheme::extrapolated : Scheme::incremental;
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
    const std::size_t cells = static_cast<std::size_t>(next_.count()) * (past_ ? 4 : predictor_ == Predictor::euler ? 3 : 2);
    const std::size_t corners = past_ ? 8 : 6;
    return cells * cell.storage().size() * sizeof(double) + corners * corner.storage().size() * sizeof(double) +
           solver_->memory_bytes();
}

std::vector<std::pair<std::string, Field*>> ProjectionStepper::hidden_fields() {
    if (!past_)
        return {};
    std::vector<std::pair<std::string, Field*>> fields{{"earlier_velocity_x", &past_->velocity.u},
                                                       {"earlier_velocity_y", &past_->velocity.v}};
    for (int k = 0; k < past_->cells.count(); ++k)
        fields.emplace_back(fmt::format("earlier_{}", field_names(scene_)[static_cast<std::size_t>(k)]), &past_->cells.field(k));
    return fields;
}

std::vector<std::pair<std::string, double*>> ProjectionStepper::hidden_numbers() {
    if (!past_)
        return {};
    return {{"last_step", &past_->last_step}, {"step_before", &past_->step_before}};
}

} // namespace ductile::quasistatic
