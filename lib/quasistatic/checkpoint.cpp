// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/quasistatic/checkpoint.hpp>
#include <ductile/space/field_view.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace ductile::quasistatic {

namespace {

void read_field(const io::CheckpointReader& checkpoint, const std::string& name, Field& field) {
    checkpoint.read_array(name, view(field));
    if (!is_finite(field))
        throw InputError(
            fmt::format("{}: '{}' has a value that is not finite: use another checkpoint", checkpoint.path().string(), name));
    field.wrap();
}

} // namespace

void describe(const Scene& scene, State& state, StepControl& control, AccuracyWatch& watch, io::Checkpoint& content) {
    for (const auto& numbers : {named_numbers(state), control.hidden_numbers(), watch.hidden_numbers()})
        for (const auto& [name, value] : numbers)
            content.scalars[name] = *value;
    content.texts = {{"scheme", state.memory.scheme}, {"step_control", control.identity()}};
    content.counters["step"] = state.step;
    content.counters["cells_x"] = scene.grid.cells_x;
    content.counters["cells_y"] = scene.grid.cells_y;
    for (const auto& [name, field] : named_fields(scene, state))
        content.arrays.emplace_back(name, view(*field));
}

void describe(Accumulation& accumulation, io::Checkpoint& content) {
    for (const auto& [name, field] : accumulation.named_fields())
        content.arrays.emplace_back(name, view(*field));
}

State read_state(const io::CheckpointReader& checkpoint, const Scene& scene, Space& space) {
    const Grid& grid = scene.grid;
    checkpoint.require_cells({grid.cells_x, grid.cells_y});
    if (!space.movable_edges().empty())
        space.move_edges(checkpoint.vector("element_edges"), {});
    const std::string columns = checkpoint.history().mark.columns;
    for (const InternalVariable& variable : scene.law->variables())
        if (columns.find(fmt::format("largest_{}", column_name(variable))) == std::string::npos)
            throw InputError(fmt::format("{}: this checkpoint was written with another --plasticity: restart with that one",
                                         checkpoint.path().string()));
    State state{.cells = space.make_cells(),
                .velocity = space.make_velocity(),
                .time = checkpoint.scalar("time"),
                .step = checkpoint.counter("step")};
    for (const auto& [name, field] : named_fields(scene, state))
        read_field(checkpoint, name, *field);
    if (!std::isfinite(state.time) || state.step < 0)
        throw InputError(fmt::format("{}: time {} s after {} steps is impossible: use another checkpoint",
                                     checkpoint.path().string(), state.time * scene.units.time, state.step));
    return state;
}

void restore(const io::CheckpointReader& checkpoint, const Scene& scene, const TimeStepper& stepper, State& state,
             StepControl& control, AccuracyWatch& watch) {
    for (const auto& [name, value] : watch.hidden_numbers())
        *value = checkpoint.scalar(name);
    stepper.adopt(state);
    if (checkpoint.text("scheme") != stepper.scheme() || checkpoint.text("step_control") != control.identity())
        return;
    for (const auto& [name, field] : named_fields(scene, state))
        read_field(checkpoint, name, *field);
    for (const auto& numbers : {named_numbers(state), control.hidden_numbers()})
        for (const auto& [name, value] : numbers)
            *value = checkpoint.scalar(name);
    control.resume();
}

bool restore(const io::CheckpointReader& checkpoint, Accumulation& accumulation) {
    const auto fields = accumulation.named_fields();
    if (!checkpoint.has_array(fields.front().first))
        return false;
    for (const auto& [name, field] : fields)
        read_field(checkpoint, name, *field);
    return true;
}

} // namespace ductile::quasistatic
