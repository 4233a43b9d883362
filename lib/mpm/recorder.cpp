#include <ductile/base/error.hpp>
#include <ductile/io/terminal_plot.hpp>
#include <ductile/mpm/diagnostics.hpp>
#include <ductile/mpm/recorder.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numeric>

namespace ductile::mpm {

namespace {

/// The internal variables of the scene's laws, each name once.
std::vector<InternalVariable> internal_variables(const Scene& scene) {
    std::vector<InternalVariable> all;
    for (const Material& material : scene.materials)
        for (const InternalVariable& variable : material.law->variables())
            if (std::ranges::none_of(all, [&](const InternalVariable& known) { return known.name == variable.name; }))
                all.push_back(variable);
    return all;
}

/// Its values at all particles; NaN where the law has another.
std::vector<double> values_of(const InternalVariable& variable, const Scene& scene, const Particles& particles) {
    std::vector<std::size_t> place; // among the variables of each law
    for (const Material& material : scene.materials) {
        const auto variables = material.law->variables();
        place.push_back(
            static_cast<std::size_t>(std::ranges::find(variables, variable.name, &InternalVariable::name) - variables.begin()));
    }
    std::vector<double> values(particles.size(), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t p = 0; p < values.size(); ++p) {
        const auto m = static_cast<std::size_t>(particles.material[p]);
        if (place[m] < scene.materials[m].law->variables().size())
            values[p] = particles.internal[place[m]][p];
    }
    return values;
}

/// NaN if there is none.
double largest_of(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), std::numeric_limits<double>::quiet_NaN(),
                           [](double a, double b) { return std::fmax(a, b); });
}

std::vector<std::string> history_columns(const Problem& problem) {
    std::vector<std::string> columns{"time_s",           "step", "dt_s", "kinetic_energy_J", "strain_energy_J", "total_energy_J",
                                     "internal_energy_J"};
    for (const InternalVariable& variable : internal_variables(problem.scene))
        columns.push_back("largest_" + column_name(variable));
    columns.insert(columns.end(), {"smallest_determinant", "enclosed_empty_cells", "newton_iterations", "linear_iterations"});
    for (const RigidBody& body : problem.start.rigid_bodies)
        for (const char* direction : {"x", "y"})
            columns.push_back(fmt::format("{}_force_{}_N", body.name, direction));
    for (const Observable& observable : problem.observables)
        columns.push_back(observable.name);
    return columns;
}

std::string body_array(std::size_t body, const char* coordinate) { return fmt::format("rigid_body_{}/{}", body, coordinate); }

} // namespace

Recorder::Recorder(const Problem& problem, const RunOptions& options, const io::Program& program, const io::OutputFolder& folder,
                   const io::CheckpointReader* checkpoint, double start_s)
    : problem_(problem), options_(options), program_(program), folder_(folder),
      snapshots_(folder.fields(), program.name(), checkpoint ? checkpoint->snapshots(folder, start_s) : std::nullopt,
                 {{"grid_left_m", problem.scene.grid.left},
                  {"grid_bottom_m", problem.scene.grid.bottom},
                  {"cell_width_m", problem.scene.grid.dx()},
                  {"cell_height_m", problem.scene.grid.dy()},
                  {"cells_x", problem.scene.grid.cells_x},
                  {"cells_y", problem.scene.grid.cells_y}}),
      history_(folder.history(), history_columns(problem), checkpoint ? std::optional(checkpoint->history()) : std::nullopt),
      progress_({.duration_s = options.duration_s, .start_s = start_s, .quiet = program.common().quiet}) {}

bool Recorder::lacks_snapshot(double time_s) const { return io::lacks(snapshots_.times(), options_.snapshots_s, time_s); }

std::vector<std::string> Recorder::warnings() const {
    std::vector<std::string> said;
    for (const std::string& warning : {snapshots_.warning(), history_.warning()})
        if (!warning.empty())
            said.push_back(warning);
    return said;
}

void Recorder::snapshot(const State& state) {
    const Particles& p = state.particles;
    const auto numbers = [](const aligned_vector<std::int64_t>& integers) {
        return std::vector<double>(integers.begin(), integers.end());
    };
    const std::vector<double> id = numbers(p.id), material = numbers(p.material);
    std::vector fields{io::ParticleField{"velocity_x", "m/s", p.velocity_x},
                       io::ParticleField{"velocity_y", "m/s", p.velocity_y},
                       io::ParticleField{"stress_xx", "Pa", p.stress_xx},
                       io::ParticleField{"stress_yy", "Pa", p.stress_yy},
                       io::ParticleField{"stress_zz", "Pa", p.stress_zz},
                       io::ParticleField{"stress_xy", "Pa", p.stress_xy},
                       io::ParticleField{"density", "kg/m^3", p.density},
                       io::ParticleField{"temperature_rise", "K", p.temperature},
                       io::ParticleField{"id", "1", id},
                       io::ParticleField{"material", "1", material}};
    const std::vector<InternalVariable> variables = internal_variables(problem_.scene);
    std::vector<std::vector<double>> internal;
    for (const InternalVariable& variable : variables)
        internal.push_back(values_of(variable, problem_.scene, p));
    for (std::size_t k = 0; k < variables.size(); ++k)
        fields.push_back({std::string(variables[k].name), std::string(variables[k].unit), internal[k]});
    snapshots_.write(state.time, state.step, p.x, p.y, fields);
}

void Recorder::row(const State& state, const LastStep& last) {
    const Observation seen{state, last.dt, last.contact_forces};
    const Energies energies = energies_of(problem_.scene, state.particles);
    std::vector<double> row{state.time,      static_cast<double>(state.step),    seen.dt,          energies.kinetic,
                            energies.strain, energies.kinetic + energies.strain, energies.internal};
    for (const InternalVariable& variable : internal_variables(problem_.scene))
        row.push_back(largest_of(values_of(variable, problem_.scene, state.particles)));
    row.insert(row.end(),
               {last.outcome.smallest_determinant,
                static_cast<double>(connectivity_of(problem_.scene.grid, state.particles).enclosed_empty_cells),
                static_cast<double>(last.outcome.newton_iterations), static_cast<double>(last.outcome.linear_iterations)});
    for (const auto& force : seen.contact_forces)
        row.insert(row.end(), force.begin(), force.end());
    for (const Observable& observable : problem_.observables)
        row.push_back(observable.value(seen));
    history_.append(row);
}

void Recorder::progress(const State& state, const StepControl::Step& step) {
    progress_.update({state.time, state.step, step.dt, to_string(step.limit)});
}

void Recorder::checkpoint(const State& state, const StepControl& control, const Tally& tally,
                          const std::map<std::string, std::int64_t>& counters, const LastStep& last) {
    io::Checkpoint content{.program = program_.name(), .format = checkpoint_format, .config = program_.config_text()};
    content.scalars = {{"time", state.time}, {"planned_dt", control.plan().next}, {"rest_of_step", control.plan().rest}};
    content.counters = counters;
    content.counters["step"] = state.step;
    content.counters["shortened"] = static_cast<int>(control.plan().shortened);
    for (const auto& [name, array] : named_arrays(state.particles))
        content.vectors.emplace_back(fmt::format("particles/{}", name), *array);
    for (const auto& [name, array] : named_integer_arrays(state.particles))
        content.integer_vectors.emplace_back(fmt::format("particles/{}", name), *array);
    for (std::size_t b = 0; b < state.rigid_bodies.size(); ++b) {
        content.vectors.emplace_back(body_array(b, "x"), state.rigid_bodies[b].x);
        content.vectors.emplace_back(body_array(b, "y"), state.rigid_bodies[b].y);
    }
    for (const auto& [name, numbers] : tally)
        content.vectors.emplace_back(fmt::format("tally/{}", name), numbers);
    content.integer_vectors.emplace_back("touching", control.plan().touching);
    std::vector<double> last_step{last.dt, last.outcome.smallest_determinant, static_cast<double>(last.outcome.newton_iterations),
                                  static_cast<double>(last.outcome.linear_iterations)};
    for (const auto& force : last.contact_forces)
        last_step.insert(last_step.end(), force.begin(), force.end());
    content.vectors.emplace_back("last_step", last_step);
    content.snapshots = snapshots_.times().size();
    content.history = history_.mark();
    io::write_checkpoint(folder_.checkpoint(), content);
}

std::string Recorder::curve() {
    if (problem_.curve_x.empty())
        return {};
    const io::HistoryTable history = history_.read({problem_.curve_x, problem_.curve_y});
    return io::terminal_plot(history.column(problem_.curve_x), history.column(problem_.curve_y),
                             {.x_label = problem_.label_x, .y_label = problem_.label_y});
}

void Recorder::finish() {
    progress_.finish();
    history_.finish();
    snapshots_.finish();
}

LastStep read_last_step(const io::CheckpointReader& checkpoint, std::size_t rigid_bodies) {
    const std::vector<double> numbers = checkpoint.vector("last_step");
    if (numbers.size() != 4 + 2 * rigid_bodies)
        throw InputError(fmt::format("{}: 'last_step' has {} values, expected {}: use another checkpoint",
                                     checkpoint.path().string(), numbers.size(), 4 + 2 * rigid_bodies));
    LastStep last{.dt = numbers[0],
                  .outcome = {.accepted = true,
                              .smallest_determinant = numbers[1],
                              .newton_iterations = static_cast<int>(numbers[2]),
                              .linear_iterations = static_cast<int>(numbers[3])}};
    for (std::size_t b = 0; b < rigid_bodies; ++b)
        last.contact_forces.push_back({numbers[4 + 2 * b], numbers[5 + 2 * b]});
    return last;
}

State read_state(const io::CheckpointReader& checkpoint, const State& start) {
    State state = start;
    const std::size_t stored = checkpoint.vector("particles/x").size();
    if (stored != start.particles.size())
        throw InputError(fmt::format("{}: the checkpoint has {} particles, the scene {}: leave the scene's options as they were",
                                     checkpoint.path().string(), stored, start.particles.size()));
    const auto fill = [&](auto& array, const std::string& name, const auto& values) {
        if (values.size() != array.size())
            throw InputError(fmt::format("{}: '{}' has {} values, expected {}: use another checkpoint",
                                         checkpoint.path().string(), name, values.size(), array.size()));
        for (const auto value : values)
            if (!std::isfinite(static_cast<double>(value)))
                throw InputError(fmt::format("{}: '{}' has a value that is not finite: use another checkpoint",
                                             checkpoint.path().string(), name));
        array.assign(values.begin(), values.end());
    };
    const auto fill_vector = [&](auto& array, const std::string& name) { fill(array, name, checkpoint.vector(name)); };
    for (const auto& [name, array] : named_arrays(state.particles))
        fill_vector(*array, fmt::format("particles/{}", name));
    for (const auto& [name, array] : named_integer_arrays(state.particles))
        fill(*array, std::string(name), checkpoint.integer_vector(fmt::format("particles/{}", name)));
    for (std::size_t b = 0; b < state.rigid_bodies.size(); ++b) {
        fill_vector(state.rigid_bodies[b].x, body_array(b, "x"));
        fill_vector(state.rigid_bodies[b].y, body_array(b, "y"));
    }
    state.time = checkpoint.scalar("time");
    state.step = checkpoint.counter("step");
    if (!std::isfinite(state.time) || state.step < 0)
        throw InputError(fmt::format("{}: time {} s after {} steps is impossible: use another checkpoint",
                                     checkpoint.path().string(), state.time, state.step));
    return state;
}

} // namespace ductile::mpm
