// SPDX-License-Identifier: GPL-3.0-or-later
#include "messages.hpp"
#include <ductile/material/elasticity.hpp>
#include <ductile/material/perzyna.hpp>
#include <ductile/material/stz.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <doctest/doctest.h>
#include <limits>
#include <string>
#include <vector>

namespace material_suite {

using namespace ductile;

namespace {

/// Plastic rates of one point in SI: D^pl in 1/s and the rate of the internal variable in its unit per second.
struct Rates {
    double flow = 0.0, internal = 0.0;
};

/// (A.1)-(A.3) and (21) as printed, in SI. D^pl : sigma_0 is summed over a 3 x 3 stress of the given magnitude.
Rates textbook_stz(const StzParameters& m, double sbar, double chi) {
    if (sbar < m.yield_stress)
        return {};
    const double k_B = 1.3806488e-23; // Table A.3
    const double density = std::exp(-m.formation_temperature / chi);
    const double transition = std::exp(-m.activation_barrier / m.bath_temperature) *
                              std::cosh(m.activation_volume * m.local_strain * sbar / (k_B * m.bath_temperature));
    const double flow = density * transition / m.molecular_time * (1.0 - m.yield_stress / sbar);

    // any deviatoric stress in the form of Eq. (1) with s^2 + tau^2 + 3 q^2 = sbar^2
    const double s = 0.48 * sbar, q = 0.2 * sbar, tau = std::sqrt(sbar * sbar - s * s - 3.0 * q * q);
    const double stress[3][3] = {{s - q, tau, 0.0}, {tau, -s - q, 0.0}, {0.0, 0.0, 2.0 * q}};
    double dissipation = 0.0; // D^pl : sigma_0 with D^pl of Eq. (20)
    for (const auto& row : stress)
        for (const double component : row)
            dissipation += component / sbar * flow * component;
    return {flow, dissipation * (m.steady_temperature - chi) / (m.yield_stress * m.heat_capacity)};
}

Rates textbook_perzyna(const PerzynaParameters& m, double sbar, double kappa) {
    const double yield = m.yield_stress + m.hardening_modulus * kappa;
    const double flow = sbar < yield ? 0.0 : m.reference_rate * std::pow(sbar / yield - 1.0, m.overstress_exponent);
    return {flow, flow};
}

/// The library's rates in SI, from one double and from every lane of a batch, which must agree.
template <class M> Rates rates_in_si(const M& model, const Units& units, double unit_of_internal, double sbar, double internal) {
    const double stress = sbar / units.stress, value = internal / unit_of_internal;
    const PlasticRates<double, 1> one = model.rates(stress, std::array{value});
    for (int lane = 0; lane < pack_size; ++lane) {
        const Pack here = Pack::counting_from(-lane); // zero in this lane
        const auto spread = [&](double x) { return Pack(x) + Pack(0.01 * x) * magnitude(here); };
        const PlasticRates<Pack, 1> batch = model.rates(spread(stress), std::array{spread(value)});
        // compilers contract the two differently; just above yield 1 - Y/sbar is a difference of nearly equal numbers
        const double overstress = std::abs(1.0 - model.yield_stress(std::array{value}) / stress);
        const double relative = 1e-13 + 1e-15 / std::max(overstress, 1e-15);
        CHECK(std::abs(batch.fluidity[lane] - one.fluidity) <= relative * std::abs(one.fluidity));
        CHECK(std::abs(batch.internal[0][lane] - one.internal[0]) <= relative * std::abs(one.internal[0]));
        CHECK(model.yield_stress(std::array{Pack(value)})[lane] == model.yield_stress(std::array{value}));
    }
    return {one.fluidity * stress / units.time, one.internal[0] * unit_of_internal / units.time};
}

constexpr Units odd_units{.length = 0.37, .time = 2.9e-5, .stress = 1.3e9, .temperature = 777.0};

void compare_stz(const StzParameters& m, double bound) {
    for (const Units& units : {Units{}, odd_units}) {
        const StzModel model(m, units);
        CHECK(model.variables()[0].natural_scale() == m.steady_temperature / units.temperature);
        CHECK(model.yield_stress(std::array{0.03}) * units.stress == doctest::Approx(m.yield_stress).epsilon(1e-15));
        for (const double overstress : {1.0001, 1.02, 1.1, 1.4, 1.9})
            for (const double chi : {560.0, 640.0, 844.4, 899.0, 950.0}) { // beyond chi_inf it cools
                const double sbar = overstress * m.yield_stress;
                const Rates expected = textbook_stz(m, sbar, chi),
                            rates = rates_in_si(model, units, units.temperature, sbar, chi);
                CHECK(std::abs(rates.flow / expected.flow - 1.0) < bound);
                CHECK(std::abs(rates.internal / expected.internal - 1.0) < bound);
            }
    }
}

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();

} // namespace

TEST_SUITE("material") {
    TEST_CASE("STZ rates are (A.1)-(A.3) and (21)") { compare_stz(StzParameters{}, 1e-11); }

    TEST_CASE("STZ rates where jumps against the stress count") {
        // a zeta epsilon_0/(k_B T) sbar from 0.5 to 9: the backward half of the cosh is 40 % to 1e-8 of the forward one
        for (const double volume : {300e-30, 60e-30, 12e-30})
            for (const double temperature : {400.0, 700.0}) {
                StzParameters m;
                m.activation_volume = volume;
                m.bath_temperature = temperature;
                compare_stz(m, 1e-11);
            }
        // it must matter in this test: with the volume of Table A.3 divided by 25 the forward half alone is far off
        StzParameters m;
        m.activation_volume = 12e-30;
        const double x = m.activation_volume * m.local_strain * 0.9e9 / (1.3806488e-23 * m.bath_temperature);
        CHECK(std::cosh(x) / (0.5 * std::exp(x)) - 1.0 > 0.1);
    }

    TEST_CASE("STZ with other parameters, each of which enters") {
        StzParameters m{.yield_stress = 0.6e9,
                        .molecular_time = 3e-13,
                        .local_strain = 0.2,
                        .heat_capacity = 0.7,
                        .activation_barrier = 9000.0,
                        .activation_volume = 250e-30,
                        .bath_temperature = 350.0,
                        .steady_temperature = 870.0,
                        .formation_temperature = 19000.0};
        compare_stz(m, 1e-11);
    }

    TEST_CASE("no plastic flow below yield, hardly any at yield, some above") {
        const auto check_model = [](const auto& model) {
            for (const double sbar : {1e-150, 0.3, std::nextafter(1.0, 0.0)}) {
                CHECK(model.rates(sbar, std::array{0.03}).fluidity == 0.0);
                CHECK(model.rates(sbar, std::array{0.03}).internal[0] == 0.0);
                for (int lane = 0; lane < pack_size; ++lane) {
                    CHECK(model.rates(Pack(sbar), std::array{Pack(0.03)}).fluidity[lane] == 0.0);
                    CHECK(model.rates(Pack(sbar), std::array{Pack(0.03)}).internal[0][lane] == 0.0);
                }
            }
            const double typical = model.rates(1.5, std::array{0.03}).fluidity; // the flow starts continuously
            CHECK(std::abs(model.rates(1.0, std::array{0.03}).fluidity) < 1e-14 * typical);
            CHECK(model.rates(1.0 + 1e-9, std::array{0.03}).fluidity > 0.0);
            CHECK(model.rates(Pack(1.0 + 1e-9), std::array{Pack(0.03)}).fluidity[0] > 0.0);
        };
        check_model(StzModel{StzParameters{}, Units{}});
        check_model(PerzynaModel{PerzynaParameters{}, Units{}});
    }

    TEST_CASE("the smoothed yield corner: the sharp law far from it, flow below it, its slope a derivative") {
        const StzModel sharp{StzParameters{}, Units{}};
        const double w = 0.02;
        const StzModel smooth{StzParameters{.corner_width = w}, Units{}};
        CHECK(smooth.yield_stress(std::array{0.03}) == 0.0);
        for (const double chi : {0.031, 0.04}) {
            for (const double sbar : {0.1, 0.5, 0.99, 1.0, 1.01, 1.3, 2.0}) {
                // the textbook form, in long double against cancellation; the jumps against the stress count at low stress
                const long double x = 1.0L - 1.0L / sbar, factor = 0.5L * (x + std::sqrt(x * x + w * w));
                const long double above = 1.3L, sharp_factor = 1.0L - 1.0L / above,
                                  exponent = 300e-30L * 0.3L * 0.85e9L / (1.3806488e-23L * 400.0L);
                const long double flow = sharp.rates(1.3, std::array{chi}).fluidity * above / sharp_factor * factor *
                                         std::cosh(exponent * sbar) / std::cosh(exponent * above);
                const PlasticRates<double, 1> rates = smooth.rates(sbar, std::array{chi});
                CHECK(rates.fluidity * sbar == doctest::Approx(static_cast<double>(flow)).epsilon(1e-10).scale(0.0));
                CHECK(rates.fluidity > 0.0);
                for (int lane = 0; lane < pack_size; ++lane) {
                    CHECK(smooth.rates(Pack(sbar), std::array{Pack(chi)}).fluidity[lane] ==
                          doctest::Approx(rates.fluidity).epsilon(1e-12).scale(0.0));
                }
            }
            for (const double sbar : {0.9, 0.99, 1.0, 1.01, 1.2}) {
                const double d = 1e-5;
                const auto flow = [&](double stress) { return smooth.rates(stress, std::array{chi}).fluidity * stress; };
                const double slope = (flow(sbar + d) - flow(sbar - d)) / (2.0 * d);
                CHECK(smooth.flow_slope(sbar, std::array{chi}) == doctest::Approx(slope).epsilon(1e-5).scale(0.0));
            }
            CHECK(smooth.rates(1.5, std::array{chi}).fluidity / sharp.rates(1.5, std::array{chi}).fluidity - 1.0 <
                  3.0 * w * w); // w^2/(4 x^2)
            CHECK(smooth.rates(1e-150, std::array{chi}).fluidity ==
                  doctest::Approx(smooth.rates(1e-9, std::array{chi}).fluidity).epsilon(1e-6).scale(0.0));
        }
    }

    TEST_CASE("the slope of the flow is its derivative, for every law, and zero below yield") {
        const auto check_model = [](const auto& model, double internal) {
            CHECK(model.flow_slope(0.9, std::array{internal}) == 0.0);
            for (const double sbar : {1.3, 1.7, 2.5}) {
                const double d = 1e-6;
                const auto flow = [&](double stress) { return model.rates(stress, std::array{internal}).fluidity * stress; };
                const double slope = (flow(sbar + d) - flow(sbar - d)) / (2.0 * d);
                CHECK(model.flow_slope(sbar, std::array{internal}) == doctest::Approx(slope).epsilon(1e-7).scale(0.0));
                CHECK(model.flow_slope(Pack(sbar), std::array{Pack(internal)})[0] ==
                      doctest::Approx(slope).epsilon(1e-7).scale(0.0));
            }
        };
        check_model(StzModel{StzParameters{}, Units{}}, 0.031);
        for (const int exponent : {1, 2, 3, 7})
            check_model(PerzynaModel{PerzynaParameters{.hardening_modulus = 1e8, .overstress_exponent = exponent}, Units{}}, 0.5);
    }

    TEST_CASE("lanes below yield stay still beside lanes that flow") {
        const StzModel model{StzParameters{}, Units{}};
        const Pack numbers = Pack::counting_from(0.0);
        for (int lane = 0; lane < pack_size; ++lane) {
            const Pack sbar = select((numbers >= Pack(lane)) && (numbers < Pack(lane + 1.0)), Pack(1.3), Pack(0.99));
            const PlasticRates<Pack, 1> rates = model.rates(sbar, std::array{Pack(0.035)});
            for (int k = 0; k < pack_size; ++k) {
                CHECK((rates.fluidity[k] > 0.0) == (k == lane));
                CHECK((rates.internal[0][k] > 0.0) == (k == lane));
            }
        }
    }

    TEST_CASE("Perzyna rates with hardening and exponents") {
        for (const int exponent : {1, 2, 3, 7})
            for (const double hardening : {0.0, 2e9})
                for (const Units& units : {Units{}, odd_units}) {
                    const PerzynaParameters m{.yield_stress = 0.4e9,
                                              .hardening_modulus = hardening,
                                              .reference_rate = 0.3,
                                              .overstress_exponent = exponent};
                    const PerzynaModel model(m, units);
                    for (const double kappa : {0.0, 0.05, 0.4}) {
                        const double yield = m.yield_stress + hardening * kappa;
                        CHECK(model.yield_stress(std::array{kappa}) * units.stress == doctest::Approx(yield).epsilon(1e-14));
                        for (const double overstress : {0.2, 0.999, 1.01, 1.5, 3.0}) {
                            const Rates expected = textbook_perzyna(m, overstress * yield, kappa),
                                        rates = rates_in_si(model, units, 1.0, overstress * yield, kappa);
                            // the overstress is a difference: its error grows as 1/(overstress - 1)
                            CHECK(rates.flow == doctest::Approx(expected.flow).epsilon(1e-11).scale(1e-15));
                            CHECK(rates.internal == doctest::Approx(expected.internal).epsilon(1e-11).scale(1e-15));
                            CHECK((rates.flow > 0.0) == (overstress > 1.0));
                        }
                    }
                }
    }

    TEST_CASE("parameters that make no sense are named") {
        const auto check_stz = [](double StzParameters::*member, const char* name) {
            for (const double bad : {0.0, -1.0, not_a_number, infinity}) {
                StzParameters m;
                m.*member = bad;
                CHECK(contains(message_of<InputError>([&] { check(m); }), name));
                CHECK(contains(message_of<InputError>([&] { StzModel(m, Units{}); }), name));
            }
        };
        check_stz(&StzParameters::yield_stress, "s_Y");
        check_stz(&StzParameters::molecular_time, "tau_0");
        check_stz(&StzParameters::local_strain, "epsilon_0");
        check_stz(&StzParameters::heat_capacity, "c_0");
        check_stz(&StzParameters::activation_barrier, "Delta/k_B");
        check_stz(&StzParameters::activation_volume, "zeta");
        check_stz(&StzParameters::bath_temperature, "bath temperature T");
        check_stz(&StzParameters::steady_temperature, "chi_inf");
        check_stz(&StzParameters::formation_temperature, "e_Z/k_B");
        for (const double bad : {-0.1, not_a_number, infinity})
            CHECK(contains(message_of<InputError>([&] { check(StzParameters{.corner_width = bad}); }), "corner"));

        const auto check_perzyna = [](const PerzynaParameters& m, const char* name) {
            CHECK(contains(message_of<InputError>([&] { check(m); }), name));
            CHECK(contains(message_of<InputError>([&] { PerzynaModel(m, Units{}); }), name));
        };
        for (const double bad : {-1.0, not_a_number, infinity}) {
            check_perzyna({.yield_stress = bad}, "yield stress");
            check_perzyna({.hardening_modulus = bad}, "hardening modulus");
            check_perzyna({.reference_rate = bad}, "reference rate");
        }
        check_perzyna({.yield_stress = 0.0}, "yield stress");
        check_perzyna({.reference_rate = 0.0}, "reference rate");
        for (const int bad : {-1, 0, 101})
            check_perzyna({.overstress_exponent = bad}, "overstress exponent");
        CHECK_NOTHROW(check(PerzynaParameters{.hardening_modulus = 0.0, .overstress_exponent = 100}));

        for (const double bad : {0.0, -1.0, not_a_number, infinity}) {
            CHECK(contains(message_of<InputError>([&] { check(IsotropicElasticity{bad, 1.0}); }), "bulk modulus"));
            CHECK(contains(message_of<InputError>([&] { check(IsotropicElasticity{1.0, bad}); }), "shear modulus"));
        }
        CHECK_NOTHROW(check(StzParameters{}));
        CHECK_NOTHROW(check(IsotropicElasticity{122e9, 37.4e9}));
    }

    TEST_CASE("moduli of plane strain, Eq. (42)") {
        const IsotropicElasticity c{.bulk_modulus = 122.0, .shear_modulus = 37.4};
        CHECK(c.alpha() == doctest::Approx(122.0 + 4.0 * 37.4 / 3.0).epsilon(1e-15));
        CHECK(c.beta() == doctest::Approx(97.07).epsilon(1e-4)); // Lame's first parameter as printed in Table 1
    }
}

} // namespace material_suite
