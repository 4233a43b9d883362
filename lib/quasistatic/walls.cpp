// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/material/point_rates.hpp>
#include <ductile/quasistatic/scene.hpp>

#include <charconv>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <numbers>
#include <string>
#include <vector>

namespace ductile::quasistatic {

namespace {

/// Knots of numbers separated by colons, at most three, as many as they have.
std::vector<std::vector<double>> parse_knots(std::string_view text, const auto& fail) {
    std::vector<std::vector<double>> knots;
    std::string_view rest = text;
    for (bool more = !text.empty(); more;) { // a knot follows every comma
        const auto comma = rest.find(',');
        const std::string_view part = rest.substr(0, comma);
        more = comma != std::string_view::npos;
        if (more)
            rest.remove_prefix(comma + 1);
        std::vector<double>& values = knots.emplace_back();
        const char* cursor = part.data();
        const char* const end = part.data() + part.size();
        while (values.size() < 3) {
            double value = 0.0;
            const auto [stop, status] = std::from_chars(cursor, end, value);
            if (status != std::errc{})
                throw fail(part);
            values.push_back(value);
            cursor = stop;
            if (cursor == end || *cursor != ':')
                break;
            ++cursor;
        }
        if (cursor != end)
            throw fail(part);
    }
    return knots;
}

} // namespace

WallHistory parse_wall_history(std::string_view text) {
    const auto fail = [&](std::string_view part) {
        return InputError(
            fmt::format("--wall-history: cannot read '{}' in '{}': give knots time:u or time:u:v in s and m/s, separated "
                        "by commas, e.g. 0:5e-4,0.7:5e-4,0.7:-5e-4",
                        part, text));
    };
    std::vector<WallKnot> knots;
    for (const std::vector<double>& values : parse_knots(text, fail)) {
        if (values.size() < 2)
            throw fail(fmt::format("{:g}", values[0]));
        knots.push_back({values[0], {values[1], values.size() > 2 ? values[2] : 0.0}});
    }
    try {
        return WallHistory(std::move(knots));
    } catch (const InputError& error) {
        throw InputError(fmt::format("--wall-history: {}", error.what()));
    }
}

History<double> parse_traction_history(std::string_view option, std::string_view text) {
    const auto fail = [&](std::string_view part) {
        return InputError(
            fmt::format("{}: cannot read '{}' in '{}': give one traction in Pa, or knots time:traction in s and Pa, "
                        "separated by commas, e.g. 0:0,0.01:4e8",
                        option, part, text));
    };
    const std::vector<std::vector<double>> rows = parse_knots(text, fail);
    std::vector<History<double>::Knot> knots;
    for (const std::vector<double>& values : rows) {
        if (values.size() != 2 && !(values.size() == 1 && rows.size() == 1))
            throw fail(fmt::format("{}", fmt::join(values, ":")));
        knots.push_back(values.size() == 2 ? History<double>::Knot{values[0], values[1]} : History<double>::Knot{0.0, values[0]});
    }
    for (std::size_t k = 1; k < knots.size(); ++k)
        if (knots[k].time == knots[k - 1].time && knots[k].value != knots[k - 1].value)
            throw InputError(fmt::format("{}: the traction jumps at t = {:g} s: only the first load may be sudden; ramp it, from "
                                         "{:g}:{:g} to a little later",
                                         option, knots[k].time, knots[k - 1].time, knots[k - 1].value));
    try {
        return History<double>(std::move(knots));
    } catch (const InputError& error) {
        throw InputError(fmt::format("{}: {}", option, error.what()));
    }
}

WallVelocity wall_velocity_between(const Scene& scene, const MeanTraction& mean, const MeanTraction& wanted, double dt) {
    const IsotropicElasticity& c = scene.law->elasticity();
    const auto velocity = [&](const WallControl& control, double change, double modulus) {
        return control.by == WallControl::By::traction ? 0.5 * scene.grid.height * change / (modulus * dt) : 0.0;
    };
    return {velocity(scene.walls.shear, wanted.shear - mean.shear, c.shear_modulus),
            velocity(scene.walls.opening, wanted.normal - mean.normal, c.alpha())};
}

WallVelocity wall_velocity(const Scene& scene, const WallRates& told, const MeanTraction& open_rate) {
    WallVelocity velocity{told.shear, told.opening};
    if (!scene.walls.by_traction())
        return velocity;
    const WallVelocity forced = wall_velocity_between(scene, open_rate, {told.shear, told.opening}, 1.0);
    if (scene.walls.shear.by == WallControl::By::traction)
        velocity.u = forced.u;
    if (scene.walls.opening.by == WallControl::By::traction)
        velocity.v = forced.v;
    return velocity;
}

MeanTraction wanted_traction(const Scene& scene, double time) {
    return {scene.walls.shear.history.after(time), scene.walls.opening.history.after(time)};
}

void move_walls(const Scene& scene, const Velocity& motion, CellState& cells) {
    if (motion == Velocity{})
        return;
    const double half_height = 0.5 * scene.grid.height;
    add_uniform(
        elastic_rate(scene.law->elasticity(), VelocityGradient<double>{0.0, motion.u / half_height, 0.0, motion.v / half_height}),
        cells.stress);
    cells.wall = cells.wall + motion;
}

void bring_to_load(const Scene& scene, Space& space, double time, CellState& cells) {
    if (!scene.walls.by_traction())
        return;
    const Velocity motion = wall_velocity_between(scene, space.mean_traction(cells.stress), wanted_traction(scene, time), 1.0);
    const double before = space.wall_power(cells.stress, motion);
    move_walls(scene, motion, cells);
    cells.energy.work += 0.5 * (before + space.wall_power(cells.stress, motion));
}

double largest_norm(const Scene& scene, Space& space, std::span<const Space::Term> terms) {
    const double norm = space.norm(terms).largest();
    if (!scene.walls.by_traction())
        return norm;
    Velocity motion;
    for (const Space::Term& term : terms)
        motion = motion + term.factor * term.vector->wall;
    const auto strain = [&](const WallControl& control, double component) {
        return control.by == WallControl::By::traction ? component / (0.5 * scene.grid.height) : 0.0;
    };
    const IsotropicElasticity& c = scene.law->elasticity();
    return std::max(norm, std::hypot(std::numbers::sqrt2 * c.shear_modulus * strain(scene.walls.shear, motion.u),
                                     c.alpha() * strain(scene.walls.opening, motion.v)));
}

} // namespace ductile::quasistatic
