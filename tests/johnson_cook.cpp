// SPDX-License-Identifier: GPL-3.0-or-later
// Johnson and Cook's flow stress: return mapping, its derivative, and the rate equations that it comes to.
#include "messages.hpp"

#include <ductile/material/finite_strain.hpp>
#include <ductile/material/johnson_cook.hpp>
#include <ductile/scene/materials.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace johnson_cook_suite {

using namespace ductile;

namespace {

const IsotropicElasticity elasticity = elasticity_from_young(206.9e9, 0.3);
/// Steel 42CrMo4.
constexpr JohnsonCookParameters steel{.yield_stress = 806e6,
                                      .hardening = 614e6,
                                      .hardening_exponent = 0.168,
                                      .rate_coefficient = 0.0089,
                                      .reference_rate = 1.0,
                                      .thermal_exponent = 1.1,
                                      .reference_temperature = 293.15,
                                      .melting_temperature = 1813.15,
                                      .temperature_by_plastic_work = 0.9 / (7830.0 * 460.0)};

double flow_stress(double p, double rate, double temperature) {
    const double hot = (temperature - 293.15) / 1520.0;
    return (806e6 + 614e6 * std::pow(p, 0.168)) * (1.0 + 0.0089 * std::log(std::max(rate, 1.0))) * (1.0 - std::pow(hot, 1.1));
}

double equivalent(const SymmetricTensor& stress) {
    const SymmetricTensor s = deviator(stress);
    return std::sqrt(1.5 * contraction(s, s));
}

/// Pure shear at a rate of equivalent strain: stress, p and T at the end, by the rate equations with the classical Runge-Kutta
/// scheme. Where it flows, dp/dt = exp((q/Y(p, 1, T) - 1)/C).
std::array<double, 3> integrate(double rate, double time, int steps) {
    using Values = std::array<double, 3>;
    const double stiffness = 3.0 * elasticity.shear_modulus;
    const auto slope = [&](const Values& y) {
        const double overstress = y[0] / flow_stress(std::max(y[1], 0.0), 1.0, y[2]) - 1.0;
        const double flow = overstress > 0.0 ? std::exp(overstress / 0.0089) : 0.0;
        return Values{stiffness * (rate - flow), flow, steel.temperature_by_plastic_work * y[0] * flow};
    };
    Values y{0.0, 0.0, 293.15};
    const double dt = time / steps;
    for (int n = 0; n < steps; ++n) {
        const auto at = [&](const Values& k, double part) {
            Values z = y;
            for (std::size_t i = 0; i < 3; ++i)
                z[i] += part * dt * k[i];
            return slope(z);
        };
        const Values a = slope(y), b = at(a, 0.5), c = at(b, 0.5), d = at(c, 1.0);
        for (std::size_t i = 0; i < 3; ++i)
            y[i] += dt / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
    }
    return y;
}

} // namespace

TEST_SUITE_BEGIN("johnson_cook");

TEST_CASE("a step ends on the flow stress of its strain, rate and temperature, or stays elastic") {
    const JohnsonCook law(elasticity, steel);
    for (const double p : {0.0, 1e-6, 0.03, 1.5})
        for (const double temperature : {293.15, 250.0, 600.0, 1700.0})
            for (const double dt : {1e-9, 1e-5, 1.0, 1e4})
                for (const double strain : {1e-4, 3e-3, 0.05, 0.5}) {
                    CAPTURE(p);
                    CAPTURE(temperature);
                    CAPTURE(dt);
                    CAPTURE(strain);
                    const double yield = flow_stress(p, 0.0, std::max(temperature, 293.15));
                    const SymmetricTensor trial = elastic_stress(elasticity, {0.3 * strain, -strain, 0.5 * strain, 0.7 * strain});
                    const StressReturn<2> end = law.correct(trial, {p, temperature}, dt);
                    CHECK(law.yield_stress({p, temperature}) == doctest::Approx(yield).epsilon(1e-12));
                    if (equivalent(trial) <= yield) {
                        CHECK(end.stress.xx == trial.xx);
                        CHECK(end.internal[0] == p);
                        continue;
                    }
                    const double d = end.internal[0] - p, q = equivalent(end.stress);
                    CHECK(d > 0.0);
                    CHECK(end.internal[1] - temperature ==
                          doctest::Approx(steel.temperature_by_plastic_work * q * d).epsilon(1e-9));
                    const double hot = std::clamp(end.internal[1], 293.15, 1813.15);
                    CHECK(std::abs(q - flow_stress(end.internal[0], d / dt, hot)) < 1e-9 * equivalent(trial));
                    CHECK(q == doctest::Approx(equivalent(trial) - 3.0 * elasticity.shear_modulus * d).epsilon(1e-9));
                    CHECK(trace(end.stress) == doctest::Approx(trace(trial)));
                }
}

TEST_CASE("steps converge to the rate equations, first order in their length, from slow shear to an impact's") {
    const JohnsonCook law(elasticity, steel);
    for (const double rate : {100.0, 1e5}) {
        CAPTURE(rate);
        const double strain = 0.3, time = strain / rate;
        const auto exact = integrate(rate, time, 400000);
        CHECK(exact[2] > 350.0); // it becomes hot
        double last = 0.0;
        for (const int steps : {40, 80, 160}) {
            SymmetricTensor stress{};
            std::array<double, 2> internal{0.0, 293.15};
            // of pure shear the equivalent strain is 2/sqrt(3) of the shear strain
            const SymmetricTensor part{0.0, 0.0, 0.0, std::sqrt(0.75) * strain / steps};
            for (int n = 0; n < steps; ++n) {
                const StressReturn<2> end = law.correct(stress + elastic_stress(elasticity, part), internal, time / steps);
                stress = end.stress;
                internal = end.internal;
            }
            const double error = std::max(std::abs(equivalent(stress) / exact[0] - 1.0), std::abs(internal[0] / exact[1] - 1.0)) +
                                 std::abs(internal[1] - exact[2]) / 100.0;
            CAPTURE(steps);
            CAPTURE(error);
            CHECK(error < 0.5 / steps);
            if (last > 0.0)
                CHECK(error < 0.6 * last);
            last = error;
        }
    }
}

TEST_CASE("the tangent is the derivative of the returned stress") {
    const JohnsonCook law(elasticity, steel);
    std::mt19937 engine(5);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (const double dt : {1e-8, 1e-5, 1.0})
        for (const std::array<double, 2>& internal : {std::array{0.0, 293.15}, {0.05, 400.0}, {0.8, 900.0}})
            for (const double scale : {1e-3, 2e-2}) {
                const auto random = [&] {
                    return SymmetricTensor{uniform(engine), uniform(engine), uniform(engine), uniform(engine)};
                };
                const SymmetricTensor strain = scale * random(), way = random();
                const Tangent t = law.tangent(elastic_stress(elasticity, strain), internal, dt);
                const double h = 1e-7 * scale;
                const auto stress = [&](double part) {
                    return law.correct(elastic_stress(elasticity, strain + part * way), internal, dt).stress;
                };
                const SymmetricTensor change = (0.5 / h) * (stress(h) - stress(-h));
                const double along[4] = {way.xx, way.yy, way.zz, 2.0 * way.xy},
                             found[4] = {change.xx, change.yy, change.zz, change.xy};
                for (int i = 0; i < 4; ++i) {
                    double expected = 0.0;
                    for (int j = 0; j < 4; ++j)
                        expected += t.entry[i][j] * along[j];
                    CHECK(std::abs(found[i] - expected) < 1e-5 * elasticity.alpha());
                }
            }
}

TEST_CASE("a material's heat: its part of the plastic work over density and heat capacity, in the law and out of it") {
    MaterialData material{.law = LawChoice::johnson_cook,
                          .young_modulus = 206.9e9,
                          .poisson_ratio = 0.3,
                          .density = 7830.0,
                          .heat_capacity = 460.0,
                          .yield_stress = 806e6,
                          .johnson_cook = {.melting_temperature = 1813.15}};
    for (const double fraction : {0.0, 0.5, 1.0}) {
        material.heat_fraction = fraction;
        CHECK(effective_heat_capacity(material) == (fraction > 0.0 ? 460.0 / fraction : 0.0));
        const Law law = make_law(material);
        const Deformation f{.xx = 0.05, .yy = -0.05 / 1.05};
        std::array<double, 6> values{0.0, 293.15, 0.0, 0.0, 0.0, 0.0};
        double* internal[6];
        for (std::size_t k = 0; k < 6; ++k)
            internal[k] = &values[k];
        SymmetricTensor stress;
        StepWork work;
        law->finite_strain()->correct(1, &f, internal, 1.0, &stress, internal, &work);
        const double heat = fraction * equivalent(stress) * values[0] / (7830.0 * 460.0); // the volume stays
        CHECK(values[0] > 0.03);
        CHECK(values[1] - 293.15 == doctest::Approx(heat).epsilon(1e-9));
    }
}

TEST_CASE("impossible parameters are refused by name") {
    const auto message = [](auto change) {
        JohnsonCookParameters parameters = steel;
        change(parameters);
        return message_of<InputError>([&] { (void)JohnsonCook(elasticity, parameters); });
    };
    CHECK(contains(message([](auto& p) { p.yield_stress = 0.0; }), "yield stress = 0"));
    CHECK(contains(message([](auto& p) { p.hardening = -1.0; }), "hardening = -1"));
    CHECK(contains(message([](auto& p) { p.hardening_exponent = 0.0; }), "hardening exponent = 0"));
    CHECK(contains(message([](auto& p) { p.rate_coefficient = -0.1; }), "rate coefficient = -0.1"));
    CHECK(contains(message([](auto& p) { p.reference_rate = 0.0; }), "reference rate = 0"));
    CHECK(contains(message([](auto& p) { p.thermal_exponent = 0.0; }), "thermal exponent = 0"));
    CHECK(contains(message([](auto& p) { p.reference_temperature = 0.0; }), "reference temperature = 0"));
    CHECK(contains(message([](auto& p) { p.melting_temperature = 200.0; }), "above the reference temperature"));
    CHECK(contains(message([](auto& p) { p.temperature_by_plastic_work = -1.0; }), "temperature by plastic work = -1"));
}

TEST_SUITE_END();

} // namespace johnson_cook_suite
