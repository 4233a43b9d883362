// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/quasistatic/accuracy_watch.hpp>
#include <ductile/quasistatic/doubts.hpp>
#include <ductile/quasistatic/projection.hpp>

#include <cmath>
#include <fmt/format.h>
#include <tuple>

namespace ductile::quasistatic {

namespace {
constexpr const char* remedy =
    "use a smaller --dt (fixed steps) or --tolerance (adaptive steps), or leave out --scheme and --step";
}

AccuracyWatch::AccuracyWatch(const Scene& scene, const Space& space)
    : scene_(scene), space_(space), force_(space.make_velocity()), rate_(scene.grid.cells_y, scene.grid.cells_x) {}

void AccuracyWatch::judge(const StepAttempt& attempt, double time, double dt) {
    if (!(attempt.error <= largest_error))
        throw RunError(fmt::format(
            "step at t = {:.6g} s with dt = {:.3g} s: its error is an estimated {:.2g} of the yield stress (or of the "
            "internal variable's scale); beyond {:g} numbers mean nothing: {}",
            time * scene_.units.time, dt * scene_.units.time, attempt.error, largest_error, remedy));
    if (attempt.error > error_) {
        error_ = attempt.error;
        error_time_ = time;
        error_step_ = dt;
    }
}

void AccuracyWatch::observe_walls(const State& state) {
    const int top = scene_.grid.cells_y;
    const double speed = std::hypot(state.velocity.u(0, top), state.velocity.v(0, top)) * scene_.units.velocity();
    if (!(speed < shear_wave_speed(scene_)))
        throw RunError(
            fmt::format("at t = {:.6g} s the walls run away under their load: they move at {:.4g} m/s, and shear waves at "
                        "{:.4g} m/s: the material does not bear it; lower the traction",
                        state.time * scene_.units.time, speed, shear_wave_speed(scene_)));
    if (speed > wall_speed_) {
        wall_speed_ = speed;
        wall_speed_time_ = state.time;
    }
}

void AccuracyWatch::observe_flow(const State& state) {
    // what strains less than to yield in all of the time counts for nothing
    const double negligible = 1.0 / (scene_.law->elasticity().shear_modulus * state.time);
    const Unresolved now = space_.unresolved_flow(state.cells, negligible, rate_);
    if (now.x > flow_.x)
        flow_x_time_ = state.time;
    if (now.y > flow_.y)
        flow_y_time_ = state.time;
    flow_.take(now);
}

void AccuracyWatch::begin(const State& state) {
    elastic_energy_ = space_.observe(state.cells).elastic_energy;
    time_ = state.time;
}

double AccuracyWatch::relative_energy_error(double elastic_energy, const EnergyFlow& passed) const {
    const double scale = std::max(elastic_energy_, work_magnitude_);
    return scale > 0.0 ? energy_error(elastic_energy, passed) / scale : 0.0;
}

void AccuracyWatch::observe(State& state, bool last, TimeStepper& stepper) {
    squares_ += (state.time - time_) * (state.time - time_);
    time_ = state.time;
    work_magnitude_ += std::abs(state.cells.energy.work - work_);
    work_ = state.cells.energy.work;
    if (scene_.walls.by_traction())
        observe_walls(state);
    if (state.step % flow_interval == 0 || last)
        observe_flow(state);
    if (state.step % residual_interval != 0 && !last)
        return;
    const double frozen = stepper.frozen_transport(state);
    frozen_ += squares_ * std::max(frozen, frozen_before_);
    frozen_before_ = frozen;
    squares_ = 0.0;
    unresolved_ = space_.unresolved(state.cells);
    const double residual = space_.equilibrium_residual(state.cells.stress, force_);
    if (!(residual <= residual_)) {
        residual_ = residual;
        residual_time_ = state.time;
    }
}

std::vector<std::string> AccuracyWatch::warnings() const {
    std::vector<std::string> sentences;
    if (error_ > doubtful_error)
        sentences.push_back(fmt::format("the step at t = {:.6g} s with dt = {:.3g} s has an estimated error of {:.2g} of the "
                                        "yield stress (or of the internal "
                                        "variable's scale): {}",
                                        error_time_ * scene_.units.time, error_step_ * scene_.units.time, error_, remedy));
    if (!(frozen_ <= doubtful_error))
        sentences.push_back(
            fmt::format("spin and advection, which the scheme takes as at the start of each step, have an estimated error of "
                        "{:.2g} of the yield stress (or of the internal variable's scale) by now: use --scheme "
                        "extrapolated or auto, or a smaller --dt",
                        frozen_));
    if (!(residual_ <= doubtful_residual))
        sentences.push_back(
            fmt::format("the stress is out of equilibrium by {:.2g} of itself from cell to cell at t = {:.6g} s: use "
                        "--operator exact",
                        residual_, residual_time_ * scene_.units.time));
    for (const auto& [share, direction] : {std::pair{unresolved_.x, "x"}, std::pair{unresolved_.y, "y"}})
        if (!(share <= unresolved))
            sentences.push_back(
                fmt::format("the finest scales of the space in {} hold {:.2g} of the yield stress (or of the internal "
                            "variable's scale) somewhere: what is finer is not shown: use more --cells in {}",
                            direction, share, direction));
    for (const auto& [share, direction, time] : {std::tuple{flow_.x, "x", flow_x_time_}, std::tuple{flow_.y, "y", flow_y_time_}})
        if (!(share <= unresolved_flow))
            sentences.push_back(fmt::format(
                "at t = {:.6g} s the finest scales of the space in {} held {:.2g} of the plastic strain rate where that is "
                "largest: bands are thinner than is shown, and where they form is no result: use more --cells in {}, or "
                "elements that follow them (--space elements --adapt-elements)",
                time * scene_.units.time, direction, share, direction));
    if (edge_corrections_ > doubtful_move)
        sentences.push_back(
            fmt::format("whenever edges of elements moved, {:.0f} times, equilibrium took changes of stress that add up "
                        "to {:.2g} of itself: use more --cells in y",
                        edge_moves_, edge_corrections_));
    if (wall_speed_ > inertial_wall_speed(scene_))
        sentences.push_back(fmt::format("under their load the walls moved at {:.4g} m/s at t = {:.6g} s, and inertia, which is "
                                        "left out here, counts from {:.3g} m/s on: lower the traction, or end the run earlier",
                                        wall_speed_, wall_speed_time_ * scene_.units.time, inertial_wall_speed(scene_)));
    return sentences;
}

std::optional<std::string> AccuracyWatch::ledger_warning(double elastic_energy, const EnergyFlow& passed) const {
    const double relative = relative_energy_error(elastic_energy, passed);
    const double scale = std::max(elastic_energy_, work_magnitude_), by_advection = scale > 0.0 ? passed.transport / scale : 0.0;
    const double by_steps = relative - by_advection;
    const auto doubtful = [](double part) { return !(std::abs(part) <= doubtful_energy); };
    if (doubtful(relative))
        return fmt::format("the ledger of energy does not close: {:.2g} of the work of the walls is unaccounted for, {}",
                           relative,
                           std::abs(by_advection) > 0.5 * std::abs(relative)
                               ? "most of it because the cells are too coarse for what is advected: use more --cells"
                               : fmt::format("because of the steps: {}", remedy));
    if (doubtful(by_advection) && doubtful(by_steps))
        return fmt::format(
            "the ledger of energy closes only because two errors cancel, {:.2g} of the work of the walls by advection and "
            "{:.2g} by the steps: use more --cells, and {}",
            by_advection, by_steps, remedy);
    return std::nullopt;
}

std::vector<std::pair<std::string, double*>> AccuracyWatch::hidden_numbers() {
    return {{"largest_error", &error_},
            {"largest_error_time", &error_time_},
            {"largest_error_step", &error_step_},
            {"largest_residual", &residual_},
            {"largest_residual_time", &residual_time_},
            {"frozen_transport_error", &frozen_},
            {"frozen_transport", &frozen_before_},
            {"time_of_last_step", &time_},
            {"squares_of_steps", &squares_},
            {"largest_wall_speed", &wall_speed_},
            {"largest_wall_speed_time", &wall_speed_time_},
            {"elastic_energy_at_start", &elastic_energy_},
            {"work_of_last_step", &work_},
            {"work_magnitude", &work_magnitude_},
            {"edge_moves", &edge_moves_},
            {"edge_corrections", &edge_corrections_},
            {"unresolved_flow_x", &flow_.x},
            {"unresolved_flow_x_time", &flow_x_time_},
            {"unresolved_flow_y", &flow_.y},
            {"unresolved_flow_y_time", &flow_y_time_}};
}

} // namespace ductile::quasistatic
