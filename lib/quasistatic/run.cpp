#include <ductile/base/error.hpp>
#include <ductile/base/timer.hpp>
#include <ductile/io/history.hpp>
#include <ductile/io/interrupt.hpp>
#include <ductile/io/progress.hpp>
#include <ductile/io/snapshots.hpp>
#include <ductile/io/terminal_plot.hpp>
#include <ductile/quasistatic/run.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <string>

namespace ductile::quasistatic {

namespace {

io::ArrayView view(const Field& field) { return {field.row(0), field.rows(), field.columns(), field.stride()}; }

/// The fields of a state by their names in checkpoints; `State` is const or not.
template <class S> auto named_fields(S& state) {
    auto& [p, s, tau, q] = state.cells.stress;
    return std::array{std::pair{"p", &p},
                      std::pair{"s", &s},
                      std::pair{"tau", &tau},
                      std::pair{"q", &q},
                      std::pair{"internal", &state.cells.internal},
                      std::pair{"velocity_x", &state.velocity.u},
                      std::pair{"velocity_y", &state.velocity.v}};
}

std::string internal_name(const Scene& scene) {
    return std::visit([](const auto& model) { return std::string(model.internal_name); }, scene.plasticity);
}

std::string internal_unit(const Scene& scene) {
    return std::visit([](const auto& model) { return std::string(model.internal_unit); }, scene.plasticity);
}

std::vector<std::string> history_columns(const Scene& scene) {
    const std::string internal = internal_name(scene), unit = internal_unit(scene), suffix = unit == "1" ? "" : "_" + unit;
    return {"time_s",
            "step",
            "dt_s",
            "wall_strain",
            "wall_shear_traction_Pa",
            "wall_normal_traction_Pa",
            "mean_deviatoric_magnitude_Pa",
            "largest_deviatoric_magnitude_Pa",
            "smallest_" + internal + suffix,
            "largest_" + internal + suffix,
            "plastic_fraction",
            "projection_measure"};
}

/// Everything a run writes, in SI.
class Recorder {
public:
    Recorder(const Scene& scene, const RunOptions& options, const io::Program& program, const io::OutputFolder& folder,
             const io::CheckpointReader* checkpoint, double start_s)
        : scene_(scene), program_(program), folder_(folder),
          snapshots_(folder.fields(), program.name(),
                     {scene.grid.cells_x, scene.grid.cells_y, scene.grid.width * scene.units.length,
                      scene.grid.height * scene.units.length, scene.grid.x(0) * scene.units.length,
                      scene.grid.y(0) * scene.units.length},
                     checkpoint && folder.continued() ? std::optional(io::EarlierSnapshots{folder.fields(), start_s})
                                                      : std::nullopt,
                     {{"time_unit_s", scene.units.time}, {"yield_stress_Pa", scene.units.stress}}),
          history_(folder.history(), history_columns(scene)),
          progress_({.duration_s = options.duration_s, .start_s = start_s, .quiet = program.common().quiet}) {
        if (checkpoint)
            history_.restore(checkpoint->history());
    }

    void snapshot(const State& state) {
        const Units& u = scene_.units;
        const CellState& cells = state.cells;
        Field magnitude(scene_.grid.cells_y, scene_.grid.cells_x);
        for (int j = 0; j < magnitude.rows(); ++j)
            for (int i = 0; i < magnitude.columns(); ++i) {
                const double s = cells.stress.s(i, j), tau = cells.stress.tau(i, j), q = cells.stress.q(i, j);
                magnitude(i, j) = std::sqrt(s * s + tau * tau + 3.0 * q * q);
            }
        using enum io::Centring;
        const std::array fields{
            io::SnapshotField{"pressure", "Pa", cell, view(cells.stress.p), u.stress},
            io::SnapshotField{"s", "Pa", cell, view(cells.stress.s), u.stress},
            io::SnapshotField{"tau", "Pa", cell, view(cells.stress.tau), u.stress},
            io::SnapshotField{"q", "Pa", cell, view(cells.stress.q), u.stress},
            io::SnapshotField{"deviatoric_magnitude", "Pa", cell, view(magnitude), u.stress},
            io::SnapshotField{internal_name(scene_), internal_unit(scene_), cell, view(cells.internal), u.temperature},
            io::SnapshotField{"velocity_x", "m/s", corner, view(state.velocity.u), u.velocity()},
            io::SnapshotField{"velocity_y", "m/s", corner, view(state.velocity.v), u.velocity()}};
        snapshots_.write(state.time * u.time, state.step, fields);
    }

    void row(const State& state, double dt, double projection_measure) {
        const Units& u = scene_.units;
        const Observables o = observe(scene_, state.cells);
        const double strain = scene_.walls.displacement(state.time).u / (0.5 * scene_.grid.height);
        history_.append({state.time * u.time, static_cast<double>(state.step), dt * u.time, strain, o.wall_traction * u.stress,
                         o.normal_traction * u.stress, o.mean_magnitude * u.stress, o.largest_magnitude * u.stress,
                         o.smallest_internal * u.temperature, o.largest_internal * u.temperature, o.plastic_fraction,
                         projection_measure});
    }

    void progress(const State& state, const StepControl::Step& step) {
        progress_.update({state.time * scene_.units.time, state.step, step.dt * scene_.units.time, to_string(step.limit)});
    }

    void checkpoint(const State& state, const StepControl& control, const std::map<std::string, std::int64_t>& counters) {
        io::Checkpoint content{.program = program_.name(), .format = checkpoint_format, .config = program_.config_text()};
        content.scalars = {{"time", state.time}, {"planned_step", control.planned_step()}};
        content.counters = counters;
        content.counters["step"] = state.step;
        content.counters["cells_x"] = scene_.grid.cells_x;
        content.counters["cells_y"] = scene_.grid.cells_y;
        for (const auto& [name, field] : named_fields(state))
            content.arrays.emplace_back(name, view(*field));
        content.history = &history_.table();
        io::write_checkpoint(folder_.checkpoint(), content);
    }

    /// The strain-stress curve of the whole run, for the terminal.
    [[nodiscard]] std::string curve() const {
        const std::vector<double> strain = history_.table().column("wall_strain");
        std::vector<double> traction = history_.table().column("wall_shear_traction_Pa");
        for (double& value : traction)
            value *= 1e-6;
        return io::terminal_plot(strain, traction, {.x_label = "wall strain", .y_label = "shear traction on the wall [MPa]"});
    }

    void finish() {
        progress_.finish();
        history_.finish();
        snapshots_.finish();
    }

private:
    const Scene& scene_;
    const io::Program& program_;
    const io::OutputFolder& folder_;
    io::SnapshotWriter snapshots_;
    io::History history_;
    io::Progress progress_;
};

} // namespace

State read_state(const io::CheckpointReader& checkpoint, const Scene& scene) {
    const Grid& grid = scene.grid;
    checkpoint.require_cells({grid.cells_x, grid.cells_y});
    if (checkpoint.history().columns != history_columns(scene))
        throw InputError(fmt::format("{}: this checkpoint was written with another --plasticity: restart with that one",
                                     checkpoint.path().string()));
    State state{.cells = CellState(grid),
                .velocity = {Field(grid.cells_y + 1, grid.cells_x), Field(grid.cells_y + 1, grid.cells_x)},
                .time = checkpoint.scalar("time"),
                .step = checkpoint.counter("step")};
    for (const auto& [name, field] : named_fields(state)) {
        checkpoint.read_array(name, {field->row(0), field->rows(), field->columns(), field->stride()});
        for (int j = 0; j < field->rows(); ++j)
            field->wrap_row(j);
    }
    return state;
}

io::RunStatus run(const Scene& scene, ProjectionStepper& stepper, StepControl& control, const RunOptions& options,
                  const io::Program& program, const io::OutputFolder& folder, const io::CheckpointReader* checkpoint,
                  io::RunSummary& summary) {
    const double unit = scene.units.time;
    const double end = options.duration_s / unit;
    const double start = stepper.state().time;

    std::vector<double> targets; // output times still to come, then the end
    for (const double time : options.snapshots_s)
        if (time / unit > start && time / unit <= end)
            targets.push_back(time / unit);
    std::sort(targets.begin(), targets.end());
    targets.erase(std::unique(targets.begin(), targets.end()), targets.end());
    const std::vector<double> snapshot_times = targets;
    if (targets.empty() || targets.back() < end)
        targets.push_back(end);

    std::map<std::string, std::int64_t> counters{{"pointwise_substeps", 0}, {"rejected_substeps", 0}, {"elliptic_solves", 0}};
    if (checkpoint) {
        control.restore_planned_step(checkpoint->scalar("planned_step"));
        for (auto& [name, value] : counters)
            value = checkpoint->counter(name);
    }

    Timer wall, since_checkpoint;
    Recorder recorder(scene, options, program, folder, checkpoint, start * unit);
    if (!checkpoint) {
        if (std::find(options.snapshots_s.begin(), options.snapshots_s.end(), 0.0) != options.snapshots_s.end())
            recorder.snapshot(stepper.state());
        recorder.row(stepper.state(), 0.0, 0.0);
    }
    const auto describe_run = [&] {
        const PhaseSeconds phases = stepper.phase_seconds();
        summary.steps = stepper.state().step;
        summary.elliptic_solves = counters["elliptic_solves"];
        summary.pointwise_substeps = counters["pointwise_substeps"];
        summary.wall_seconds = wall.seconds();
        summary.phase_seconds = {{"predictor", phases.predictor}, {"elliptic solve", phases.solve}, {"update", phases.update}};
        summary.extra["rejected_substeps"] = counters["rejected_substeps"];
        summary.extra["simulated_time_s"] = stepper.state().time * unit;
        summary.drawing = recorder.curve();
    };

    double output_seconds = 0.0;
    std::size_t target = 0;
    StepControl::Step step;
    StepReport report;
    try {
        while (target < targets.size()) {
            if (io::interrupted()) {
                recorder.checkpoint(stepper.state(), control, counters);
                recorder.finish();
                describe_run();
                return io::RunStatus::interrupted;
            }
            const double knot = scene.walls.next_knot(stepper.state().time);
            const double goal = std::min(targets[target], knot);
            step = control.next(stepper.state().time, goal);
            report = stepper.step(step.dt, step.end, control.pointwise_options(step.dt));
            control.update(step, report.projection_measure);
            counters["pointwise_substeps"] += report.substeps.accepted;
            counters["rejected_substeps"] += report.substeps.rejected;
            ++counters["elliptic_solves"];

            Timer output;
            if (stepper.state().step % options.history_every == 0)
                recorder.row(stepper.state(), step.dt, report.projection_measure);
            recorder.progress(stepper.state(), step);
            if (step.lands && goal == targets[target]) {
                if (std::binary_search(snapshot_times.begin(), snapshot_times.end(), goal))
                    recorder.snapshot(stepper.state());
                ++target;
            }
            if (since_checkpoint.seconds() > program.common().checkpoint_every_s) {
                recorder.checkpoint(stepper.state(), control, counters);
                since_checkpoint.lap();
            }
            output_seconds += output.seconds();
        }
        recorder.checkpoint(stepper.state(), control, counters);
        // the row of the end, where it is not an n-th one: a continued run will not have it
        if (stepper.state().step % options.history_every != 0)
            recorder.row(stepper.state(), step.dt, report.projection_measure);
    } catch (...) {
        describe_run();
        recorder.finish();
        throw;
    }
    recorder.finish();
    describe_run();
    summary.phase_seconds.emplace_back("output", output_seconds);
    return io::RunStatus::completed;
}

} // namespace ductile::quasistatic
