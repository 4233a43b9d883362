#include <ductile/base/error.hpp>
#include <ductile/io/terminal_plot.hpp>
#include <ductile/quasistatic/projection.hpp>
#include <ductile/quasistatic/recorder.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace ductile::quasistatic {

namespace {

io::ArrayView view(const Field& field) { return {field.row(0), field.rows(), field.columns(), field.stride()}; }

/// The fields of a state by their names in checkpoints; `State` is const or not.
template <class S> auto named_fields(const Scene& scene, S& state) {
    std::vector<std::pair<std::string, decltype(&state.velocity.u)>> fields;
    for (int k = 0; k < state.cells.count(); ++k)
        fields.emplace_back(field_names(scene)[static_cast<std::size_t>(k)], &state.cells.field(k));
    fields.emplace_back("velocity_x", &state.velocity.u);
    fields.emplace_back("velocity_y", &state.velocity.v);
    return fields;
}

void read_field(const io::CheckpointReader& checkpoint, const std::string& name, Field& field) {
    checkpoint.read_array(name, {field.row(0), field.rows(), field.columns(), field.stride()});
    for (int j = 0; j < field.rows(); ++j) {
        if (!std::all_of(field.row(j), field.row(j) + field.columns(), [](double value) { return std::isfinite(value); }))
            throw InputError(
                fmt::format("{}: '{}' has a value that is not finite: use another checkpoint", checkpoint.path().string(), name));
        field.wrap_row(j);
    }
}

std::vector<std::string> history_columns(const Scene& scene) {
    std::vector<std::string> columns{"time_s",
                                     "step",
                                     "dt_s",
                                     "wall_strain",
                                     "wall_shear_traction_Pa",
                                     "wall_normal_traction_Pa",
                                     "mean_deviatoric_magnitude_Pa",
                                     "largest_deviatoric_magnitude_Pa"};
    for (const InternalVariable& variable : scene.law->variables())
        columns.insert(columns.end(), {"smallest_" + column_name(variable), "largest_" + column_name(variable)});
    columns.insert(columns.end(), {"plastic_fraction", "equilibrium_residual", "step_measure"});
    return columns;
}

/// Which scheme and step control hidden values belong to.
std::map<std::string, std::int64_t> identity(const TimeStepper& stepper, const StepControl& control) {
    return {{"scheme", static_cast<std::int64_t>(stepper.scheme())}, {"step_control", control.identity()}};
}

} // namespace

Recorder::Recorder(const Scene& scene, const RunOptions& options, const io::Program& program, const io::OutputFolder& folder,
                   const io::CheckpointReader* checkpoint, double start_s)
    : scene_(scene), options_(options), program_(program), folder_(folder), force_(scene.grid),
      snapshots_(folder.fields(), program.name(),
                 {scene.grid.cells_x, scene.grid.cells_y, scene.grid.width * scene.units.length,
                  scene.grid.height * scene.units.length, scene.grid.x(0) * scene.units.length,
                  scene.grid.y(0) * scene.units.length},
                 // a snapshot's time is the one asked for, which may differ from the state's by round-off
                 checkpoint ? checkpoint->snapshots(folder, start_s * (1.0 + 1e-12)) : std::nullopt,
                 {{"time_unit_s", scene.units.time}, {"yield_stress_Pa", scene.units.stress}}),
      history_(folder.history(), history_columns(scene), checkpoint ? std::optional(checkpoint->history()) : std::nullopt),
      progress_({.duration_s = options.duration_s, .start_s = start_s, .quiet = program.common().quiet}) {}

bool Recorder::lacks_snapshot(double time_s) const { return io::lacks(snapshots_.times(), options_.snapshots_s, time_s); }

std::vector<std::string> Recorder::warnings() const {
    std::vector<std::string> said;
    for (const std::string& warning : {snapshots_.warning(), history_.warning()})
        if (!warning.empty())
            said.push_back(warning);
    return said;
}

void Recorder::snapshot(const State& state, double time_s) {
    const Units& u = scene_.units;
    const CellState& cells = state.cells;
    Field magnitude(scene_.grid.cells_y, scene_.grid.cells_x);
    for (int j = 0; j < magnitude.rows(); ++j)
        for (int i = 0; i < magnitude.columns(); ++i) {
            const double s = cells.stress.s(i, j), tau = cells.stress.tau(i, j), q = cells.stress.q(i, j);
            magnitude(i, j) = std::sqrt(s * s + tau * tau + 3.0 * q * q);
        }
    using enum io::Centring;
    std::vector fields{io::SnapshotField{"pressure", "Pa", cell, view(cells.stress.p), u.stress},
                       io::SnapshotField{"s", "Pa", cell, view(cells.stress.s), u.stress},
                       io::SnapshotField{"tau", "Pa", cell, view(cells.stress.tau), u.stress},
                       io::SnapshotField{"q", "Pa", cell, view(cells.stress.q), u.stress},
                       io::SnapshotField{"deviatoric_magnitude", "Pa", cell, view(magnitude), u.stress},
                       io::SnapshotField{"velocity_x", "m/s", corner, view(state.velocity.u), u.velocity()},
                       io::SnapshotField{"velocity_y", "m/s", corner, view(state.velocity.v), u.velocity()}};
    const auto variables = scene_.law->variables();
    for (std::size_t k = 0; k < variables.size(); ++k)
        fields.emplace_back(std::string(variables[k].name), std::string(variables[k].unit), cell, view(cells.internal[k]),
                            variables[k].natural_unit);
    snapshots_.write(time_s, state.step, fields);
}

void Recorder::row(const State& state, const LastStep& last) {
    const Units& u = scene_.units;
    const Observables o = observe(scene_, state.cells);
    const double strain = scene_.walls.displacement(state.time).u / (0.5 * scene_.grid.height);
    std::vector<double> row{state.time * u.time,
                            static_cast<double>(state.step),
                            last.dt * u.time,
                            strain,
                            o.wall_traction * u.stress,
                            o.normal_traction * u.stress,
                            o.mean_magnitude * u.stress,
                            o.largest_magnitude * u.stress};
    const auto variables = scene_.law->variables();
    for (std::size_t k = 0; k < variables.size(); ++k)
        row.insert(row.end(),
                   {o.smallest_internal[k] * variables[k].natural_unit, o.largest_internal[k] * variables[k].natural_unit});
    row.insert(row.end(), {o.plastic_fraction, equilibrium_residual(scene_, state.cells, force_), last.measure});
    history_.append(row);
}

void Recorder::progress(const State& state, const StepControl::Step& step) {
    progress_.update({state.time * scene_.units.time, state.step, step.dt * scene_.units.time, to_string(step.limit)});
}

void Recorder::checkpoint(TimeStepper& stepper, StepControl& control, AccuracyWatch& watch,
                          const std::map<std::string, std::int64_t>& counters, const LastStep& last) {
    const State& state = stepper.state();
    io::Checkpoint content{.program = program_.name(), .format = checkpoint_format, .config = program_.config_text()};
    content.scalars = {{"time", state.time}, {"last_dt", last.dt}, {"last_measure", last.measure}};
    for (const auto& numbers : {stepper.hidden_numbers(), control.hidden_numbers(), watch.hidden_numbers()})
        for (const auto& [name, value] : numbers)
            content.scalars[name] = *value;
    content.counters = counters;
    content.counters.merge(identity(stepper, control));
    content.counters["step"] = state.step;
    content.counters["cells_x"] = scene_.grid.cells_x;
    content.counters["cells_y"] = scene_.grid.cells_y;
    for (const auto& [name, field] : named_fields(scene_, state))
        content.arrays.emplace_back(name, view(*field));
    for (const auto& [name, field] : stepper.hidden_fields())
        content.arrays.emplace_back(name, view(*field));
    content.snapshots = snapshots_.times().size();
    content.history = history_.mark();
    io::write_checkpoint(folder_.checkpoint(), content);
}

std::string Recorder::curve() {
    const io::HistoryTable history = history_.read({"wall_strain", "wall_shear_traction_Pa"});
    const std::vector<double> strain = history.column("wall_strain");
    std::vector<double> traction = history.column("wall_shear_traction_Pa");
    for (double& value : traction)
        value *= 1e-6;
    return io::terminal_plot(strain, traction, {.x_label = "wall strain", .y_label = "shear traction on the wall [MPa]"});
}

void Recorder::finish() {
    progress_.finish();
    history_.finish();
    snapshots_.finish();
}

State read_state(const io::CheckpointReader& checkpoint, const Scene& scene) {
    const Grid& grid = scene.grid;
    checkpoint.require_cells({grid.cells_x, grid.cells_y});
    if (checkpoint.history().mark.columns != fmt::format("{}", fmt::join(history_columns(scene), ",")))
        throw InputError(fmt::format("{}: this checkpoint was written with another --plasticity: restart with that one",
                                     checkpoint.path().string()));
    State state{.cells = CellState(scene),
                .velocity = VectorField(grid),
                .time = checkpoint.scalar("time"),
                .step = checkpoint.counter("step")};
    for (const auto& [name, field] : named_fields(scene, state))
        read_field(checkpoint, name, *field);
    if (!std::isfinite(state.time) || state.step < 0)
        throw InputError(fmt::format("{}: time {} s after {} steps is impossible: use another checkpoint",
                                     checkpoint.path().string(), state.time * scene.units.time, state.step));
    return state;
}

LastStep read_last_step(const io::CheckpointReader& checkpoint) {
    return {.dt = checkpoint.scalar("last_dt"), .measure = checkpoint.scalar("last_measure")};
}

void restore_hidden(const io::CheckpointReader& checkpoint, TimeStepper& stepper, StepControl& control, AccuracyWatch& watch) {
    for (const auto& [name, value] : watch.hidden_numbers())
        *value = checkpoint.scalar(name);
    for (const auto& [name, value] : identity(stepper, control))
        if (checkpoint.counter(name) != value)
            return;
    for (const auto& [name, field] : stepper.hidden_fields())
        read_field(checkpoint, name, *field);
    for (const auto& numbers : {stepper.hidden_numbers(), control.hidden_numbers()})
        for (const auto& [name, value] : numbers)
            *value = checkpoint.scalar(name);
    stepper.resume();
    control.resume();
}

} // namespace ductile::quasistatic
