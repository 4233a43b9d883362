#include <ductile/base/error.hpp>
#include <ductile/io/interrupt.hpp>
#include <ductile/quasistatic/combination.hpp>
#include <ductile/quasistatic/rate_system.hpp>
#include <ductile/space/staggered.hpp>

namespace ductile::quasistatic {

RateSystem::RateSystem(const Scene& scene, EquilibriumSolver& solver, const PassOptions& passes)
    : scene_(scene), solver_(solver), lines_(scene, solver, passes), projection_(scene, solver),
      packing_(scene), stage_velocity_{VectorField(scene.grid), VectorField(scene.grid), VectorField(scene.grid)} {
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

void RateSystem::close(time::OpenRate<CellState> rate) { close_rate(scene_, velocity(), *rate.vector); }

void RateSystem::combine(std::span<const time::Term<CellState>> terms, CellState& out) {
    quasistatic::combine(scene_, terms, out);
}

void RateSystem::combine(std::span<const time::Term<CellState>> terms, time::OpenRate<CellState> rate, double factor,
                         time::Completed completed, CellState& out) {
    quasistatic::combine(scene_, terms, {rate.vector, &velocity(), factor, completed == time::Completed::kept}, out);
}

double RateSystem::norm(std::span<const time::Term<CellState>> terms) { return quasistatic::norm(scene_, terms).largest(); }

void RateSystem::put_into_equilibrium(CellState& cells, double fraction, VectorField& force) {
    divergence(scene_.grid, cells.stress, -1.0, force);
    (void)projection_.apply(force, {}, 1.0, cells);
    bring_to_load(scene_, stage_time(fraction), cells);
}

void RateSystem::solve(VectorField& force, WallData walls) {
    solver_.solve(force, walls);
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
