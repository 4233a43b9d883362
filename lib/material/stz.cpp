// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/material/make_law.hpp>
#include <ductile/material/stz.hpp>

#include <cmath>
#include <fmt/format.h>
#include <utility>

namespace ductile {

namespace {
constexpr double boltzmann = 1.3806488e-23; // J/K, the value of Table A.3
}

void check(const StzParameters& parameters) {
    const std::pair<const char*, double> values[] = {
        {"yield stress s_Y", parameters.yield_stress},
        {"molecular time tau_0", parameters.molecular_time},
        {"local strain epsilon_0", parameters.local_strain},
        {"effective heat capacity c_0", parameters.heat_capacity},
        {"activation barrier Delta/k_B", parameters.activation_barrier},
        {"activation volume zeta", parameters.activation_volume},
        {"bath temperature T", parameters.bath_temperature},
        {"steady-state effective temperature chi_inf", parameters.steady_temperature},
        {"formation temperature e_Z/k_B", parameters.formation_temperature}};
    for (const auto& [name, value] : values)
        if (!(value > 0.0 && std::isfinite(value)))
            throw InputError(fmt::format("STZ model: {} = {}: it must be positive and finite", name, value));
    if (!(parameters.corner_width >= 0.0 && std::isfinite(parameters.corner_width)))
        throw InputError(fmt::format("STZ model: width of the yield corner = {}: it must be zero or positive, and finite",
                                     parameters.corner_width));
}

StzModel::StzModel(const StzParameters& parameters, const Units& units)
    : yield_stress_(parameters.yield_stress / units.stress), corner_width_(parameters.corner_width),
      activation_(parameters.activation_volume * parameters.local_strain * units.stress /
                  (boltzmann * parameters.bath_temperature)),
      log_half_attempt_rate_(std::log(0.5 * units.time / parameters.molecular_time) -
                             parameters.activation_barrier / parameters.bath_temperature),
      formation_(parameters.formation_temperature / units.temperature),
      steady_(parameters.steady_temperature / units.temperature), heating_(2.0 / (parameters.heat_capacity * yield_stress_)),
      backward_jumps_(corner_width_ > 0.0 || std::exp(-2.0 * activation_ * yield_stress_) >= 1e-11),
      variable_{.name = "effective_temperature",
                .unit = "K",
                .start = 640.0,
                .scale = parameters.steady_temperature,
                .lower = 1.0,
                .upper = parameters.formation_temperature,
                .natural_unit = units.temperature} {
    check(parameters);
}

Law stz_law(const IsotropicElasticity& elasticity, const StzParameters& parameters, const Units& units) {
    return make_law(elasticity, StzModel(parameters, units));
}

} // namespace ductile
