// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/interrupt.hpp>
#include <ductile/quasistatic/rate_system.hpp>

#include <cmath>
#include <numbers>

namespace ductile::quasistatic {

RateSystem::RateSystem(const Scene& scene, Space& space, const PassOptions& passes)
    : scene_(scene), space_(space), lines_(scene, space, passes), projection_(scene, space),
      energy_scale_(std::sqrt(static_cast<double>(space.packed_size()) / static_cast<double>(fields())) / scene.grid.area()),
      stage_velocity_{space.make_velocity(), space.make_velocity(), space.make_velocity()} {
    if (scene.walls.by_traction()) {
        const IsotropicElasticity& c = scene.law->elasticity();
        const double strains =
            2.0 / scene.grid.height * std::sqrt(static_cast<double>(space.packed_size()) / static_cast<double>(fields()));
        wall_scale_ = {std::numbers::sqrt2 * c.shear_modulus * strains, c.alpha() * strains};
    }
    sequence_.reserve(stage_velocity_.size() + 2);
}

void RateSystem::begin_velocities(VectorField& velocity, VectorField& earlier_velocity, double earlier_step) {
    stage_ = 0;
    sequence_.clear();
    if (earlier_step > 0.0)
        sequence_.push_back({-earlier_step / step_length(), &earlier_velocity});
    sequence_.push_back({0.0, &velocity});
}

time::OpenRate<CellState> RateSystem::evaluate(CellState& cells, double fraction, CellState& rate) {
    VectorField& velocity = stage_velocity_[stage_];
    stage_ = (stage_ + 1) % stage_velocity_.size();
    std::erase_if(sequence_, [&](const TimedVelocity& earlier) { return earlier.velocity == &velocity; });
    guess_velocity(fraction, velocity);
    latest_ = lines_.evaluate(cells, told(fraction), velocity, rate);
    // what is as late or later, of two stages at one time or of a trial that an integrator gave up, is replaced
    while (sequence_.back().fraction >= fraction && sequence_.size() > 1)
        sequence_.pop_back();
    sequence_.push_back({fraction, &velocity});
    return {&rate};
}

void RateSystem::guess_velocity(double fraction, VectorField& guess) const {
    const TimedVelocity& last = sequence_.back();
    const TimedVelocity& previous = sequence_.size() > 1 ? sequence_[sequence_.size() - 2] : last;
    const double weight = sequence_.size() > 1 ? (fraction - last.fraction) / (last.fraction - previous.fraction) : 0.0;
    extrapolate(*previous.velocity, *last.velocity, weight, guess);
}

void RateSystem::close(time::OpenRate<CellState> rate) { space_.close(velocity(), *rate.vector); }

void RateSystem::combine(std::span<const time::Term<CellState>> terms, CellState& out) { space_.combine(terms, out); }

void RateSystem::combine(std::span<const time::Term<CellState>> terms, time::OpenRate<CellState> rate, double factor,
                         time::Completed completed, CellState& out) {
    space_.combine(terms, {rate.vector, &velocity(), factor, completed == time::Completed::kept}, out);
}

double RateSystem::norm(std::span<const time::Term<CellState>> terms) { return largest_norm(scene_, space_, terms); }

void RateSystem::pack(const CellState& cells, std::span<double> values) const {
    const std::size_t n = space_.packed_size();
    space_.pack(cells, values.first(n));
    values[n] = energy_scale_ * cells.energy.work;
    values[n + 1] = energy_scale_ * cells.energy.dissipation;
    values[n + 2] = energy_scale_ * cells.energy.transport;
    if (walls() > 0) {
        values[components() - 2] = wall_scale_.u * cells.wall.u;
        values[components() - 1] = wall_scale_.v * cells.wall.v;
    }
}

void RateSystem::unpack(std::span<const double> values, CellState& cells) const {
    const std::size_t n = space_.packed_size();
    space_.unpack(values.first(n), cells);
    cells.energy = (1.0 / energy_scale_) * EnergyFlow{values[n], values[n + 1], values[n + 2]};
    if (walls() > 0)
        cells.wall = {values[components() - 2] / wall_scale_.u, values[components() - 1] / wall_scale_.v};
}

void RateSystem::put_into_equilibrium(CellState& cells, double fraction, VectorField& force) {
    space_.divergence(cells.stress, -1.0, force);
    (void)projection_.apply(force, {}, 1.0, cells);
    bring_to_load(scene_, space_, stage_time(fraction), cells);
}

void RateSystem::solve(VectorField& force, WallData walls) {
    space_.solve(force, walls);
    ++counts_.elliptic_solves;
}

void RateSystem::count_substeps(const Rk21Counts& substeps) {
    counts_.pointwise_substeps += substeps.accepted;
    counts_.rejected_substeps += substeps.rejected;
}

StepperCounts RateSystem::counts() const {
    StepperCounts counts = counts_;
    counts.elliptic_solves += lines_.solves() + projection_.solves();
    counts.evaluations = lines_.evaluations();
    return counts;
}

void end_if_interrupted() {
    if (io::interrupted())
        throw RunError("interrupted");
}

} // namespace ductile::quasistatic
