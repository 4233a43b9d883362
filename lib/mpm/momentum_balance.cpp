// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/mpm/contact_force.hpp>
#include <ductile/mpm/momentum_balance.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace ductile::mpm {

MomentumBalance::MomentumBalance(const Scene& scene, const ImplicitScheme& scheme)
    : scene_(scene), scheme_(scheme), discretisation_(make_discretisation(scene, scheme.method == ImplicitMethod::midpoint)) {
    if (!(scheme.mu >= 0.0 && scheme.mu <= 1.0))
        throw InputError(fmt::format("mu = {}: the weight of the implicit force must lie between 0 and 1", scheme.mu));
    if (scheme.method == ImplicitMethod::quasi_static && momentum())
        throw InputError("the quasi-static method has no momentum: use it with the velocity form");
    if (scheme.method == ImplicitMethod::quasi_static && scene.affine)
        throw InputError("the quasi-static method has no momentum to transfer: affine transfers have no meaning with it");
    check(scene, scheme.form);
    if (scheme.method == ImplicitMethod::midpoint) {
        kinematic_weight_ = 0.5;
        scheme_.mu = scene.finite_rotation ? 1.0 : 0.5;
    }
    if (scheme.method == ImplicitMethod::quasi_static)
        scheme_.mu = 1.0;
}

void MomentumBalance::prepare(State& state, double dt) {
    state_ = &state;
    dt_ = dt;
    largest_wave_speed_ = fastest_wave(scene_, state.particles);
    Discretisation& d = *discretisation_;
    d.prepare(state.particles, state.rigid_bodies, state.time, dt);
    const ActiveNodes& n = d.nodes();
    const std::size_t size = n.components();
    for (auto* field : {&guess_, &known_, &change_, &velocity_, &work_, &motion_, &increment_})
        field->resize(size);
    for (std::size_t c = 0; c < size; ++c)
        guess_[c] = momentum() ? n.mass[c / 2] * n.velocity[c] : n.velocity[c];
    // known = dt [(1 - mu) f^k + b]
    d.body_force(state.particles, state.time + (scheme_.method == ImplicitMethod::midpoint ? 0.5 : scheme_.mu) * dt, known_);
    if (scene_.body_force)
        body_force_.assign(known_.begin(), known_.end());
    known_magnitudes_.resize(size);
    for (std::size_t c = 0; c < size; ++c)
        known_magnitudes_[c] = dt * std::abs(known_[c]);
    if (scheme_.mu < 1.0) {
        magnitudes_.resize(size);
        d.internal_force(state.particles, work_, magnitudes_);
        for (std::size_t c = 0; c < size; ++c) {
            known_[c] += (1.0 - scheme_.mu) * work_[c];
            known_magnitudes_[c] += dt * (1.0 - scheme_.mu) * magnitudes_[c];
        }
    }
    for (double& x : known_)
        x *= dt;
}

double MomentumBalance::paper_scale() const {
    double young = 0.0;
    for (const Material& material : scene_.materials)
        young = std::max(young, young_modulus(material.law->elasticity()));
    return young * scene_.grid.dx() * scene_.grid.dy() * dt_;
}

void MomentumBalance::straining_change(std::span<const double> change, std::span<double> result) {
    if (!momentum()) {
        for (std::size_t c = 0; c < change.size(); ++c)
            result[c] = kinematic_weight_ * change[c];
        return;
    }
    const ActiveNodes& n = nodes();
    for (std::size_t c = 0; c < change.size(); ++c)
        work_[c] = change[c] / n.mass[c / 2];
    discretisation_->consistent_mass_times(state_->particles, work_, result);
    for (std::size_t c = 0; c < change.size(); ++c)
        result[c] = n.prescribed[c] ? 0.0 : kinematic_weight_ * result[c] / n.mass[c / 2];
}

void MomentumBalance::find_straining_velocity(std::span<const double> u) {
    const ActiveNodes& n = nodes();
    for (std::size_t c = 0; c < u.size(); ++c)
        change_[c] = u[c] - guess_[c];
    straining_change(change_, velocity_);
    for (std::size_t c = 0; c < u.size(); ++c)
        velocity_[c] += n.velocity[c];
}

void MomentumBalance::residual(std::span<const double> u, std::span<double> f) { evaluate(u, f, {}); }

double MomentumBalance::residual_and_forces(std::span<const double> u, std::span<double> f) {
    magnitudes_.resize(size());
    evaluate(u, f, magnitudes_);
    double sum = 0.0;
    for (std::size_t c = 0; c < size(); ++c) {
        const double impulse = known_magnitudes_[c] + dt_ * scheme_.mu * magnitudes_[c];
        sum += impulse * impulse;
    }
    return std::sqrt(sum);
}

double MomentumBalance::round_off() const {
    const ActiveNodes& n = nodes();
    double sum = 0.0;
    for (std::size_t c = 0; c < n.components(); ++c)
        sum += std::pow(n.mass[c / 2] * n.velocity[c], 2);
    const double cells = 2.0 * largest_wave_speed_ * dt_ / scene_.grid.smallest_spacing();
    return 10.0 * std::numeric_limits<double>::epsilon() * (1.0 + cells * cells) * std::sqrt(sum);
}

void MomentumBalance::evaluate(std::span<const double> u, std::span<double> f, std::span<double> magnitudes) {
    const ActiveNodes& n = nodes();
    find_straining_velocity(u);
    discretisation_->force_after(state_->particles, velocity_, dt_, f, magnitudes);
    for (std::size_t c = 0; c < u.size(); ++c) {
        const double inert = inertia() ? (momentum() ? change_[c] : n.mass[c / 2] * change_[c]) : 0.0;
        f[c] = n.prescribed[c] ? 0.0 : inert - dt_ * scheme_.mu * f[c] - known_[c];
    }
}

void MomentumBalance::linearise(std::span<const double> u) {
    find_straining_velocity(u);
    discretisation_->linearise(state_->particles, velocity_, dt_);
}

void MomentumBalance::jacobian_times(std::span<const double> s, std::span<double> js) {
    const ActiveNodes& n = nodes();
    straining_change(s, change_);
    discretisation_->stiffness_times(change_, js);
    const double factor = scheme_.mu * dt_;
    for (std::size_t c = 0; c < s.size(); ++c) {
        const double inert = inertia() ? (momentum() ? s[c] : n.mass[c / 2] * s[c]) : 0.0;
        js[c] = n.prescribed[c] ? 0.0 : inert + factor * js[c];
    }
}

NodalMotion MomentumBalance::motion(std::span<const double> u) {
    const ActiveNodes& n = nodes();
    find_straining_velocity(u);
    for (std::size_t c = 0; c < u.size(); ++c) {
        increment_[c] = momentum() ? change_[c] / n.mass[c / 2] : change_[c];
        motion_[c] = n.velocity[c] + kinematic_weight_ * increment_[c];
    }
    if (discretisation_->moves()) {
        felt_.resize(size());
        discretisation_->force_after(state_->particles, velocity_, dt_, felt_);
    }
    if (scene_.affine) {
        last_.resize(size());
        for (std::size_t c = 0; c < size(); ++c)
            last_[c] = n.velocity[c] + increment_[c];
    }
    return {motion_, velocity_, increment_, !inertia(), dt_, scheme_.mu, last_};
}

StepEnergies MomentumBalance::advance(const NodalMotion& motion, Particles& particles) {
    const ParticleEnergies sums = discretisation_->advance(particles, motion);
    StepEnergies energies{.dissipated = sums.dissipated,
                          .of_method = sums.of_lag,
                          .surface_work = sums.surface_work,
                          .load_work = sums.load_work,
                          .friction = sums.friction,
                          .in_contact = sums.in_contact};
    const ActiveNodes& n = nodes();
    for (std::size_t c = 0; discretisation_->moves() && c < size(); ++c) {
        const double body = scene_.body_force ? dt_ * body_force_[c] : 0.0;
        energies.of_method -= (dt_ * scheme_.mu * felt_[c] + known_[c] - body) * motion.straining[c];
    }
    if (scene_.affine) {
        energies.of_change = sums.of_increments;
        energies.of_method -= sums.kinetic;
        for (std::size_t c = 0; c < size(); ++c)
            energies.of_method += motion.straining[c] * n.mass[c / 2] * (motion.last[c] - n.mapped[c]);
    } else if (inertia()) {
        energies.of_method -= sums.of_increments;
        energies.of_change = sums.of_increments;
        for (std::size_t c = 0; c < size(); ++c)
            energies.of_method += (motion.straining[c] - n.velocity[c]) * n.mass[c / 2] * motion.increment[c];
    }
    for (std::size_t c = 0; scene_.body_force && c < size(); ++c)
        energies.body_work += dt_ * body_force_[c] * motion.straining[c];
    return energies;
}

void MomentumBalance::force_at_end(std::span<double> force) {
    if (discretisation_->moves())
        std::ranges::copy(felt_, force.begin());
    else
        discretisation_->internal_force(state_->particles, force);
    for (std::size_t c = 0; c < force.size(); ++c)
        force[c] = scheme_.mu * force[c] + known_[c] / dt_;
    add_held_force(nodes(), dt_, force);
}

} // namespace ductile::mpm
