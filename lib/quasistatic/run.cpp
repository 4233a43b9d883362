// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/interrupt.hpp>
#include <ductile/quasistatic/accumulation.hpp>
#include <ductile/quasistatic/accuracy_watch.hpp>
#include <ductile/quasistatic/checkpoint.hpp>
#include <ductile/quasistatic/output.hpp>
#include <ductile/quasistatic/projection.hpp>
#include <ductile/quasistatic/run.hpp>
#include <ductile/run/loop.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace ductile::quasistatic {

namespace {

/// Steps of SUNDIALS whose errors add up to more than ten times the tolerance: 15,000 came to eight times.
constexpr std::int64_t many_steps = 15'000;

/// Pieces of a step that is a whole integration by another library, for what accumulates along it.
constexpr int pieces_of_own_step = 16;

class GridRun final : public run::Simulation {
public:
    GridRun(const Scene& scene, State& state, TimeStepper& stepper, StepControl& control, const run::Outputs& outputs,
            const io::CheckpointReader* checkpoint)
        : outputs_(outputs), scene_(scene), state_(state), stepper_(stepper), control_(control), space_(stepper.space()),
          watch_(scene, space_), force_(space_.make_velocity()) {
        if (!outputs.snapshots_s.empty())
            accumulation_.emplace(scene_, space_, state_, stepper_.leaves_velocity_of_middle());
        if (!checkpoint) {
            watch_.begin(state_);
            control_.start(stepper_.time_scale(state_));
            return;
        }
        restore(*checkpoint, scene_, stepper_, state_, control_, watch_);
        if (accumulation_ && !restore(*checkpoint, *accumulation_)) {
            accumulation_.reset();
            warnings_.emplace_back(
                "the snapshots lack the accumulated plastic strain and the displacement, because the run that left "
                "the checkpoint took none: give it --snapshots to have them");
        }
        last_dt_ = checkpoint->scalar("last_dt");
        last_measure_ = checkpoint->scalar("last_measure");
    }

    [[nodiscard]] double time_s() const override { return state_.time * scene_.units.time; }
    [[nodiscard]] std::int64_t step() const override { return state_.step; }

    [[nodiscard]] bool attempt(const std::vector<double>& output_times_s, FunctionRef<void()> before_end,
                               FunctionRef<void()> output) override {
        const double now = state_.time;
        const double end = output_times_s.front() / scene_.units.time;
        const double goal = std::min(end, scene_.walls.next_knot(now));
        const StepControl::Step planned = control_.next(now, goal);
        step_ = StepControl::shortened(planned, now, stepper_.limit_step(state_, planned.dt));
        if (goal == end && (planned.lands || planned.limit == StepLimit::output))
            before_end();
        times_within_.clear();
        for (auto time_s = output_times_s.rbegin(); time_s + 1 != output_times_s.rend(); ++time_s)
            if (const double time = *time_s / scene_.units.time; time < step_.end - 1e-12 * end)
                times_within_.push_back(time);
        begin_accumulation();
        const auto show = [&](const State& at) {
            if (std::ranges::binary_search(times_within_, at.time)) {
                shown_ = &at;
                output();
                shown_ = nullptr;
            }
            if (std::ranges::binary_search(pieces_, at.time))
                accumulation_->pass(at);
        };
        std::vector<double> passed;
        std::ranges::set_union(times_within_, pieces_, std::back_inserter(passed));
        judged_ = false;
        const StepControl before = control_;
        StepAttempt attempt;
        try {
            attempt = stepper_.attempt(state_, step_.dt, step_.end, [&](const StepAttempt& made) { return judge(made); },
                                       {passed, show});
        } catch (const RunError&) {
            shown_ = nullptr;
            if (judged_) { // no number means anything from here on, and the step is not made
                control_ = before;
                throw;
            }
            if (io::interrupted())
                return false;
            if (!control_.retry_shorter(step_))
                throw;
        }
        if (!attempt.accepted) {
            ++rejected_steps_;
            return false;
        }
        relaxation_steps_ += step_.limit == StepLimit::relaxation ? 1 : 0;
        last_dt_ = step_.dt;
        last_measure_ = attempt.measure;
        if (accumulation_)
            accumulation_->end(state_);
        follow();
        return true;
    }

    void observe(bool last) override { watch_.observe(state_, last, stepper_); }

    [[nodiscard]] std::vector<std::string> columns() const override {
        std::vector<std::string> columns{"time_s",
                                         "step",
                                         "dt_s",
                                         "wall_strain",
                                         "wall_shear_traction_Pa",
                                         "wall_normal_traction_Pa",
                                         "mean_deviatoric_magnitude_Pa",
                                         "largest_deviatoric_magnitude_Pa"};
        for (const InternalVariable& variable : scene_.law->variables())
            columns.insert(columns.end(),
                           {fmt::format("smallest_{}", column_name(variable)), fmt::format("largest_{}", column_name(variable))});
        columns.insert(columns.end(), {"plastic_fraction", "equilibrium_residual", "step_measure", "wall_opening_strain",
                                       "wall_strain_rate_1/s", "elastic_energy_J", "wall_work_J", "plastic_dissipation_J",
                                       "transported_energy_J", "energy_error_J", "unresolved_x", "unresolved_y"});
        return columns;
    }

    void row(std::vector<double>& values) override {
        const Units& u = scene_.units;
        const State& state = shown();
        const Observables o = space_.observe(state.cells);
        const EnergyFlow& passed = state.cells.energy;
        const Unresolved unresolved = space_.unresolved(state.cells);
        const double half_height = 0.5 * scene_.grid.height;
        const Velocity walls = wall_displacement(scene_, state);
        values.insert(values.end(), {state.time * u.time, static_cast<double>(state.step), last_dt_ * u.time,
                                     walls.u / half_height, o.wall_traction * u.stress, o.normal_traction * u.stress,
                                     o.mean_magnitude * u.stress, o.largest_magnitude * u.stress});
        const auto variables = scene_.law->variables();
        for (std::size_t k = 0; k < variables.size(); ++k)
            values.insert(values.end(), {o.smallest_internal[k] * variables[k].natural_unit,
                                         o.largest_internal[k] * variables[k].natural_unit});
        values.insert(values.end(), {o.plastic_fraction, space_.equilibrium_residual(state.cells.stress, force_), last_measure_,
                                     walls.v / half_height, state.velocity.u(0, scene_.grid.cells_y) / half_height / u.time,
                                     o.elastic_energy * joule(), passed.work * joule(), passed.dissipation * joule(),
                                     passed.transport * joule(), watch_.energy_error(o.elastic_energy, passed) * joule(),
                                     unresolved.x, unresolved.y});
    }

    [[nodiscard]] run::Curve curve() const override {
        if (scene_.walls.shear.by == WallControl::By::traction)
            return {"time_s", "wall_strain", "time [s]", "wall strain", 1.0};
        return {"wall_strain", "wall_shear_traction_Pa", "wall strain", "shear traction on the wall [MPa]", 1e-6};
    }

    [[nodiscard]] io::ProgressState progress() const override {
        return {time_s(), step(), step_.dt * scene_.units.time, to_string(step_.limit)};
    }

    io::Snapshots& open_snapshots(const std::filesystem::path& fields, const std::string& program,
                                  const std::optional<io::EarlierSnapshots>& earlier) override {
        return snapshots_.emplace(
            fields, program, snapshot_grid(scene_, space_, outputs_), earlier,
            io::SnapshotConstants{{"time_unit_s", scene_.units.time}, {"yield_stress_Pa", scene_.units.stress}});
    }

    void snapshot(double time_s) override {
        std::optional<Accumulated> accumulated;
        if (accumulation_)
            accumulated.emplace(shown_ ? accumulation_->at(*shown_) : accumulation_->now());
        write_snapshot(scene_, space_, shown(), accumulated, outputs_, time_s, state_.step, *snapshots_);
    }

    void describe(io::Checkpoint& content) override {
        content.scalars = {{"last_dt", last_dt_}, {"last_measure", last_measure_}};
        quasistatic::describe(scene_, state_, control_, watch_, content);
        if (accumulation_)
            quasistatic::describe(*accumulation_, content);
        edges_ = space_.movable_edges();
        if (!edges_.empty())
            content.vectors.emplace_back("element_edges", edges_);
    }
    [[nodiscard]] int checkpoint_format() const override { return quasistatic::checkpoint_format; }

    [[nodiscard]] run::Counters counters() const override {
        const StepperCounts now = stepper_.counts();
        return {{"elliptic_solves", now.elliptic_solves},
                {"rate_evaluations", now.evaluations},
                {"pointwise_substeps", now.pointwise_substeps},
                {"rejected_substeps", now.rejected_substeps},
                {"rejected_steps", rejected_steps_},
                {"steps_limited_by_relaxation", relaxation_steps_},
                {"inner_steps", now.inner_steps},
                {"rejected_inner_steps", now.rejected_inner_steps}};
    }

    void describe(const run::Counters& total, io::RunSummary& summary) override {
        summary.rejected_steps = total.at("rejected_steps");
        summary.elliptic_solves = total.at("elliptic_solves");
        summary.pointwise_substeps = total.at("pointwise_substeps");
        summary.phase_seconds = stepper_.phase_seconds();
        for (const char* name :
             {"rate_evaluations", "inner_steps", "rejected_inner_steps", "rejected_substeps", "steps_limited_by_relaxation"})
            summary.extra[name] = total.at(name);
        for (const auto& [method, steps] : stepper_.steps_by_method(state_))
            summary.extra["steps_by_" + method] = steps;
        summary.extra["simulated_time_s"] = time_s();
        const double elastic_energy = space_.observe(state_.cells).elastic_energy, unit = joule();
        const EnergyFlow& passed = state_.cells.energy;
        summary.extra["elastic_energy_J"] = elastic_energy * unit;
        summary.extra["wall_work_J"] = passed.work * unit;
        summary.extra["plastic_dissipation_J"] = passed.dissipation * unit;
        summary.extra["transported_energy_J"] = passed.transport * unit;
        const Unresolved unresolved = space_.unresolved(state_.cells);
        summary.extra["unresolved_x"] = unresolved.x;
        summary.extra["unresolved_y"] = unresolved.y;
        summary.extra["unresolved_flow"] = watch_.worst_flow();
        if (!space_.movable_edges().empty()) {
            summary.extra["edge_moves"] = watch_.edge_moves();
            summary.extra["edge_corrections"] = watch_.edge_corrections();
        }
        summary.extra["energy_error_of_work"] = watch_.relative_energy_error(elastic_energy, passed);
        if (const std::int64_t steps = total.at("inner_steps"); control_.steps_are_own() && steps > many_steps)
            summary.warnings.push_back(fmt::format(
                "SUNDIALS took {} steps; each keeps the tolerance, and the errors of so many add up (109,000 came to 57 times "
                "the tolerance): take --scheme auto, or a tighter --tolerance",
                steps));
        for (const std::vector<std::string>& warnings : {warnings_, watch_.warnings()})
            summary.warnings.insert(summary.warnings.end(), warnings.begin(), warnings.end());
        if (const std::optional<std::string> warning = watch_.ledger_warning(elastic_energy, passed))
            summary.warnings.push_back(*warning);
    }

private:
    /// Of energies, of a metre of thickness.
    [[nodiscard]] double joule() const { return scene_.units.stress * scene_.units.length * scene_.units.length; }
    /// What is written.
    [[nodiscard]] const State& shown() const { return shown_ ? *shown_ : state_; }
    /// Where edges of elements may move, to where the fields are fine by now.
    void follow() {
        const std::vector<double> edges = space_.better_edges(state_.cells);
        if (edges.empty())
            return;
        std::vector<Field*> fields;
        for (const auto& [name, field] : named_fields(scene_, state_))
            fields.push_back(field);
        if (accumulation_)
            for (const auto& [name, field] : accumulation_->named_fields())
                fields.push_back(field);
        const double before = space_.observe(state_.cells).elastic_energy;
        space_.move_edges(edges, fields);
        watch_.edges_moved(put_into_equilibrium(scene_, space_, state_.time, state_.cells));
        // as of all that differences of space do to it
        state_.cells.energy.transport += space_.observe(state_.cells).elastic_energy - before;
        stepper_.renew(state_);
    }
    void begin_accumulation() {
        pieces_.clear();
        if (!accumulation_)
            return;
        accumulation_->begin(state_);
        for (int k = 1; control_.steps_are_own() && k < pieces_of_own_step; ++k)
            pieces_.push_back(state_.time + step_.dt * k / pieces_of_own_step);
    }
    /// Throws RunError where the run must end.
    [[nodiscard]] bool judge(const StepAttempt& made) {
        judged_ = true;
        if (!control_.judge(step_, made))
            return false;
        watch_.judge(made, state_.time, step_.dt);
        return true;
    }

    const run::Outputs& outputs_;
    Scene scene_;
    State& state_;
    TimeStepper& stepper_;
    StepControl& control_;
    Space& space_;
    AccuracyWatch watch_;
    VectorField force_;                        // room for the residual of equilibrium
    std::optional<Accumulation> accumulation_; // where snapshots are taken
    std::optional<io::SnapshotWriter> snapshots_;
    std::vector<std::string> warnings_;
    std::vector<double> edges_; // while a checkpoint is written
    StepControl::Step step_;
    bool judged_ = false;                       // the attempted step
    std::vector<double> times_within_, pieces_; // it, to be shown, and where its pieces end
    const State* shown_ = nullptr;              // unless it is state_
    double last_dt_ = 0.0, last_measure_ = 0.0; // of the last accepted step
    std::int64_t rejected_steps_ = 0, relaxation_steps_ = 0;
};

} // namespace

io::RunStatus run(const Scene& scene, State& state, TimeStepper& stepper, StepControl& control, const run::Outputs& outputs,
                  const run::Files& files, io::RunSummary& summary) {
    GridRun grid_run(scene, state, stepper, control, outputs, files.checkpoint);
    return run::loop(grid_run, outputs, files, summary);
}

void advance(const Scene& scene, State& state, TimeStepper& stepper, StepControl& control, double duration_s) {
    const run::Outputs none{.duration_s = duration_s};
    GridRun grid_run(scene, state, stepper, control, none, nullptr);
    while (state.time < duration_s / scene.units.time)
        if (grid_run.attempt(
                {duration_s}, [] {}, [] {}))
            grid_run.observe(false);
}

} // namespace ductile::quasistatic
