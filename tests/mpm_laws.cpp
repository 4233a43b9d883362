// SPDX-License-Identifier: GPL-3.0-or-later
// The laws of the material points: return mapping, tangents, plane stress, rotation.
#include "messages.hpp"

#include <ductile/material/drucker_prager.hpp>
#include <ductile/material/linear_elastic.hpp>
#include <ductile/material/make_law.hpp>
#include <ductile/material/perzyna.hpp>
#include <ductile/material/stz.hpp>
#include <ductile/material/viscoplastic.hpp>
#include <ductile/material/von_mises.hpp>
#include <ductile/mpm/point_update.hpp>

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

namespace mpm_laws_suite {

using namespace ductile;
using namespace ductile::mpm;

namespace {

const IsotropicElasticity steel = elasticity_from_young(200e9, 0.3);
const VonMises hardening_steel(steel, {.yield_stress = 0.7e9, .modulus = 0.3e9});
const VonMises bilinear_steel(steel, {.yield_stress = 0.7e9, .modulus = 20e9, .limit_strain = 0.004, .softening = 10e9});
const DruckerPrager soil(elasticity_from_young(50e6, 0.25),
                         {.cohesion = 20e3, .friction = 0.8, .dilatancy = 0.3, .hardening = 1e6});
const DruckerPrager associated_soil(elasticity_from_young(50e6, 0.25), {.cohesion = 20e3, .friction = 0.8, .dilatancy = 0.8});

const IsotropicElasticity glass{.bulk_modulus = 122e9, .shear_modulus = 37.4e9};
const Viscoplastic<StzModel> metallic_glass(glass, StzModel({}, si_units));
const Viscoplastic<PerzynaModel>
    creeping_glass(glass, PerzynaModel({.yield_stress = 0.85e9, .hardening_modulus = 1e9, .reference_rate = 1.0}, si_units));

double distance(const SymmetricTensor& a, const SymmetricTensor& b) {
    const SymmetricTensor d = a - b;
    return std::sqrt(contraction(d, d));
}
double size(const SymmetricTensor& a) { return std::sqrt(contraction(a, a)); }

/// Random tensors of about this size.
SymmetricTensor random_tensor(std::mt19937& engine, double scale) {
    std::uniform_real_distribution<double> uniform(-scale, scale);
    return {uniform(engine), uniform(engine), uniform(engine), uniform(engine)};
}

/// Forward Euler of the rate equations (2.1.9)-(2.1.16) along a straight strain path in very many steps: a slow, independent
/// answer.
StressReturn<1> integrate_rates(const IsotropicElasticity& e, double yield, double modulus, SymmetricTensor stress,
                                const SymmetricTensor& strain, int steps) {
    const double mu = e.shear_modulus;
    double p = 0.0;
    const SymmetricTensor part = (1.0 / steps) * strain;
    for (int n = 0; n < steps; ++n) {
        const SymmetricTensor trial = stress + elastic_stress(e, part);
        const double q = equivalent_stress(stress);
        if (equivalent_stress(trial) <= yield + modulus * p) {
            stress = trial;
            continue;
        }
        // consistency: 3 mu s:de/q = (3 mu + H') dp
        const SymmetricTensor s = deviator(stress);
        const double dp = 3.0 * mu * contraction(s, part) / (q * (3.0 * mu + modulus));
        stress = stress + elastic_stress(e, part) - (3.0 * mu * dp / q) * s;
        p += dp;
    }
    return {stress, {p}};
}

/// What a step makes of a point.
template <std::size_t n> struct PointStep : StressReturn<n> {
    SymmetricTensor strain; ///< with its out-of-plane part
};

/// A step of a law at a point, from zero internal variables.
template <Geometry geometry, bool rotate, StepForm L>
PointStep<variable_count<L>> step_point(const L& form, const SymmetricTensor& old, const mpm::VelocityGradient& l, double dt) {
    const Law law = make_law(form);
    const double zero = 0.0;
    const double* const internal[] = {&zero};
    const SymmetricTensor start = rotate ? turned(old, spin(l, dt)) : old;
    SymmetricTensor strain = strain_increment<geometry>(l, dt);
    if (geometry == Geometry::plane_stress)
        law->release_thickness(1, &start, internal, dt, &strain);
    PointStep<variable_count<L>> step;
    step.strain = strain;
    const SymmetricTensor trial = start + elastic_stress(form.elasticity(), strain);
    double* const end[] = {step.internal.data()};
    law->correct(1, &trial, internal, dt, &step.stress, end);
    return step;
}

template <Geometry geometry, bool rotate, StepForm L>
GradientTangent<geometry> differentiate(const L& form, const SymmetricTensor& old, const mpm::VelocityGradient& l, double dt) {
    const SymmetricTensor start = rotate ? turned(old, spin(l, dt)) : old;
    const SymmetricTensor trial =
        start + elastic_stress(form.elasticity(), step_point<geometry, rotate>(form, old, l, dt).strain);
    return differentiate_point<geometry, rotate>(form.tangent(trial, {}, dt), start, form.elasticity().shear_modulus, l, dt);
}

template <StepForm L>
void check_tangent(const L& law, double strain_size, unsigned seed, double first = 0.0, double last = 0.01) {
    std::mt19937 engine(seed);
    for (int n = 0; n < 200; ++n) {
        const SymmetricTensor trial = elastic_stress(law.elasticity(), random_tensor(engine, strain_size));
        std::array<double, variable_count<L>> internal;
        internal.fill(std::uniform_real_distribution<double>(first, last)(engine));
        const Tangent t = law.tangent(trial, internal, 1.0);
        const SymmetricTensor direction = random_tensor(engine, 1.0);
        const double d[4] = {direction.xx, direction.yy, direction.zz, 2.0 * direction.xy};
        double row[4] = {};
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j)
                row[i] += t.entry[i][j] * d[j];
        const double h = 1e-6 * strain_size;
        const SymmetricTensor push = elastic_stress(law.elasticity(), h * direction);
        const SymmetricTensor difference =
            (0.5 / h) * (law.correct(trial + push, internal, 1.0).stress - law.correct(trial - push, internal, 1.0).stress);
        const SymmetricTensor derivative{row[0], row[1], row[2], row[3]};
        CHECK(distance(difference, derivative) <= 1e-5 * size(elastic_stress(law.elasticity(), direction)));
    }
}

} // namespace

TEST_SUITE_BEGIN("mpm_laws");

TEST_CASE("elastic moduli: uniaxial stress gives E and nu, and strain is the inverse of stress") {
    const SymmetricTensor strain = elastic_strain(steel, {1e6, 0.0, 0.0, 0.0});
    CHECK(strain.xx == doctest::Approx(1e6 / 200e9).epsilon(1e-14));
    CHECK(strain.yy / strain.xx == doctest::Approx(-0.3).epsilon(1e-13));
    CHECK(young_modulus(steel) == doctest::Approx(200e9).epsilon(1e-14));
    const SymmetricTensor some{1e-3, -2e-3, 5e-4, 7e-4};
    CHECK(distance(elastic_strain(steel, elastic_stress(steel, some)), some) <= 1e-17);
    CHECK(contains(message_of<InputError>([] { (void)elasticity_from_young(1.0, 0.5); }), "Poisson's ratio nu = 0.5"));
    CHECK(contains(message_of<InputError>([] { (void)elasticity_from_young(-1.0, 0.3); }), "Young's modulus E = -1"));
}

TEST_CASE("von Mises in simple shear follows the hardening line exactly, in one step or in many") {
    // tau = (Y + H p)/sqrt(3), and gamma = tau/mu + sqrt(3) p
    const double mu = steel.shear_modulus, gamma = 0.05;
    const double p = (std::sqrt(3.0) * mu * gamma - 0.7e9) / (0.3e9 + 3.0 * mu);
    for (const int steps : {1, 7}) {
        SymmetricTensor stress;
        std::array<double, 1> internal{};
        for (int n = 0; n < steps; ++n) {
            const StressReturn<1> r =
                hardening_steel.correct(stress + elastic_stress(steel, {0.0, 0.0, 0.0, 0.5 * gamma / steps}), internal, 1.0);
            stress = r.stress;
            internal = r.internal;
        }
        CHECK(internal[0] == doctest::Approx(p).epsilon(1e-12));
        CHECK(stress.xy == doctest::Approx((0.7e9 + 0.3e9 * p) / std::sqrt(3.0)).epsilon(1e-12));
    }
}

TEST_CASE("von Mises converges to the slowly integrated rate equations on a path that turns the deviator") {
    const SymmetricTensor start{0.2e9, -0.35e9, 0.1e9, 0.15e9}, strain{0.004, 0.001, -0.002, 0.003};
    const StressReturn<1> reference = integrate_rates(steel, 0.7e9, 0.3e9, start, strain, 400'000);
    double before = 0.0;
    for (const int steps : {50, 100, 200}) {
        StressReturn<1> r{start, {0.0}};
        for (int n = 0; n < steps; ++n)
            r = hardening_steel.correct(r.stress + elastic_stress(steel, (1.0 / steps) * strain), r.internal, 1.0);
        const double error = distance(r.stress, reference.stress) / size(reference.stress);
        CHECK(error < 0.15 / steps);
        if (before > 0.0)
            CHECK(std::log2(before / error) == doctest::Approx(1.0).epsilon(0.15)); // backward Euler
        before = error;
        CHECK(std::abs(r.internal[0] - reference.internal[0]) < 0.1 / steps * reference.internal[0]);
    }
}

TEST_CASE("bilinear hardening: yield follows (2.1.19) up, down, and to nothing") {
    const double peak = 0.7e9 + 20e9 * 0.004;
    for (const auto& [p, expected] : {std::array{0.0, 0.7e9},
                                      {0.002, 0.7e9 + 20e9 * 0.002},
                                      {0.004, peak},
                                      {0.014, peak - 10e9 * 0.01},
                                      {0.004 + peak / 10e9 + 0.01, 0.0}})
        CHECK(bilinear_steel.yield_stress({p}) == doctest::Approx(expected).epsilon(1e-12).scale(1.0));
    // one step from each piece to each later one ends on the yield surface, whatever pieces it crosses
    for (const double p : {0.0, 0.0039, 0.02})
        for (const double strain : {0.003, 0.006, 0.03, 0.2}) {
            const StressReturn<1> r =
                bilinear_steel.correct(elastic_stress(steel, {strain, -strain, 0.0, 0.3 * strain}), {p}, 1.0);
            CHECK(r.internal[0] > p);
            CHECK(equivalent_stress(r.stress) ==
                  doctest::Approx(bilinear_steel.yield_stress(r.internal)).epsilon(1e-9).scale(1e6));
        }
    CHECK(contains(message_of<InputError>([] { VonMises(steel, {.yield_stress = 1e9, .softening = 3.0 * steel.shear_modulus}); }),
                   "softening modulus"));
    CHECK(contains(message_of<InputError>([] { VonMises(steel, {.yield_stress = 0.0}); }), "yield stress = 0"));
}

TEST_CASE("a stress that is no number comes back as one, and ends no step in a search without end") {
    const double nothing = std::numeric_limits<double>::quiet_NaN(), beyond = std::numeric_limits<double>::infinity();
    for (const double bad : {nothing, beyond, 1e200})
        for (const SymmetricTensor& trial : {SymmetricTensor{bad, 0.0, 0.0, 0.0}, SymmetricTensor{0.0, 0.0, 0.0, bad}})
            for (const VonMises& law : {hardening_steel, bilinear_steel}) {
                const StressReturn<1> found = law.correct(trial, {0.1}, 1.0);
                CHECK_FALSE((std::isfinite(contraction(found.stress, found.stress)) && std::isfinite(found.internal[0])));
                (void)law.tangent(trial, {0.1}, 1.0);
            }
}

TEST_CASE("Drucker-Prager: cone, apex and elastic range end on the yield surface with the flow of the potential") {
    std::mt19937 engine(5);
    int cone = 0, apex = 0;
    for (int n = 0; n < 1000; ++n) {
        const SymmetricTensor trial = elastic_stress(soil.elasticity(), random_tensor(engine, 4e-3));
        const double k = std::uniform_real_distribution<double>(0.0, 0.01)(engine);
        const StressReturn<1> r = soil.correct(trial, {k}, 1.0);
        const double q = equivalent_stress(r.stress), mean = trace(r.stress) / 3.0;
        const double excess = q + 0.8 * mean - 20e3 - 1e6 * r.internal[0];
        CHECK(excess <= 1e-9 * equivalent_stress(trial) + 1e-6);
        if (r.internal[0] == k) {
            CHECK(distance(r.stress, trial) == 0.0);
            continue;
        }
        CHECK(std::abs(excess) <= 1e-9 * (size(trial) + 20e3));
        // plastic change of volume = dilatancy * multiplier, on the cone and at the apex alike
        const SymmetricTensor plastic = elastic_strain(soil.elasticity(), trial - r.stress);
        CHECK(trace(plastic) == doctest::Approx(0.3 * (r.internal[0] - k)).epsilon(1e-9));
        (q > 1e-6 ? cone : apex)++;
    }
    CHECK(cone > 100);
    CHECK(apex > 100);
    CHECK(contains(message_of<InputError>([] { DruckerPrager(steel, {.cohesion = 1.0, .friction = 0.3, .dilatancy = 0.4}); }),
                   "dilatancy = 0.4"));
}

TEST_CASE("rate models under steady simple shear flow as fast as they are sheared") {
    // at steady state D^pl is the rate of shear: Perzyna's overstress gives sbar = Y (1 + D/D_0) for n = 1 without hardening
    const Viscoplastic<PerzynaModel> perzyna(glass, PerzynaModel({.yield_stress = 0.85e9, .reference_rate = 0.5}, si_units));
    const double rate = 0.1; // of D_xy [1/s]
    StressReturn<1> state;
    for (int n = 0; n < 4000; ++n)
        state = perzyna.correct(state.stress + elastic_stress(glass, {0.0, 0.0, 0.0, rate * 1e-3}), state.internal, 1e-3);
    CHECK(state.stress.xy == doctest::Approx(0.85e9 * (1.0 + rate / 0.5)).epsilon(1e-9));
    CHECK(state.internal[0] == doctest::Approx(rate * 4.0 - state.stress.xy / (2.0 * glass.shear_modulus)).epsilon(1e-2));

    // the STZ law heats towards chi_inf, where D^pl(sbar, chi_inf) = rate
    const StzModel stz({}, si_units);
    state = {{}, {600.0}};
    for (int n = 0; n < 40'000; ++n)
        state = metallic_glass.correct(state.stress + elastic_stress(glass, {0.0, 0.0, 0.0, rate * 1e-3}), state.internal, 1e-3);
    CHECK(state.internal[0] == doctest::Approx(900.0).epsilon(1e-3));
    CHECK(stz.rates(state.stress.xy, state.internal).fluidity * state.stress.xy == doctest::Approx(rate).epsilon(1e-3));
}

TEST_CASE("rate models: first order in the step, whatever its length the stress stays between yield and trial") {
    const SymmetricTensor start{0.3e9, -0.4e9, 0.1e9, 0.2e9}, strain{0.02, -0.015, 0.001, 0.02};
    const auto steps_to_end = [&](int steps) {
        StressReturn<1> r{start, {640.0}};
        for (int n = 0; n < steps; ++n)
            r = metallic_glass.correct(r.stress + elastic_stress(glass, (1.0 / steps) * strain), r.internal, 2.0 / steps);
        return r;
    };
    const StressReturn<1> reference = steps_to_end(20'000);
    const double coarse = distance(steps_to_end(200).stress, reference.stress),
                 fine = distance(steps_to_end(400).stress, reference.stress);
    CHECK(fine < 0.01 * size(reference.stress));
    CHECK(std::log2(coarse / fine) == doctest::Approx(1.0).epsilon(0.1));
    std::mt19937 engine(9);
    for (const double dt : {1e-9, 1e-3, 1.0, 1e6})
        for (int n = 0; n < 50; ++n) {
            const SymmetricTensor trial = elastic_stress(glass, random_tensor(engine, 0.1));
            const double before = equivalent_stress(trial) / std::sqrt(3.0);
            const double after = equivalent_stress(metallic_glass.correct(trial, {700.0}, dt).stress) / std::sqrt(3.0);
            CHECK(after <= before * (1.0 + 1e-12));
            CHECK(after >= std::min(before, 0.85e9) * (1.0 - 1e-12));
        }
}

TEST_CASE("tangents are the derivatives of the returned stress") {
    check_tangent(LinearElastic(steel), 1e-2, 1);
    check_tangent(hardening_steel, 1e-2, 2);
    check_tangent(bilinear_steel, 2e-2, 3);
    check_tangent(soil, 3e-3, 4);
    check_tangent(associated_soil, 3e-3, 5);
    check_tangent(metallic_glass, 0.05, 6, 600.0, 900.0);
    check_tangent(creeping_glass, 0.05, 7);
}

TEST_CASE("plane stress: no stress out of the plane, and uniaxial tension hardens as the law says") {
    // uniaxial stress: sigma = Y + H p, eps = sigma/E + p
    const double young = 200e9, strain = 0.02;
    const double p = (young * strain - 0.7e9) / (young + 0.3e9), sigma = 0.7e9 + 0.3e9 * p;
    // the contraction in the plane is what leaves sigma_yy = 0: elastic part -nu sigma/E, plastic part -p/2
    const mpm::VelocityGradient l{.xx = strain, .yy = -0.3 * sigma / young - 0.5 * p};
    const PointStep step = step_point<Geometry::plane_stress, false>(hardening_steel, {}, l, 1.0);
    CHECK(step.stress.xx == doctest::Approx(sigma).epsilon(1e-10));
    CHECK(std::abs(step.stress.yy) <= 1e-10 * sigma);
    CHECK(std::abs(step.stress.zz) <= 1e-10 * sigma);
    CHECK(step.strain.zz == doctest::Approx(l.yy).epsilon(1e-9));
    CHECK(step.internal[0] == doctest::Approx(p).epsilon(1e-10));

    std::mt19937 engine(7);
    for (int n = 0; n < 200; ++n) {
        const SymmetricTensor a = random_tensor(engine, 3e-3);
        const mpm::VelocityGradient gradient{a.xx, a.zz, a.xy, a.yy, 0.0};
        const PointStep s = step_point<Geometry::plane_stress, true>(soil, {1e3, -2e3, 0.0, 4e3}, gradient, 1.0);
        CHECK(std::abs(s.stress.zz) <= 1e-9 * (size(s.stress) + 1e3));
    }
}

TEST_CASE("a turned stress keeps its invariants; the angle is that of the rotation to second order") {
    const SymmetricTensor stress{3.0, -1.0, 0.5, 2.0};
    for (const double w : {-2.0, -0.1, 1e-3, 0.7}) {
        const SymmetricTensor t = turned(stress, w);
        CHECK(trace(t) == doctest::Approx(trace(stress)).epsilon(1e-14));
        CHECK(contraction(t, t) == doctest::Approx(contraction(stress, stress)).epsilon(1e-14));
        const double a = 2.0 * std::atan(0.5 * w), c = std::cos(a), s = std::sin(a);
        CHECK(t.xx == doctest::Approx(c * c * 3.0 - 2.0 * s * c * 2.0 - s * s).epsilon(1e-13));
        CHECK(t.xy == doctest::Approx(s * c * 4.0 + (c * c - s * s) * 2.0).epsilon(1e-13));
    }
}

TEST_CASE_TEMPLATE("the derivative of a point's step is that of its stress, rotation and out-of-plane strain included", Form,
                   LinearElastic, VonMises, DruckerPrager) {
    const auto law = [] {
        if constexpr (std::is_same_v<Form, LinearElastic>)
            return LinearElastic(steel);
        else if constexpr (std::is_same_v<Form, VonMises>)
            return hardening_steel;
        else
            return DruckerPrager(steel, {.cohesion = 0.4e9, .friction = 0.6, .dilatancy = 0.2, .hardening = 2e9});
    }();
    std::mt19937 engine(11);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const auto check = [&]<Geometry geometry, bool rotate>() {
        const double dt = 0.5;
        for (int n = 0; n < 100; ++n) {
            SymmetricTensor old = random_tensor(engine, 0.4e9);
            if (geometry == Geometry::plane_stress)
                old.zz = 0.0;
            const auto random_gradient = [&](double scale) {
                return mpm::VelocityGradient{scale * uniform(engine), scale * uniform(engine), scale * uniform(engine),
                                             scale * uniform(engine),
                                             geometry == Geometry::axisymmetric ? scale * uniform(engine) : 0.0};
            };
            const mpm::VelocityGradient l = random_gradient(0.03), d = random_gradient(1.0);
            const double h = 1e-8;
            const auto at = [&](double x) {
                return step_point<geometry, rotate>(
                           law, old, {l.xx + x * d.xx, l.xy + x * d.xy, l.yx + x * d.yx, l.yy + x * d.yy, l.hoop + x * d.hoop},
                           dt)
                    .stress;
            };
            const SymmetricTensor difference = (0.5 / h) * (at(h) - at(-h));
            const auto t = differentiate<geometry, rotate>(law, old, l, dt);
            const double direction[5] = {d.xx, d.xy, d.yx, d.yy, d.hoop},
                         expected[4] = {difference.xx, difference.yy, difference.xy, difference.zz};
            for (int r = 0; r < t.rows; ++r) {
                double derivative = 0.0;
                for (int c = 0; c < t.columns; ++c)
                    derivative += dt * t.entry[r][c] * direction[c];
                CHECK(std::abs(derivative - expected[r]) <= 3e-5 * 200e9 * dt);
            }
        }
    };
    check.template operator()<Geometry::plane_strain, true>();
    check.template operator()<Geometry::plane_strain, false>();
    check.template operator()<Geometry::plane_stress, true>();
    check.template operator()<Geometry::axisymmetric, true>();
}

TEST_SUITE_END();

} // namespace mpm_laws_suite
