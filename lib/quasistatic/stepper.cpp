#include <ductile/base/error.hpp>
#include <ductile/base/timer.hpp>
#include <ductile/quasistatic/stepper.hpp>

#include <fmt/format.h>
#include <utility>

namespace ductile::quasistatic {

namespace {

VectorField corner_field(const Grid& grid) {
    return {Field(grid.cells_y + 1, grid.cells_x), Field(grid.cells_y + 1, grid.cells_x)};
}

void add_rows(const VectorField& from, VectorField& to) {
#pragma omp parallel for schedule(static)
    for (int j = 0; j < to.u.rows(); ++j)
        for (const auto& [source, target] : {std::pair{&from.u, &to.u}, std::pair{&from.v, &to.v}}) {
            const double* f = source->row(j);
            double* g = target->row(j);
            for (int i = -2; i < target->padded_columns() + 3; ++i)
                g[i] += f[i];
        }
}

} // namespace

ProjectionStepper::ProjectionStepper(const Scene& scene, Predictor predictor, std::unique_ptr<EquilibriumSolver> solver,
                                     State state)
    : scene_(scene), predictor_(predictor), solver_(std::move(solver)), projection_(scene, *solver_), state_(std::move(state)),
      next_(scene.grid), correction_(corner_field(scene.grid)) {}

StepReport ProjectionStepper::step(double dt, double end, const Rk21Options& options) {
    Timer timer;
    const int top = scene_.grid.cells_y;
    const WallVelocity wall = scene_.walls.mean(state_.time, end);
    const WallVelocity change{wall.u - state_.velocity.u(0, top), wall.v - state_.velocity.v(0, top)};
    if (change != WallVelocity{})
        add_affine_velocity(scene_.grid, change, state_.velocity);

    const auto fail = [&](const char* what) {
        return RunError(
            fmt::format("step {} at t = {:.6g} s with dt = {:.3g} s: {}. The step is too large for this scene or the material "
                        "data are extreme: use a smaller --dt (fixed steps) or --tolerance (adaptive steps)",
                        state_.step + 1, state_.time * scene_.units.time, dt * scene_.units.time, what));
    };
    StepReport report;
    report.substeps = predict(scene_, predictor_, state_.cells, state_.velocity, dt, options, next_, correction_).counts;
    if (report.substeps.failed)
        throw fail("the plastic flow of a cell is not finite, or its substep shrank below 1e-12 of the step");
    predictor_seconds_ += timer.lap();

    const bool incremental = predictor_ == Predictor::incremental;
    const double half_height = 0.5 * scene_.grid.height;
    const WallVelocity wall_gradient = incremental ? WallVelocity{} : WallVelocity{wall.u / half_height, wall.v / half_height};
    try {
        report.projection_measure = projection_.apply(correction_, wall_gradient, dt, next_);
    } catch (const RunError& error) {
        throw fail(error.what());
    }
    timer.lap();
    if (incremental)
        add_rows(state_.velocity, correction_);
    else
        add_affine_velocity(scene_.grid, wall, correction_);
    std::swap(state_.cells, next_);
    std::swap(state_.velocity, correction_);
    state_.time = end;
    ++state_.step;
    velocity_seconds_ += timer.lap();
    return report;
}

PhaseSeconds ProjectionStepper::phase_seconds() const {
    return {predictor_seconds_, projection_.solve_seconds(), projection_.update_seconds() + velocity_seconds_};
}

std::size_t ProjectionStepper::memory_bytes() const {
    const Field& cell = next_.internal;
    const Field& corner = correction_.u;
    return 10 * cell.storage().size() * sizeof(double) + 4 * corner.storage().size() * sizeof(double) + solver_->memory_bytes();
}

} // namespace ductile::quasistatic
