// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/material/make_law.hpp>
#include <ductile/material/perzyna.hpp>

#include <cmath>
#include <fmt/format.h>

namespace ductile {

void check(const PerzynaParameters& parameters) {
    const auto fail = [](const char* name, double value, const char* rule) {
        throw InputError(fmt::format("Perzyna model: {} = {}: it must be {}", name, value, rule));
    };
    if (!(parameters.yield_stress > 0.0 && std::isfinite(parameters.yield_stress)))
        fail("yield stress", parameters.yield_stress, "positive and finite");
    if (!(parameters.hardening_modulus >= 0.0 && std::isfinite(parameters.hardening_modulus)))
        fail("hardening modulus", parameters.hardening_modulus, "zero or positive, and finite");
    if (!(parameters.reference_rate > 0.0 && std::isfinite(parameters.reference_rate)))
        fail("reference rate", parameters.reference_rate, "positive and finite");
    if (parameters.overstress_exponent < 1 || parameters.overstress_exponent > 100)
        fail("overstress exponent", parameters.overstress_exponent, "a whole number from 1 to 100");
}

PerzynaModel::PerzynaModel(const PerzynaParameters& parameters, const Units& units)
    : yield_stress_(parameters.yield_stress / units.stress), hardening_(parameters.hardening_modulus / units.stress),
      reference_rate_(parameters.reference_rate * units.time), exponent_(parameters.overstress_exponent) {
    check(parameters);
}

Law perzyna_law(const IsotropicElasticity& elasticity, const PerzynaParameters& parameters, const Units& units) {
    return make_law(elasticity, PerzynaModel(parameters, units));
}

} // namespace ductile
