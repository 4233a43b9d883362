// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/quasistatic/state.hpp>

#include <algorithm>

namespace ductile::quasistatic {

namespace {

using NamedFields = std::vector<std::pair<std::string, Field*>>;

void append(const std::string& prefix, const Scene& scene, CellState& cells, NamedFields& list) {
    const std::vector<std::string> names = field_names(scene);
    for (std::size_t k = 0; k < names.size(); ++k)
        list.emplace_back(prefix + names[k], &cells.field(static_cast<int>(k)));
}

void append(const std::string& prefix, VectorField& velocity, NamedFields& list) {
    list.emplace_back(prefix + "_x", &velocity.u);
    list.emplace_back(prefix + "_y", &velocity.v);
}

} // namespace

NamedFields named_fields(const Scene& scene, State& state) {
    NamedFields list;
    append("", scene, state.cells, list);
    append("velocity", state.velocity, list);
    for (auto& [name, cells] : state.memory.cells)
        append(name + "_", scene, cells, list);
    for (auto& [name, velocity] : state.memory.velocities)
        append(name, velocity, list);
    return list;
}

std::vector<std::pair<std::string, double*>> named_numbers(State& state) {
    std::vector<std::pair<std::string, double*>> list{{"time", &state.time}};
    const auto append_numbers = [&](const std::string& prefix, CellState& cells) {
        list.emplace_back(prefix + "wall_x", &cells.wall.u);
        list.emplace_back(prefix + "wall_y", &cells.wall.v);
        list.emplace_back(prefix + "work", &cells.energy.work);
        list.emplace_back(prefix + "dissipation", &cells.energy.dissipation);
        list.emplace_back(prefix + "transport", &cells.energy.transport);
    };
    append_numbers("", state.cells);
    for (auto& [name, cells] : state.memory.cells)
        append_numbers(name + "_", cells);
    for (std::size_t k = 0; k < state.memory.numbers.size(); ++k)
        list.emplace_back(state.memory.names[k], &state.memory.numbers[k]);
    return list;
}

Velocity wall_displacement(const Scene& scene, const State& state) {
    const auto component = [&](const WallControl& control, double integrated) { // what is prescribed is known exactly
        return control.by == WallControl::By::velocity ? control.history.displacement(state.time) : integrated;
    };
    return {component(scene.walls.shear, state.cells.wall.u), component(scene.walls.opening, state.cells.wall.v)};
}

State initial_state(const Scene& scene, const Space& space, const Field& internal) {
    if (!scene.law->has_rates())
        throw InputError("the plastic flow of this law changes the volume, which cells do not follow: use particles, or a law of "
                         "isochoric flow");
    State state{.cells = space.make_cells(), .velocity = space.make_velocity()};
    const auto variables = scene.law->variables();
    if (!variables.empty())
        copy_values(internal, state.cells.internal[0]);
    for (std::size_t k = 1; k < variables.size(); ++k)
        set_all(state.cells.internal[k], variables[k].start / variables[k].natural_unit);
    move_walls(scene, wall_velocity_between(scene, {}, wanted_traction(scene, 0.0), 1.0), state.cells);
    space.add_affine(wall_velocity(scene, scene.walls.after(0.0), {}), state.velocity);
    return state;
}

} // namespace ductile::quasistatic
