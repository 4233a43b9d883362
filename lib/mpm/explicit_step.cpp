#include <ductile/base/error.hpp>
#include <ductile/mpm/explicit_step.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace ductile::mpm {

ExplicitStep::ExplicitStep(const Scene& scene, Form form)
    : scene_(scene), form_(form), discretisation_(make_discretisation(scene)) {}

void ExplicitStep::advance(State& state, double dt) {
    Discretisation& d = *discretisation_;
    d.prepare(state.particles, state.rigid_bodies);
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
    const NodalMotion motion{motion_, straining, increment_, false, dt};
    check_leaving(state, motion);
    d.advance(state.particles, motion);
    move_rigid_bodies(state.rigid_bodies, dt);
    state.time += dt;
    ++state.step;
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
                            form_ == Form::velocity ? " or --form momentum" : ""));
}

/// Looks closer only where a particle is so near the grid's edge that it might cross it.
void ExplicitStep::check_leaving(const State& state, const NodalMotion& motion) const {
    const auto fastest = [](std::span<const double> v) {
        double most = 0.0;
        for (const double value : v)
            most = std::max(most, std::abs(value));
        return most;
    };
    const Grid& grid = scene_.grid;
    const Particles& p = state.particles;
    const double reach = motion.dt * fastest(motion_);
    const auto [left, right] = std::minmax_element(p.x.begin(), p.x.end());
    const auto [lowest, highest] = std::minmax_element(p.y.begin(), p.y.end());
    if (*left - reach >= grid.left && *right + reach <= grid.left + grid.width && *lowest - reach >= grid.bottom &&
        *highest + reach <= grid.bottom + grid.height)
        return;
    const Forecast forecast = discretisation_->forecast(p, motion);
    if (forecast.leaving < 0)
        return;
    const auto n = static_cast<std::size_t>(forecast.leaving);
    throw RunError(fmt::format("step {} at t = {:.6g} s with dt = {:.6g} s: particle {} at ({:.6g}, {:.6g}) m would leave the "
                               "background grid, which extends from ({:.6g}, {:.6g}) to ({:.6g}, {:.6g}) m: use a larger grid, "
                               "another condition at its sides, or an earlier end",
                               state.step + 1, state.time, motion.dt, p.id[n], p.x[n], p.y[n], grid.left, grid.bottom,
                               grid.left + grid.width, grid.bottom + grid.height));
}

double explicit_step_size(const Scene& scene, const Particles& particles, double safety) {
    return safety * scene.grid.smallest_spacing() / largest_wave_speed(scene, particles);
}

std::array<double, 2> contact_force(const Discretisation& discretisation, const Particles& particles, int body) {
    const ActiveNodes& nodes = discretisation.nodes();
    aligned_vector<double> force(nodes.components());
    discretisation.internal_force(particles, force);
    std::array<double, 2> sum{};
    for (std::size_t n = 0; n < nodes.count(); ++n)
        if (nodes.rigid_body[n] == body) {
            sum[0] += force[2 * n];
            sum[1] += force[2 * n + 1];
        }
    return sum;
}

} // namespace ductile::mpm
