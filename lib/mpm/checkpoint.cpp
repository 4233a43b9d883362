// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/mpm/checkpoint.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <string_view>
#include <utility>

namespace ductile::mpm {

namespace {

std::string body_array(std::size_t body, const char* coordinate) { return fmt::format("rigid_body_{}/{}", body, coordinate); }

/// StepControl::Shortened by its names in files.
constexpr std::array<std::string_view, 3> shortened_by{"ramp", "failure", "newton iterations"};

} // namespace

void describe(const State& state, const StepControl& control, const Tally& tally, io::Checkpoint& content) {
    content.scalars.insert({{"time", state.time}, {"planned_dt", control.plan().next}, {"rest_of_step", control.plan().rest}});
    content.counters["step"] = state.step;
    content.texts["shortened_by"] = shortened_by[static_cast<std::size_t>(control.plan().shortened)];
    for (const auto& [name, array] : named_arrays(state.particles))
        content.vectors.emplace_back(fmt::format("particles/{}", name), *array);
    for (const auto& [name, array] : named_integer_arrays(state.particles))
        content.integer_vectors.emplace_back(fmt::format("particles/{}", name), *array);
    for (std::size_t b = 0; b < state.rigid_bodies.size(); ++b) {
        content.vectors.emplace_back(body_array(b, "x"), state.rigid_bodies[b].x);
        content.vectors.emplace_back(body_array(b, "y"), state.rigid_bodies[b].y);
    }
    const SurfacePoints& surface = state.particles.surface;
    if (surface.size() > 0) {
        content.vectors.emplace_back("surface/x", surface.x);
        content.vectors.emplace_back("surface/y", surface.y);
        for (std::size_t b = 0; b < surface.held.size(); ++b)
            if (!surface.held[b].empty())
                content.vectors.emplace_back(fmt::format("surface/held_{}", b), surface.held[b]);
        for (std::size_t b = 0; b < surface.held_by_bodies.size(); ++b)
            content.vectors.emplace_back(fmt::format("surface/held_by_body_{}", b), surface.held_by_bodies[b]);
    }
    const LoadedSides& loaded = state.particles.loaded;
    if (loaded.size() > 0)
        for (const auto& [name, array] : {std::pair{"loaded/x", &loaded.x},
                                          {"loaded/y", &loaded.y},
                                          {"loaded/along_x", &loaded.along_x},
                                          {"loaded/along_y", &loaded.along_y}})
            content.vectors.emplace_back(name, *array);
    for (const auto& [name, numbers] : tally)
        content.vectors.emplace_back(fmt::format("tally/{}", name), numbers);
    content.integer_vectors.emplace_back("touching", control.plan().touching);
}

void restore(const io::CheckpointReader& checkpoint, StepControl& control, Tally& tally) {
    const auto shortened = std::ranges::find(shortened_by, checkpoint.text("shortened_by"));
    if (shortened == shortened_by.end())
        throw InputError(fmt::format("{}: 'shortened_by' is {}: use another checkpoint", checkpoint.path().string(),
                                     checkpoint.text("shortened_by")));
    control.restore({.next = checkpoint.scalar("planned_dt"),
                     .rest = checkpoint.scalar("rest_of_step"),
                     .shortened = static_cast<StepControl::Shortened>(shortened - shortened_by.begin()),
                     .touching = checkpoint.integer_vector("touching")});
    for (auto& [name, numbers] : tally) {
        std::vector<double> stored = checkpoint.vector(fmt::format("tally/{}", name));
        if (stored.size() < numbers.size()) // some grow in a run
            throw InputError(fmt::format("{}: 'tally/{}' has {} values, expected {} or more: use another checkpoint",
                                         checkpoint.path().string(), name, stored.size(), numbers.size()));
        numbers = std::move(stored);
    }
}

State read_state(const io::CheckpointReader& checkpoint, const Scene& scene, const State& start) {
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
    // what is carried was added to particles in the order of their numbers
    std::vector<std::int64_t> place(state.particles.size(), -1);
    for (std::size_t p = 0; p < place.size(); ++p)
        if (const auto id = static_cast<std::size_t>(state.particles.id[p]); id < place.size())
            place[id] = static_cast<std::int64_t>(p);
    for (CarriedPoints* const points :
         {static_cast<CarriedPoints*>(&state.particles.surface), static_cast<CarriedPoints*>(&state.particles.loaded)})
        for (std::int64_t& particle : points->particle)
            particle = place[static_cast<std::size_t>(particle)];
    if (SurfacePoints& surface = state.particles.surface; surface.size() > 0) {
        fill_vector(surface.x, "surface/x");
        fill_vector(surface.y, "surface/y");
        for (std::size_t b = 0; b < surface.held.size(); ++b)
            if (!surface.held[b].empty())
                fill_vector(surface.held[b], fmt::format("surface/held_{}", b));
        for (std::size_t b = 0; b < surface.held_by_bodies.size(); ++b)
            fill_vector(surface.held_by_bodies[b], fmt::format("surface/held_by_body_{}", b));
    }
    if (LoadedSides& loaded = state.particles.loaded; loaded.size() > 0)
        for (const auto& [name, array] : {std::pair{"loaded/x", &loaded.x},
                                          {"loaded/y", &loaded.y},
                                          {"loaded/along_x", &loaded.along_x},
                                          {"loaded/along_y", &loaded.along_y}})
            fill_vector(*array, name);
    state.time = checkpoint.scalar("time");
    state.step = checkpoint.counter("step");
    if (!std::isfinite(state.time) || state.step < 0)
        throw InputError(fmt::format("{}: time {} s after {} steps is impossible: use another checkpoint",
                                     checkpoint.path().string(), state.time, state.step));
    try {
        check(scene, state.particles, state.rigid_bodies, state.time);
    } catch (const InputError& error) {
        throw InputError(fmt::format("{}: {}; use another checkpoint", checkpoint.path().string(), error.what()));
    }
    return state;
}

} // namespace ductile::mpm
