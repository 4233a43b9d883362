// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/material/finite_strain.hpp>
#include <ductile/material/johnson_cook.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace ductile {

JohnsonCook::JohnsonCook(const IsotropicElasticity& elasticity, const JohnsonCookParameters& parameters)
    : elasticity_(elasticity), parameters_(parameters) {
    check(elasticity);
    const auto require = [](bool holds, const char* name, double value, const char* rule) {
        if (!holds)
            throw InputError(fmt::format("Johnson and Cook's plasticity: {} = {}: it must be {}", name, value, rule));
    };
    const auto positive = [&](const char* name, double value) {
        require(value > 0.0 && std::isfinite(value), name, value, "positive and finite");
    };
    const auto not_negative = [&](const char* name, double value) {
        require(value >= 0.0 && std::isfinite(value), name, value, "zero or positive, and finite");
    };
    positive("yield stress", parameters.yield_stress);
    not_negative("hardening", parameters.hardening);
    positive("hardening exponent", parameters.hardening_exponent);
    not_negative("rate coefficient", parameters.rate_coefficient);
    positive("reference rate", parameters.reference_rate);
    positive("thermal exponent", parameters.thermal_exponent);
    positive("reference temperature", parameters.reference_temperature);
    require(parameters.melting_temperature > parameters.reference_temperature, "melting temperature",
            parameters.melting_temperature, "above the reference temperature");
    not_negative("temperature by plastic work", parameters.temperature_by_plastic_work);
}

std::array<InternalVariable, 2> JohnsonCook::variables() const {
    return {plastic_strain_variable, InternalVariable{.name = "temperature",
                                                      .unit = "K",
                                                      .start = parameters_.reference_temperature,
                                                      .scale = 10.0,
                                                      .lower = 1.0,
                                                      .upper = 1e4}};
}

auto JohnsonCook::flow_stress(double plastic_strain, double rate, double temperature) const -> FlowStress {
    const JohnsonCookParameters& c = parameters_;
    const double p = std::max(plastic_strain, 0.0);
    const double power = std::pow(p, c.hardening_exponent);
    const double hard = c.yield_stress + c.hardening * power;
    const double hardens = p > 0.0 ? c.hardening * c.hardening_exponent * power / p : 0.0;
    const bool fast = rate > c.reference_rate;
    const double viscous = fast ? 1.0 + c.rate_coefficient * std::log(rate / c.reference_rate) : 1.0;
    const double range = c.melting_temperature - c.reference_temperature;
    const double hot = std::clamp((temperature - c.reference_temperature) / range, 0.0, 1.0);
    const double softened = std::pow(hot, c.thermal_exponent);
    const double softens = hot > 0.0 && hot < 1.0 ? c.thermal_exponent * softened / (hot * range) : 0.0;
    return {.value = hard * viscous * (1.0 - softened),
            .by_strain = hardens * viscous * (1.0 - softened),
            .by_rate = fast ? hard * c.rate_coefficient / rate * (1.0 - softened) : 0.0,
            .by_temperature = -hard * viscous * softens};
}

auto JohnsonCook::increment(double q, const std::array<double, 2>& internal, double dt) const -> Increment {
    const double stiffness = 3.0 * elasticity_.shear_modulus, heat = parameters_.temperature_by_plastic_work;
    double low = 0.0, high = q / stiffness;
    double d = std::min((q - yield_stress(internal)) / stiffness, high);
    FlowStress y{};
    double slope = 0.0; // minus that of g
    for (int iteration = 0; iteration < 200; ++iteration) {
        const double left = q - stiffness * d;
        y = flow_stress(internal[0] + d, d / dt, internal[1] + heat * left * d);
        slope = stiffness + y.by_strain + y.by_rate / dt + heat * (left - stiffness * d) * y.by_temperature;
        const double excess = left - y.value;
        (excess > 0.0 ? low : high) = d;
        double next = d + excess / slope;
        if (!(next > low && next < high)) // by halves
            next = 0.5 * (low + high);
        const double change = next - d;
        d = next;
        if (!(std::abs(change) > 1e-15 * q / stiffness)) // what is no number ends here, too, and is found out by whoever steps
            break;
    }
    return {d, (1.0 - heat * d * y.by_temperature) / slope};
}

StressReturn<2> JohnsonCook::correct(const SymmetricTensor& trial, const std::array<double, 2>& internal, double dt) const {
    const SymmetricTensor s = deviator(trial);
    const double q = std::sqrt(1.5 * contraction(s, s));
    if (q <= yield_stress(internal))
        return {trial, internal};
    const double d = increment(q, internal, dt).value, lost = 3.0 * elasticity_.shear_modulus * d;
    return {trial - (lost / q) * s, {internal[0] + d, internal[1] + parameters_.temperature_by_plastic_work * (q - lost) * d}};
}

Tangent JohnsonCook::tangent(const SymmetricTensor& trial, const std::array<double, 2>& internal, double dt) const {
    const double mu = elasticity_.shear_modulus;
    const SymmetricTensor s = deviator(trial);
    const double q = std::sqrt(1.5 * contraction(s, s));
    if (q <= yield_stress(internal))
        return isotropic_tangent(elasticity_.bulk_modulus, mu);
    const Increment step = increment(q, internal, dt);
    const double lost = 3.0 * mu * step.value / q;
    Tangent t = isotropic_tangent(elasticity_.bulk_modulus, mu * (1.0 - lost));
    const double direct = 2.0 * mu * (3.0 * mu * step.by_trial - lost) * 1.5 / (q * q); // n(x)n = 1.5 s(x)s/q^2
    const double n[4] = {s.xx, s.yy, s.zz, s.xy};
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
            t.entry[i][j] -= direct * n[i] * n[j];
    return t;
}

Law johnson_cook_law(const IsotropicElasticity& elasticity, const JohnsonCookParameters& parameters) {
    return make_finite_law(Hencky(JohnsonCook(elasticity, parameters)));
}

} // namespace ductile
