// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/mpm/contact_force.hpp>
#include <ductile/mpm/explicit_step.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace ductile::mpm {

void check(const Scene& scene, Form form) {
    if (scene.affine && form == Form::momentum)
        throw InputError(
            "affine transfers give particles the velocity of the nodes, and the momentum form strains them by another: "
            "use the velocity form");
}

ExplicitStep::ExplicitStep(const Scene& scene, Form form)
    : scene_(scene), form_(form), discretisation_(make_discretisation(scene)) {
    check(scene, form);
}

StepEnergies ExplicitStep::advance(State& state, double dt, double end) {
    Discretisation& d = *discretisation_;
    d.prepare(state.particles, state.rigid_bodies, state.time, dt);
    const ActiveNodes& nodes = d.nodes();
    const std::size_t size = nodes.components();
    for (auto* field : {&force_, &increment_, &motion_})
        field->resize(size);
    d.internal_force(state.particles, force_);
    if (scene_.body_force) {
        external_.resize(size);
        d.body_force(state.particles, state.time, external_);
        for (std::size_t c = 0; c < size; ++c)
            force_[c] += external_[c];
    }
    for (std::size_t c = 0; c < size; ++c) {
        increment_[c] = nodes.prescribed[c] ? 0.0 : dt * force_[c] / nodes.mass[c / 2];
        motion_[c] = nodes.velocity[c] + increment_[c];
    }
    const bool momentum = form_ == Form::momentum;
    if (momentum) {
        straining_.resize(size);
        d.consistent_mass_times(state.particles, increment_, straining_);
        for (std::size_t c = 0; c < size; ++c)
            straining_[c] = nodes.velocity[c] + (nodes.prescribed[c] ? 0.0 : straining_[c] / nodes.mass[c / 2]);
    }
    const std::span<const double> straining = momentum ? straining_ : motion_;
    check_travel(state, straining, dt);
    const NodalMotion motion{motion_, straining, increment_, false, dt, 0.0, motion_};
    check_forecast(state, motion);
    const ParticleEnergies sums = d.advance(state.particles, motion);
    move_rigid_bodies(state, dt);
    state.time = end;
    ++state.step;

    StepEnergies energies{.dissipated = sums.dissipated,
                          .of_method = sums.of_lag - sums.of_increments,
                          .of_change = sums.of_increments,
                          .surface_work = sums.surface_work,
                          .load_work = sums.load_work,
                          .friction = sums.friction,
                          .in_contact = sums.in_contact};
    for (std::size_t c = 0; d.moves() && c < size; ++c)
        energies.of_method -= dt * (force_[c] - (scene_.body_force ? external_[c] : 0.0)) * straining[c];
    if (scene_.affine) {
        energies.of_method += sums.of_increments - sums.kinetic;
        for (std::size_t c = 0; c < size; ++c)
            energies.of_method += straining[c] * nodes.mass[c / 2] * (motion_[c] - nodes.mapped[c]);
    } else {
        for (std::size_t c = 0; c < size; ++c)
            energies.of_method += (straining[c] - nodes.velocity[c]) * nodes.mass[c / 2] * increment_[c];
    }
    for (std::size_t c = 0; scene_.body_force && c < size; ++c)
        energies.body_work += dt * external_[c] * straining[c];
    add_held_force(nodes, dt, force_);
    return energies;
}

void ExplicitStep::check_travel(const State& state, std::span<const double> velocity, double dt) const {
    const double farthest = scene_.grid.smallest_spacing() / dt;
    for (const double v : velocity)
        if (!(std::abs(v) <= farthest))
            throw RunError(
                fmt::format("step {} at t = {:.6g} s with dt = {:.6g} s: a node would strain the particles with {:.3g} m/s, "
                            "farther than a cell: the step is too long for the explicit method{}; use a smaller --dt{}",
                            state.step + 1, state.time, dt, v,
                            form_ == Form::velocity ? ", or particles have just entered a cell, which the velocity form "
                                                      "does not bear"
                                                    : "",
                            form_ == Form::momentum ? ""
                            : scene_.affine         ? ", or GIMP or B-splines"
                                                    : " or --form momentum"));
}

/// Looks at particles one by one only where some may fold or leave the grid.
void ExplicitStep::check_forecast(const State& state, const NodalMotion& motion) const {
    const auto range = [](std::span<const double> nodal, std::size_t component) {
        double low = 0.0, high = 0.0;
        for (std::size_t c = component; c < nodal.size(); c += 2) {
            low = std::min(low, nodal[c]);
            high = std::max(high, nodal[c]);
        }
        return std::pair{low, high};
    };
    const Grid& grid = scene_.grid;
    const Particles& p = state.particles;
    // derivatives of a shape function add up to 4/h in magnitude at most (B-splines at a side): while velocities differ by less
    // than h/(16 dt) each entry of dt grad v stays below 1/8
    bool safe = true;
    for (const std::size_t component : {0, 1}) {
        const auto [low, high] = range(motion.straining, component);
        safe = safe && (high - low) * motion.dt < grid.smallest_spacing() / 16.0;
        const auto [back, forth] = range(motion.motion, component);
        const double begin = component == 0 ? grid.left : grid.bottom;
        const double first = begin - motion.dt * back;
        const double last = begin + (component == 0 ? grid.width : grid.height) - motion.dt * forth;
        int near_edge = 0; // without branches: compilers vectorise it
        for (const double place : component == 0 ? p.x : p.y)
            near_edge |= static_cast<int>(place < first) | static_cast<int>(place > last);
        safe = safe && near_edge == 0;
    }
    if (safe)
        return;
    const Forecast forecast = discretisation_->forecast(p, motion);
    if (!(forecast.smallest_determinant > 0.0))
        throw RunError(fmt::format("step {} at t = {:.6g} s with dt = {:.6g} s would fold the grid: its deformation has the "
                                   "determinant {:.3g} at a particle: use a smaller --dt",
                                   state.step + 1, state.time, motion.dt, forecast.smallest_determinant));
    if (forecast.leaving < 0)
        return;
    const auto n = static_cast<std::size_t>(forecast.leaving);
    throw RunError(fmt::format("step {} at t = {:.6g} s with dt = {:.6g} s: particle {} at ({:.6g}, {:.6g}) m would leave the "
                               "background grid, which extends from ({:.6g}, {:.6g}) to ({:.6g}, {:.6g}) m: use a larger grid, "
                               "another condition at its sides, or an earlier end",
                               state.step + 1, state.time, motion.dt, p.id[n], p.x[n], p.y[n], grid.left, grid.bottom,
                               grid.left + grid.width, grid.bottom + grid.height));
}

double stability_limit(const Scene& scene, const Particles& particles) {
    const double k = scene.shape == ShapeFunction::bspline ? 5.4 : 4.0;
    return 2.0 / std::sqrt(k) / (fastest_wave(scene, particles) * std::hypot(1.0 / scene.grid.dx(), 1.0 / scene.grid.dy()));
}

double explicit_step_size(const Scene& scene, const Particles& particles, double safety) {
    return safety * scene.grid.smallest_spacing() / largest_wave_speed(scene, particles);
}

} // namespace ductile::mpm
