// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/mpm/checkpoint.hpp>
#include <ductile/mpm/contact_force.hpp>
#include <ductile/mpm/output.hpp>
#include <ductile/mpm/run.hpp>
#include <ductile/run/loop.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <optional>
#include <string>
#include <vector>

namespace ductile::mpm {

namespace {

/// Of the particles on each rigid body at the start.
std::vector<std::array<double, 2>> contact_forces_at_start(const Problem& problem) {
    const auto discretisation = make_discretisation(problem.scene);
    Particles particles = problem.start.particles; // may be sorted
    discretisation->prepare(particles, problem.start.rigid_bodies, problem.start.time);
    std::vector<double> force(discretisation->nodes().components()), external(force.size());
    discretisation->internal_force(particles, force);
    discretisation->body_force(particles, problem.start.time, external);
    for (std::size_t c = 0; c < force.size(); ++c)
        force[c] += external[c];
    std::vector<std::array<double, 2>> forces;
    for (std::size_t b = 0; b < problem.start.rigid_bodies.size(); ++b)
        forces.push_back(
            contact_force(discretisation->nodes(), force, static_cast<std::int32_t>(b))); // surfaces touch nothing yet
    return forces;
}

/// The counter of steps that were refused for a reason.
const char* counter_of(StepFailure failure) {
    switch (failure) {
    case StepFailure::none:
        break;
    case StepFailure::no_convergence:
        return "rejected_without_convergence";
    case StepFailure::folded_grid:
        return "rejected_with_folded_grid";
    case StepFailure::far_particle:
        return "rejected_with_far_particle";
    case StepFailure::leaving_particle:
        return "rejected_with_leaving_particle";
    }
    throw RunError("a step was refused without a reason");
}

/// What to do where shorter steps do not help.
const char* remedy(StepFailure failure) {
    switch (failure) {
    case StepFailure::none:
        break;
    case StepFailure::no_convergence:
        return "choose --preconditioner tangent, more --krylov-vectors or a larger --newton-tolerance, --method implicit if it "
               "is "
               "quasi-static, and 2 x 2 particles a cell with B-splines";
    case StepFailure::folded_grid:
        return "end the run before it, or take smaller cells, or more particles a cell";
    case StepFailure::far_particle:
        return "something moves that nothing resists: hold every body, take more particles a cell or larger cells if some have "
               "come off, or --method implicit if it is quasi-static";
    case StepFailure::leaving_particle:
        return "use a larger grid, another condition at its sides, or an earlier end";
    }
    return "";
}

class PointsRun final : public run::Simulation {
public:
    PointsRun(const Problem& problem, State& state, TimeStepper& stepper, StepControl& control, const Monitor::Options& monitor,
              const io::CheckpointReader* checkpoint)
        : problem_(problem), state_(state), stepper_(stepper), control_(control), monitor_(problem.scene, monitor),
          touching_(state.rigid_bodies.size(), 0) {
        last_.contact_forces = contact_forces_at_start(problem_);
        see({problem_.start, last_.dt, last_.contact_forces, energies_}, last_, tally_);
        if (!checkpoint)
            return;
        restore(*checkpoint, control_, tally_);
        last_.restore(*checkpoint);
    }

    [[nodiscard]] double time_s() const override { return state_.time; }
    [[nodiscard]] std::int64_t step() const override { return state_.step; }

    [[nodiscard]] bool attempt(const std::vector<double>& output_times_s, FunctionRef<void()> before_end,
                               FunctionRef<void()> output) override {
        const double end = output_times_s.front();
        step_ = control_.next(state_, end);
        if (step_.lands)
            before_end();
        const bool passes = is_within_step(output_times_s.back(), end);
        if (passes) {
            before_ = state_;
            plan_before_ = control_.plan();
        }
        if (!(state_.time + step_.dt > state_.time))
            throw RunError(fmt::format(
                "step {} at t = {:.6g} s would be {:.3g} s long ({}), too short to change the time: look for a speed or "
                "a length that is out of all proportion",
                state_.step + 1, state_.time, step_.dt, to_string(step_.limit)));
        const StepOutcome outcome = stepper_.attempt(state_, step_.dt, step_.end);
        if (!outcome.accepted) {
            ++events_.at(counter_of(outcome.failure));
            if (!control_.failed(step_))
                throw RunError(fmt::format("step {} at t = {:.6g} s failed even with dt = {:.3g} s: {}; {}", state_.step + 1,
                                           state_.time, step_.dt, outcome.reason, remedy(outcome.failure)));
            return false;
        }
        if (control_.options().ends_at_contact) {
            std::fill(touching_.begin(), touching_.end(), 0);
            for (const Hold& hold : stepper_.discretisation().nodes().holds)
                if (hold.holder >= 0)
                    touching_[static_cast<std::size_t>(hold.holder)] = 1;
        }
        control_.accepted(step_, outcome.newton_iterations, touching_);
        check_progress();
        if (step_.limit == StepLimit::rigid_travel)
            ++events_.at("steps_cut_by_rigid_travel");
        if (step_.limit == StepLimit::contact)
            ++events_.at("steps_ended_at_contact");
        if (outcome.newton_iterations > control_.options().many_newton_iterations)
            ++events_.at("steps_with_many_newton_iterations");
        last_.dt = step_.dt;
        last_.smallest_determinant = outcome.smallest_determinant;
        last_.newton_iterations = outcome.newton_iterations;
        last_.linear_iterations = outcome.linear_iterations;
        energies_ = outcome.energies;
        find_contact_forces(last_);
        if (passes)
            show_within(output_times_s, output);
        return true;
    }

    void observe(bool) override { see({state_, last_.dt, last_.contact_forces, energies_}, last_, tally_); }

    [[nodiscard]] std::vector<std::string> columns() const override { return history_columns(problem_); }

    void row(std::vector<double>& row) override {
        if (within_)
            append_row(problem_, within_->seen(), within_->last, monitor_.ledger(within_->seen(), within_->tally), row);
        else
            append_row(problem_, seen(), last_, monitor_.ledger(seen(), tally_), row);
    }

    [[nodiscard]] run::Curve curve() const override {
        return {problem_.curve_x, problem_.curve_y, problem_.label_x, problem_.label_y};
    }

    [[nodiscard]] io::ProgressState progress() const override {
        return {state_.time, state_.step, step_.dt, to_string(step_.limit)};
    }

    io::Snapshots& open_snapshots(const std::filesystem::path& fields, const std::string& program,
                                  const std::optional<io::EarlierSnapshots>& earlier) override {
        const Grid& grid = problem_.scene.grid;
        return snapshots_.emplace(fields, program, earlier,
                                  io::SnapshotConstants{{"grid_left_m", grid.left},
                                                        {"grid_bottom_m", grid.bottom},
                                                        {"cell_width_m", grid.dx()},
                                                        {"cell_height_m", grid.dy()},
                                                        {"cells_x", grid.cells_x},
                                                        {"cells_y", grid.cells_y}});
    }

    void snapshot(double) override {
        write_snapshot(problem_.scene, problem_.start.particles, within_ ? within_->state : state_, *snapshots_);
    }

    void describe(io::Checkpoint& content) override {
        mpm::describe(state_, control_, tally_, content);
        last_.describe(content);
    }
    [[nodiscard]] int checkpoint_format() const override { return mpm::checkpoint_format; }

    [[nodiscard]] run::Counters counters() const override {
        const SolverCounts now = stepper_.counts();
        run::Counters counters = events_;
        counters.insert({{"newton_iterations", now.newton_iterations},
                         {"linear_iterations", now.linear_iterations},
                         {"residual_evaluations", now.residual_evaluations},
                         {"jacobian_products", now.jacobian_products},
                         {"backtracks", now.backtracks}});
        return counters;
    }

    void describe(const run::Counters& total, io::RunSummary& summary) override {
        summary.rejected_steps = 0;
        for (const auto& [name, count] : events_) {
            summary.rejected_steps += name.starts_with("rejected") ? total.at(name) : 0;
            if (total.at(name) > 0)
                summary.extra[name] = total.at(name);
        }
        summary.newton_iterations = total.at("newton_iterations");
        summary.linear_iterations = total.at("linear_iterations");
        summary.residual_evaluations = total.at("residual_evaluations");
        summary.jacobian_products = total.at("jacobian_products");
        summary.phase_seconds = stepper_.phase_seconds();
        summary.extra["shortened_newton_steps"] = total.at("backtracks");
        summary.extra["simulated_time_s"] = state_.time;
        summary.extra["particles"] = state_.particles.size();
        monitor_.conclude(seen(), tally_, problem_.start.particles, summary);
        if (problem_.conclusions.conclude)
            problem_.conclusions.conclude(seen(), tally_, summary.extra);
    }

private:
    /// Throws RunError where steps stay so short that the run will not come to its end: a step that only just succeeds makes the
    /// next one a little longer, which then fails.
    void check_progress() {
        const bool stuck = (step_.limit == StepLimit::failed_step || step_.limit == StepLimit::newton_iterations) &&
                           step_.planned < 1e-5 * control_.options().target;
        short_steps_ = stuck ? short_steps_ + 1 : 0;
        if (short_steps_ >= 200)
            throw RunError(fmt::format(
                "step {} at t = {:.6g} s, with dt = {:.3g} s, is the last of {} whose length was below 1e-5 of --dt because "
                "longer "
                "ones did not converge or took many iterations: shorter steps do not help here; choose --preconditioner tangent "
                "or "
                "more --krylov-vectors, --method implicit if it is quasi-static, or B-splines, larger cells or more particles if "
                "stiffness changes much from cell to cell",
                state_.step, state_.time, step_.dt, short_steps_));
    }
    /// A state between two steps, with what goes with it.
    struct Within {
        State state;
        LastStep last;
        StepEnergies energies;
        Tally tally;

        [[nodiscard]] Observation seen() const { return {state, last.dt, last.contact_forces, energies}; }
    };

    [[nodiscard]] Observation seen() const { return {state_, last_.dt, last_.contact_forces, energies_}; }

    /// What summary numbers need, of every step.
    void see(const Observation& seen, const LastStep& last, Tally& tally) const {
        monitor_.observe(seen, last.smallest_determinant, tally);
        if (problem_.conclusions.observe)
            problem_.conclusions.observe(seen, tally);
    }

    /// Of the step that the stepper has just made.
    void find_contact_forces(LastStep& last) {
        const std::span<const double> force = stepper_.force();
        const Discretisation& discretisation = stepper_.discretisation();
        for (std::size_t b = 0; b < last.contact_forces.size(); ++b)
            last.contact_forces[b] = state_.rigid_bodies[b].surface
                                         ? discretisation.surface_forces()[b]
                                         : contact_force(discretisation.nodes(), force, static_cast<std::int32_t>(b));
    }

    /// A time that is before the end of `step_`, as io::OutputTimes tells times apart.
    [[nodiscard]] bool is_within_step(double time, double end) const { return time < step_.end - 1e-12 * end; }

    /// Shows what lies within the step that was made from `before_`: where shorter steps from there end.
    void show_within(const std::vector<double>& output_times_s, FunctionRef<void()> output) {
        try {
            while (is_within_step(output_times_s.back(), output_times_s.front())) {
                within_ = Within{before_, last_, {}, tally_};
                go_to(output_times_s.back(), *within_);
                within_->state.step = before_.step;
                output();
                within_.reset();
            }
        } catch (...) { // the step is not made
            within_.reset();
            state_ = before_;
            control_.restore(plan_before_);
            throw;
        }
    }

    void go_to(double time, Within& at) {
        for (double longest = time - at.state.time; at.state.time < time;) {
            const double dt = std::min(longest, time - at.state.time);
            const StepOutcome outcome =
                stepper_.attempt(at.state, dt, at.state.time + dt < time - 1e-12 * step_.end ? at.state.time + dt : time);
            if (outcome.accepted) {
                at.last = {dt, outcome.smallest_determinant, static_cast<double>(outcome.newton_iterations),
                           static_cast<double>(outcome.linear_iterations), std::move(at.last.contact_forces)};
                at.energies = outcome.energies;
                find_contact_forces(at.last);
                see(at.seen(), at.last, at.tally);
            } else if (longest = 0.5 * dt; longest < 1e-9 * step_.dt) {
                throw RunError(fmt::format("the state at the output time {:.6g} s cannot be found: a step from t = {:.6g} s of "
                                           "{:.3g} s failed: {}; {}",
                                           time, at.state.time, dt, outcome.reason, remedy(outcome.failure)));
            }
        }
    }

    const Problem& problem_;
    State& state_;
    TimeStepper& stepper_;
    StepControl& control_;
    run::Counters events_{{counter_of(StepFailure::no_convergence), 0},
                          {counter_of(StepFailure::folded_grid), 0},
                          {counter_of(StepFailure::far_particle), 0},
                          {counter_of(StepFailure::leaving_particle), 0},
                          {"steps_cut_by_rigid_travel", 0},
                          {"steps_ended_at_contact", 0},
                          {"steps_with_many_newton_iterations", 0}};
    Monitor monitor_;
    Tally tally_;
    LastStep last_;
    StepEnergies energies_; // of the last step
    int short_steps_ = 0;   // in a row, see check_progress()
    std::optional<io::ParticleSnapshotWriter> snapshots_;
    StepControl::Step step_;
    State before_; // a step that passes output times
    StepControl::Plan plan_before_;
    std::optional<Within> within_;       // what is written, unless it is the state
    std::vector<std::int64_t> touching_; // 1 for each rigid body that holds nodes
};

} // namespace

io::RunStatus run(const Problem& problem, State& state, TimeStepper& stepper, StepControl& control, const run::Outputs& outputs,
                  const Monitor::Options& monitor, const run::Files& files, io::RunSummary& summary) {
    check(problem.scene, state.particles, state.rigid_bodies, state.time);
    PointsRun points_run(problem, state, stepper, control, monitor, files.checkpoint);
    return run::loop(points_run, outputs, files, summary);
}

} // namespace ductile::mpm
