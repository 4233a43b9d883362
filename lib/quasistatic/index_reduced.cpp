#include <ductile/base/error.hpp>
#include <ductile/base/timer.hpp>
#include <ductile/quasistatic/index_reduced.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace ductile::quasistatic {

IndexReducedStepper::IndexReducedStepper(const Scene& scene, std::unique_ptr<EquilibriumSolver> solver, const PassOptions& passes,
                                         State state)
    : scene_(scene), solver_(std::move(solver)), lines_(scene, *solver_, passes), state_(std::move(state)), rate_(scene),
      next_(scene), next_rate_(scene),
      earlier_velocity_(scene.grid), stage_velocity_{VectorField(scene.grid), VectorField(scene.grid), VectorField(scene.grid)} {}

void IndexReducedStepper::provide_start_rate() {
    // also where the walls' velocity jumps at t_n: v and the rate jump with it
    const WallVelocity wall = scene_.walls.after(state_.time);
    if (started_ && wall == rate_wall_)
        return;
    const RateReport report = lines_.evaluate(state_.cells, wall, state_.velocity, rate_);
    close_rate(scene_, state_.velocity, rate_);
    relaxation_ = report.largest_relaxation;
    rate_wall_ = wall;
    started_ = true;
}

double IndexReducedStepper::time_scale() {
    provide_start_rate();
    return 1.0 / norm(scene_, std::array{Term{&rate_, 1.0}}).largest();
}

double IndexReducedStepper::limit_step(double dt) {
    provide_start_rate();
    constexpr double touching = 1.0 - 1e-9;
    const double ratio = yield_ratio(scene_, state_.cells, 0.0, rate_);
    if (ratio >= touching)
        return dt;
    // sbar is convex along the straight elastic path: the chord meets yield before the path does, and repeated chords converge
    double begin = 0.0, begin_ratio = ratio;
    const double end_ratio = yield_ratio(scene_, state_.cells, dt, rate_);
    if (end_ratio <= 1.0)
        return dt;
    for (int pass = 0; pass < 20 && begin_ratio < touching; ++pass) {
        begin += (dt - begin) * (1.0 - begin_ratio) / (end_ratio - begin_ratio);
        begin_ratio = yield_ratio(scene_, state_.cells, begin, rate_);
    }
    return begin;
}

StepAttempt IndexReducedStepper::attempt(double dt, double end) {
    const Timer timer;
    const StepAttempt result = attempt_step(dt, end);
    attempt_seconds_ += timer.seconds();
    return result;
}

StepAttempt IndexReducedStepper::attempt_step(double dt, double end) {
    provide_start_rate();

    step_begin_ = state_.time;
    step_length_ = dt;
    step_end_ = end;
    stage_ = 0;
    sequence_.clear();
    if (earlier_step_ > 0.0)
        sequence_.push_back({-earlier_step_ / dt, &earlier_velocity_});
    sequence_.push_back({0.0, &state_.velocity});

    const double measure = advance(dt).largest();
    if (!std::isfinite(measure))
        throw RunError(
            fmt::format("step {} at t = {:.6g} s with dt = {:.3g} s: the error estimate is not finite. The step is too large for "
                        "this scene: use a smaller --dt or --tolerance",
                        state_.step + 1, state_.time * scene_.units.time, dt * scene_.units.time));
    measure_ = measure;
    return {.measure = measure,
            .error = measure,
            .relaxation_step = relaxation_step(latest_.largest_relaxation),
            .advection_step = courant_number() / latest_.courant_rate};
}

void IndexReducedStepper::evaluate(CellState& cells, double fraction, CellState& rate) {
    VectorField& velocity = stage_velocity_[static_cast<std::size_t>(stage_)];
    stage_ = (stage_ + 1) % static_cast<int>(stage_velocity_.size());
    std::erase_if(sequence_, [&](const TimedVelocity& earlier) { return earlier.velocity == &velocity; });
    guess_velocity(fraction, velocity);
    latest_ = lines_.evaluate(cells, wall_velocity(fraction), velocity, rate);
    // what is as late or later, of two stages at one time or of a trial that an integrator gave up, is replaced
    while (sequence_.back().fraction >= fraction && sequence_.size() > 1)
        sequence_.pop_back();
    sequence_.push_back({fraction, &velocity});
}

WallVelocity IndexReducedStepper::wall_velocity(double fraction) const {
    return scene_.walls.before(fraction < 1.0 ? step_begin_ + fraction * step_length_ : step_end_);
}

void IndexReducedStepper::guess_velocity(double fraction, VectorField& guess) const {
    const TimedVelocity& last = sequence_.back();
    const TimedVelocity& previous = sequence_.size() > 1 ? sequence_[sequence_.size() - 2] : last;
    const double weight = sequence_.size() > 1 ? (fraction - last.fraction) / (last.fraction - previous.fraction) : 0.0;
    extrapolate(*previous.velocity, *last.velocity, weight, guess);
}

void IndexReducedStepper::accept() {
    std::swap(state_.cells, next_);
    std::swap(rate_, next_rate_);
    std::swap(earlier_velocity_, state_.velocity);
    std::swap(state_.velocity, *sequence_.back().velocity);
    relaxation_ = latest_.largest_relaxation;
    rate_wall_ = scene_.walls.before(step_end_);
    earlier_step_ = step_length_;
    state_.time = step_end_;
    ++state_.step;
    step_accepted(step_length_, measure_);
}

void IndexReducedStepper::resume() {
    rate_wall_ = scene_.walls.before(state_.time);
    started_ = true;
}

StepperCounts IndexReducedStepper::counts() const {
    return {.elliptic_solves = lines_.solves(), .evaluations = lines_.evaluations()};
}

PhaseSeconds IndexReducedStepper::phase_seconds() const {
    const double rates = lines_.rate_seconds(), solves = lines_.solve_seconds();
    return {{"rates", rates}, {"elliptic solve", solves}, {"combination", std::max(attempt_seconds_ - rates - solves, 0.0)}};
}

std::size_t IndexReducedStepper::memory_bytes() const {
    const std::size_t cell = static_cast<std::size_t>(rate_.count()) * rate_.stress.p.storage().size() * sizeof(double);
    const std::size_t corner = 2 * state_.velocity.u.storage().size() * sizeof(double);
    return static_cast<std::size_t>(4 + buffers()) * cell + 6 * corner + solver_->memory_bytes();
}

std::vector<std::pair<std::string, Field*>> IndexReducedStepper::hidden_fields() {
    std::vector<std::pair<std::string, Field*>> fields{{"earlier_velocity_x", &earlier_velocity_.u},
                                                       {"earlier_velocity_y", &earlier_velocity_.v}};
    for (int k = 0; k < rate_.count(); ++k)
        fields.emplace_back(fmt::format("rate_{}", field_names(scene_)[static_cast<std::size_t>(k)]), &rate_.field(k));
    return fields;
}

std::vector<std::pair<std::string, double*>> IndexReducedStepper::hidden_numbers() {
    return {{"earlier_step", &earlier_step_}, {"relaxation", &relaxation_}};
}

} // namespace ductile::quasistatic
