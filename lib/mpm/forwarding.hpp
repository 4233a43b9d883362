// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: what discretisations with forces on surfaces have in common.
#include <ductile/mpm/discretisation.hpp>

#include <memory>
#include <utility>

namespace ductile::mpm {

/// Leaves all its work to another discretisation.
class Forwarding : public Discretisation {
public:
    explicit Forwarding(std::unique_ptr<Discretisation> within) : within_(std::move(within)) {}

    void prepare(Particles& particles, std::span<const RigidBody> rigid_bodies, double time, double dt) override {
        within_->prepare(particles, rigid_bodies, time, dt);
    }
    [[nodiscard]] const ActiveNodes& nodes() const override { return within_->nodes(); }
    [[nodiscard]] bool moves() const override { return within_->moves(); }
    void internal_force(const Particles& particles, std::span<double> force, std::span<double> magnitudes) const override {
        within_->internal_force(particles, force, magnitudes);
    }
    void force_after(const Particles& particles, std::span<const double> velocity, double dt, std::span<double> force,
                     std::span<double> magnitudes) const override {
        within_->force_after(particles, velocity, dt, force, magnitudes);
    }
    void body_force(const Particles& particles, double time, std::span<double> force) const override {
        within_->body_force(particles, time, force);
    }
    void consistent_mass_times(const Particles& particles, std::span<const double> x, std::span<double> result) const override {
        within_->consistent_mass_times(particles, x, result);
    }
    void linearise(const Particles& particles, std::span<const double> velocity, double dt) override {
        within_->linearise(particles, velocity, dt);
    }
    void stiffness_times(std::span<const double> x, std::span<double> result) const override {
        within_->stiffness_times(x, result);
    }
    void stiffness_diagonal(std::span<double> diagonal) const override { within_->stiffness_diagonal(diagonal); }
    void stiffness_blocks(const AddBlock& add) const override { within_->stiffness_blocks(add); }
    void consistent_mass_blocks(const Particles& particles, const AddBlock& add) const override {
        within_->consistent_mass_blocks(particles, add);
    }
    [[nodiscard]] Stencil stencil(std::size_t p) const override { return within_->stencil(p); }
    [[nodiscard]] std::span<const std::array<double, 2>> surface_forces() const override { return within_->surface_forces(); }
    [[nodiscard]] int reach() const override { return within_->reach(); }
    [[nodiscard]] Forecast forecast(const Particles& particles, const NodalMotion& motion) const override {
        return within_->forecast(particles, motion);
    }
    ParticleEnergies advance(Particles& particles, const NodalMotion& motion) override {
        return within_->advance(particles, motion);
    }
    [[nodiscard]] std::size_t memory_bytes() const override { return within_->memory_bytes(); }

protected:
    [[nodiscard]] Discretisation& within() { return *within_; }
    [[nodiscard]] const Discretisation& within() const { return *within_; }

private:
    std::unique_ptr<Discretisation> within_;
};

} // namespace ductile::mpm
