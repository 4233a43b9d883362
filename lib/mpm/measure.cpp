// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/nearest_name.hpp>
#include <ductile/mpm/measure.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <utility>

namespace ductile::mpm {

namespace {

using Array = aligned_vector<double> Particles::*;
constexpr std::pair<const char*, Array> particle_quantities[] = {
    {"position-x", &Particles::x},          {"position-y", &Particles::y},
    {"velocity-x", &Particles::velocity_x}, {"velocity-y", &Particles::velocity_y},
    {"stress-xx", &Particles::stress_xx},   {"stress-yy", &Particles::stress_yy},
    {"stress-zz", &Particles::stress_zz},   {"stress-xy", &Particles::stress_xy},
    {"density", &Particles::density},       {"temperature-rise", &Particles::temperature}};

/// Of the particles of a body, or of all for -1.
double taken(Setup::Take take, const aligned_vector<double>& values, const aligned_vector<std::int64_t>& body,
             std::int64_t which) {
    double sum = 0.0, count = 0.0, smallest = std::numeric_limits<double>::infinity(), largest = -smallest;
    for (std::size_t p = 0; p < values.size(); ++p) {
        if (which >= 0 && body[p] != which)
            continue;
        sum += values[p];
        count += 1.0;
        smallest = std::min(smallest, values[p]);
        largest = std::max(largest, values[p]);
    }
    const double results[] = {sum / count, smallest, largest, sum};
    return results[static_cast<int>(take)];
}

/// The place of a name; `standard` for none. Throws InputError for an unknown one.
template <class T>
std::size_t place_of(const Setup::Measure& measure, const std::vector<T>& values, const char* what, std::size_t standard) {
    if (measure.of.empty() && (standard > 0 || !values.empty()))
        return standard;
    std::vector<std::string> names;
    for (const T& value : values)
        names.push_back(value.name);
    const auto found = std::ranges::find(names, measure.of);
    if (found == names.end())
        throw InputError(fmt::format("the observable '{}' is of the {} '{}', which the scene does not have{}", measure.name, what,
                                     measure.of, io::did_you_mean(measure.of, names)));
    return static_cast<std::size_t>(found - names.begin());
}

std::function<double(const Observation&)> quantity_of(const Setup::Measure& measure, const Setup& setup) {
    if (measure.quantity == "time")
        return [](const Observation& seen) { return seen.state.time; };
    const bool x = measure.quantity.ends_with("-x");
    if (measure.quantity.starts_with("force-") || measure.quantity.starts_with("displacement-")) {
        const std::size_t b = place_of(measure, setup.rigid_bodies, "rigid body", 0);
        if (measure.quantity.starts_with("force-"))
            return [b, x](const Observation& seen) { return seen.contact_forces[b][x ? 0 : 1]; };
        return [b, x](const Observation& seen) {
            const Velocity way = seen.state.rigid_bodies[b].velocity.displacement(seen.state.time);
            return x ? way.u : way.v;
        };
    }
    constexpr auto all = std::numeric_limits<std::size_t>::max();
    const std::size_t body = place_of(measure, setup.bodies, "body", all);
    const auto which = body == all ? std::int64_t{-1} : static_cast<std::int64_t>(body);
    for (const auto& [name, array] : particle_quantities)
        if (measure.quantity == name)
            return [array = array, take = measure.take, which](const Observation& seen) {
                return taken(take, seen.state.particles.*array, seen.state.particles.body, which);
            };
    if (measure.quantity == "internal")
        return [take = measure.take, which](const Observation& seen) {
            const Particles& p = seen.state.particles;
            return p.internal.empty() ? std::nan("") : taken(take, p.internal.front(), p.body, which);
        };
    throw InputError(fmt::format("the observable '{}' is of '{}', which there is not{}", measure.name, measure.quantity,
                                 io::did_you_mean(measure.quantity, quantities())));
}

} // namespace

std::vector<std::string> quantities() {
    std::vector<std::string> names = {"time", "force-x", "force-y", "displacement-x", "displacement-y", "internal"};
    for (const auto& [name, array] : particle_quantities)
        names.emplace_back(name);
    return names;
}

Observable make_observable(const Setup::Measure& measure, const Setup& setup) {
    const auto value = [quantity = quantity_of(measure, setup), factor = measure.factor,
                        offset = measure.offset](const Observation& seen) { return factor * quantity(seen) + offset; };
    return {measure.name, value};
}

} // namespace ductile::mpm
