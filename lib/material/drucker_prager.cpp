// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/material/drucker_prager.hpp>
#include <ductile/material/make_law.hpp>

#include <cmath>
#include <fmt/format.h>

namespace ductile {

DruckerPrager::DruckerPrager(const IsotropicElasticity& elasticity, const DruckerPragerParameters& p)
    : elasticity_(elasticity), parameters_(p) {
    check(elasticity);
    const auto fail = [](const char* name, double value, const char* rule) {
        throw InputError(fmt::format("Drucker-Prager plasticity: {} = {}: it must be {}", name, value, rule));
    };
    if (!(p.cohesion > 0.0 && std::isfinite(p.cohesion)))
        fail("cohesion", p.cohesion, "positive and finite");
    if (!(p.friction > 0.0 && std::isfinite(p.friction)))
        fail("friction", p.friction, "positive and finite");
    if (!(p.dilatancy >= 0.0 && p.dilatancy <= p.friction))
        fail("dilatancy", p.dilatancy, "between zero and the friction");
    if (!(p.hardening >= 0.0 && std::isfinite(p.hardening)))
        fail("hardening", p.hardening, "zero or positive, and finite");
}

DruckerPrager::Multiplier DruckerPrager::multiplier(const SymmetricTensor& trial, double internal) const {
    const auto& [cohesion, friction, dilatancy, hardening] = parameters_;
    const double mean = trace(trial) / 3.0;
    const SymmetricTensor s = deviator(trial);
    const double q = std::sqrt(1.5 * contraction(s, s));
    const double excess = q + friction * mean - cohesion - hardening * internal;
    const double stiffness = 3.0 * elasticity_.shear_modulus + elasticity_.bulk_modulus * friction * dilatancy + hardening;
    return {q, mean, excess, excess / stiffness, s};
}

StressReturn<1> DruckerPrager::correct(const SymmetricTensor& trial, const std::array<double, 1>& start, double) const {
    const double internal = start[0];
    const Multiplier d = multiplier(trial, internal);
    if (d.excess <= 0.0)
        return {trial, start};
    const auto& [cohesion, friction, dilatancy, hardening] = parameters_;
    const double bulk = elasticity_.bulk_modulus, lost = 3.0 * elasticity_.shear_modulus * d.increment;
    if (lost < d.q) {
        const double mean = bulk * dilatancy * d.increment;
        return {trial - (lost / d.q) * d.deviator - SymmetricTensor{mean, mean, mean, 0.0}, {internal + d.increment}};
    }
    const double volume = (friction * d.mean - cohesion - hardening * internal) / (bulk * friction + apex_hardening());
    const double mean = d.mean - bulk * volume;
    return {{mean, mean, mean, 0.0}, {dilatancy > 0.0 ? internal + volume / dilatancy : internal}};
}

Tangent DruckerPrager::tangent(const SymmetricTensor& trial, const std::array<double, 1>& internal, double) const {
    const double bulk = elasticity_.bulk_modulus, mu = elasticity_.shear_modulus;
    const Multiplier d = multiplier(trial, internal[0]);
    if (d.excess <= 0.0)
        return isotropic_tangent(bulk, mu);
    const double lost = 3.0 * mu * d.increment / d.q;
    if (!(lost < 1.0))
        return isotropic_tangent(bulk * apex_hardening() / (bulk * parameters_.friction + apex_hardening()), 0.0);

    // d(increment)/d(strain) = (sqrt(6) mu n + K friction I)/stiffness with n = s/|s| = sqrt(3/2) s/q
    const double stiffness = d.excess / d.increment;
    const double slope = std::sqrt(1.5) / d.q;
    const double n[4] = {slope * d.deviator.xx, slope * d.deviator.yy, slope * d.deviator.zz, slope * d.deviator.xy};
    const double identity[4] = {1.0, 1.0, 1.0, 0.0};
    const double shear = std::sqrt(6.0) * mu;
    Tangent t = isotropic_tangent(bulk, mu * (1.0 - lost));
    for (int j = 0; j < 4; ++j) {
        const double increment = (shear * n[j] + bulk * parameters_.friction * identity[j]) / stiffness;
        const double turn = shear * (increment - d.increment / d.q * shear * n[j]);
        for (int i = 0; i < 4; ++i)
            t.entry[i][j] -= n[i] * turn + bulk * parameters_.dilatancy * identity[i] * increment;
    }
    return t;
}

Law drucker_prager_law(const IsotropicElasticity& elasticity, const DruckerPragerParameters& parameters) {
    return make_law(DruckerPrager(elasticity, parameters));
}

} // namespace ductile
