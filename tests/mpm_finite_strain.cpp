// SPDX-License-Identifier: GPL-3.0-or-later
// Laws at finite strain: stress and energy, turning, flow, tangents, plane stress, and the hardening they share with small
// strain.
#include "messages.hpp"

#include <ductile/material/finite_strain.hpp>
#include <ductile/material/linear_elastic.hpp>
#include <ductile/material/von_mises.hpp>
#include <ductile/mpm/point_update.hpp>

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace mpm_finite_strain_suite {

using namespace ductile;
using namespace ductile::mpm;

namespace {

const IsotropicElasticity steel = elasticity_from_young(200.0, 0.3);
const Hardening linear{.yield_stress = 0.7, .modulus = 3.0};
const Hardening voce{.yield_stress = 0.7, .modulus = 0.5, .saturation = 0.4, .saturation_strain = 0.05};
const Hardening table{.yield_stress = 0.7, .curve = {{0.0, 0.7}, {0.02, 1.0}, {0.1, 1.2}, {0.3, 1.1}}};

const Law rubber = make_finite_law(NeoHookean(steel)), hencky = make_finite_law(Hencky(LinearElastic(steel)));
const Law metal = hencky_von_mises_law(steel, linear);

struct NamedLaw {
    const char* name;
    Law law;
    double size; ///< of deformations to try
};
const std::vector<NamedLaw> all_laws{{"neo-Hookean", rubber, 0.4},
                                     {"Hencky", hencky, 0.4},
                                     {"linear hardening", metal, 0.05},
                                     {"Voce", hencky_von_mises_law(steel, voce), 0.05},
                                     {"curve", hencky_von_mises_law(steel, table), 0.05}};

/// A point of a law, from no deformation.
struct Point {
    Law law;
    std::vector<double> internal = std::vector<double>(law->variables().size());
    SymmetricTensor stress = {};
    StepWork work = {};

    [[nodiscard]] std::array<double*, most_variables> rows() {
        std::array<double*, most_variables> all{};
        for (std::size_t k = 0; k < internal.size(); ++k)
            all[k] = &internal[k];
        return all;
    }
    void step(const Deformation& f) { law->finite_strain()->correct(1, &f, rows().data(), 1.0, &stress, rows().data(), &work); }
    [[nodiscard]] double energy() const { return law->stored_energy(stress, internal); }
};

double size(const SymmetricTensor& a) { return std::sqrt(contraction(a, a)); }

Deformation random_deformation(std::mt19937& engine, double scale) {
    std::uniform_real_distribution<double> uniform(-scale, scale);
    return {uniform(engine), uniform(engine), uniform(engine), uniform(engine), uniform(engine)};
}

/// (1 + a) (1 + b) - 1
Deformation after(const Deformation& a, const Deformation& b) {
    return {a.xx + b.xx + a.xx * b.xx + a.xy * b.yx, a.xy + b.xy + a.xx * b.xy + a.xy * b.yy,
            a.yx + b.yx + a.yx * b.xx + a.yy * b.yx, a.yy + b.yy + a.yx * b.xy + a.yy * b.yy, a.zz + b.zz + a.zz * b.zz};
}

Deformation rotation(double angle) {
    return {std::cos(angle) - 1.0, -std::sin(angle), std::sin(angle), std::cos(angle) - 1.0, 0.0};
}

} // namespace

TEST_SUITE_BEGIN("mpm_finite_strain");

TEST_CASE("closed forms: uniaxial strain, simple shear, and the moduli of small strain") {
    const double stretch = 1.7, mu = steel.shear_modulus;
    Point pulled{hencky};
    pulled.step({.xx = stretch - 1.0});
    CHECK(pulled.stress.xx == doctest::Approx(steel.alpha() * std::log(stretch) / stretch).epsilon(1e-13));
    CHECK(pulled.stress.zz == doctest::Approx(steel.beta() * std::log(stretch) / stretch).epsilon(1e-13));
    CHECK(pulled.energy() * stretch == doctest::Approx(0.5 * steel.alpha() * std::pow(std::log(stretch), 2)).epsilon(1e-13));
    Point sheared{rubber};
    sheared.step({.xy = 1.3});
    CHECK(sheared.stress.xy == doctest::Approx(mu * 1.3).epsilon(1e-13));
    CHECK(sheared.stress.xx == doctest::Approx(mu * 1.69).epsilon(1e-13));
    CHECK(std::abs(sheared.stress.yy) < 1e-13 * mu);
    for (const NamedLaw& named : all_laws) {
        CAPTURE(named.name);
        Point small{named.law};
        const double e = 1e-9;
        small.step({2.0 * e, 3.0 * e, -e, 5.0 * e, 7.0 * e});
        const SymmetricTensor strain{2.0 * e, 5.0 * e, 7.0 * e, e};
        CHECK(size(small.stress - elastic_stress(steel, strain)) < 1e-7 * size(small.stress)); // h is exact where it is small
        CHECK(small.energy() == doctest::Approx(0.5 * contraction(small.stress, strain)).epsilon(1e-5));
    }
}

TEST_CASE("elastic stress is the derivative of the energy, for any deformation") {
    std::mt19937 engine(1);
    for (const Law& law : {rubber, hencky})
        for (int n = 0; n < 50; ++n) {
            Point p{law};
            p.step(random_deformation(engine, 0.3));
            const Deformation l = random_deformation(engine, 1.0);
            const auto energy = [&](double h) { // of the volume that p has
                Point moved = p;
                const Deformation d{h * l.xx, h * l.xy, h * l.yx, h * l.yy, h * l.zz};
                moved.step(d);
                CHECK(moved.work.stored == doctest::Approx(moved.energy() * determinant(d) - p.energy()).epsilon(1e-9));
                return moved.energy() * determinant(d);
            };
            const double h = 1e-4, slope = (energy(h) - energy(-h)) / (2.0 * h);
            const double power = p.stress.xx * l.xx + p.stress.xy * (l.xy + l.yx) + p.stress.yy * l.yy + p.stress.zz * l.zz;
            CHECK(slope == doctest::Approx(power).epsilon(1e-5).scale(size(p.stress)));
        }
}

TEST_CASE("elastic laws forget the way, and all laws turn with their point") {
    std::mt19937 engine(2);
    for (const NamedLaw& named : all_laws)
        for (int n = 0; n < 50; ++n) {
            CAPTURE(named.name);
            const Deformation first = random_deformation(engine, named.size), second = random_deformation(engine, named.size);
            Point twice{named.law}, once{named.law}, turned_point{named.law};
            twice.step(first);
            turned_point.step(first);
            once.step(after(second, first));
            turned_point.step(rotation(2.0));
            turned_point.step(after(second, rotation(-2.0)));
            twice.step(second);
            if (named.size > 0.1)
                CHECK(size(twice.stress - once.stress) < 1e-11 * size(once.stress));
            CHECK(size(turned_point.stress - twice.stress) < 1e-11 * size(twice.stress));
            const double energy = twice.energy();
            twice.step(rotation(0.7));
            CHECK(size(twice.stress - turned(turned_point.stress, 2.0 * std::tan(0.35))) < 1e-11 * size(twice.stress));
            CHECK(twice.energy() == doctest::Approx(energy).epsilon(1e-12));
        }
}

TEST_CASE("logarithmic strain and stretch are each other's inverse") {
    std::mt19937 engine(3);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (const double scale : {1e-8, 1e-3, 0.5, 2.0}) {
        const SymmetricTensor e{scale * uniform(engine), scale * uniform(engine), scale * uniform(engine),
                                scale * uniform(engine)};
        CHECK(size(logarithmic_strain(stretch_of(e)) - e) < 1e-12 * size(e));
        CHECK(log_volume(stretch_of(e)) == doctest::Approx(trace(e)).epsilon(1e-12));
        CHECK(-std::log(inverse_volume(stretch_of(e))) == doctest::Approx(trace(e)).epsilon(1e-9));
    }
    CHECK(size(logarithmic_strain(stretch_of({0.2, 0.2, 0.1, 0.0})) - SymmetricTensor{0.2, 0.2, 0.1, 0.0}) < 1e-15);
}

TEST_CASE("multiplicative flow in pure shear follows the hardening line at any strain, turned or not, in one step or in many") {
    // principal stretches s, 1/s, 1: q = sqrt(3) tau_1, equivalent strain 2/sqrt(3) ln s = q/(3 mu) + p, q = Y + H p
    const double strain = 2.0 / std::sqrt(3.0) * std::log(1.8), mu = steel.shear_modulus;
    const double p = (3.0 * mu * strain - 0.7) / (3.0 * mu + 3.0), q = 0.7 + 3.0 * p;
    for (const int steps : {1, 10}) {
        Point point{metal};
        double dissipated = 0.0;
        const double s = std::pow(1.8, 1.0 / steps);
        for (int n = 0; n < steps; ++n) {
            point.step({.xx = s - 1.0, .yy = 1.0 / s - 1.0});
            dissipated += point.work.dissipated;
        }
        point.step(rotation(1.0));
        CHECK(equivalent_stress(point.stress) == doctest::Approx(q).epsilon(1e-12));
        CHECK(point.internal[0] == doctest::Approx(p).epsilon(1e-12));
        CHECK(std::abs(trace(point.stress)) < 1e-12);
        CHECK(dissipated == doctest::Approx(0.7 * p + 1.5 * p * p).epsilon(1e-12)); // the hardening line's area
        CHECK(point.energy() == doctest::Approx(q * q / (6.0 * mu)).epsilon(1e-12));
    }
}

TEST_CASE("hardening by Voce and by a curve: the stress of every step is that of its plastic strain") {
    const auto flow_stress = [](const Hardening& h, double p) {
        if (h.curve.empty())
            return 0.7 + 0.5 * p + 0.4 * (1.0 - std::exp(-p / 0.05));
        return p < 0.02 ? 0.7 + 15.0 * p : p < 0.1 ? 1.0 + 2.5 * (p - 0.02) : p < 0.3 ? 1.2 - 0.5 * (p - 0.1) : 1.1;
    };
    for (const Hardening& h : {voce, table})
        for (const double strain : {0.005, 0.03, 0.2, 0.9}) {
            const VonMises law(steel, h);
            const StressReturn<1> end = law.correct(elastic_stress(steel, {strain, -strain, 0.0, 0.0}), {0.0}, 1.0);
            const double p = end.internal[0], q = equivalent_stress(end.stress);
            CHECK(q == doctest::Approx(flow_stress(h, p)).epsilon(1e-12));
            CHECK(q / (3.0 * steel.shear_modulus) + p == doctest::Approx(2.0 / std::sqrt(3.0) * strain).epsilon(1e-12));
            CHECK(law.yield_stress({p}) == doctest::Approx(q).epsilon(1e-12));
        }
    CHECK(contains(message_of<InputError>([] {
                       VonMises(steel, {.yield_stress = 1.0, .curve = {{0.0, 0.7}}});
                   }),
                   "must begin with no plastic strain and the yield stress, 1 Pa"));
    CHECK(contains(message_of<InputError>([] {
                       VonMises(steel, {.yield_stress = 0.7, .curve = {{0.0, 0.7}, {0.1, 0.8}, {0.1, 0.9}}});
                   }),
                   "point 3 of the hardening curve is (0.1, 0.9 Pa)"));
    CHECK(contains(message_of<InputError>([] {
                       VonMises(steel, {.yield_stress = 0.7, .modulus = 1.0, .curve = {{0.0, 0.7}}});
                   }),
                   "give one of them"));
}

TEST_CASE("tangents at finite strain: the difference quotient comes down to them over four decades") {
    std::mt19937 engine(4);
    for (const NamedLaw& named : all_laws)
        for (int n = 0; n < 40; ++n) {
            CAPTURE(named.name);
            Point start{named.law};
            if (n > 0) // from no deformation at first, where both stretches are one
                start.step(random_deformation(engine, named.size));
            const Deformation f = n == 0 ? Deformation{} : random_deformation(engine, named.size);
            SpatialTangent t;
            named.law->finite_strain()->tangent(1, &f, start.rows().data(), 1.0, &t);
            const Deformation l = random_deformation(engine, 0.3);
            const double columns[5] = {l.xx, l.xy, l.yx, l.yy, l.zz};
            double row[4] = {};
            for (int i = 0; i < 4; ++i)
                for (int j = 0; j < 5; ++j)
                    row[i] += t.entry[i][j] * columns[j];
            const auto stress = [&](double h) {
                Point p = start;
                p.step(after({h * l.xx, h * l.xy, h * l.yx, h * l.yy, h * l.zz}, f));
                return p.stress;
            };
            double error = 1.0;
            for (const double h : {1e-2, 1e-3, 1e-4, 1e-5}) {
                const SymmetricTensor quotient = 1.0 / h * (stress(h) - stress(0.0));
                const double now = size(quotient - SymmetricTensor{row[0], row[1], row[2], row[3]}) / steel.alpha();
                CHECK(now < 0.2 * error + 1e-9);
                error = std::max(now, 1e-8);
            }
            CHECK(error < 1e-4);
        }
}

TEST_CASE("plane stress at finite strain: none out of the plane, and uniaxial tension has the thickness of the closed form") {
    for (const NamedLaw& named : all_laws) {
        CAPTURE(named.name);
        Point p{named.law};
        std::mt19937 engine(5);
        for (int n = 0; n < 5; ++n) {
            Deformation f = random_deformation(engine, named.size);
            named.law->finite_strain()->release_thickness(1, &f, p.rows().data(), 1.0);
            p.step(f);
            CHECK(std::abs(p.stress.zz) <= 2e-14 * steel.alpha());
        }
    }
    // Hencky: all lateral strains are -nu ln s, and tau is E ln s
    const double s = 1.5, lateral = std::pow(s, -0.3);
    Deformation f{.xx = s - 1.0, .yy = lateral - 1.0};
    Point p{hencky};
    hencky->finite_strain()->release_thickness(1, &f, p.rows().data(), 1.0);
    CHECK(1.0 + f.zz == doctest::Approx(lateral).epsilon(1e-12));
    p.step(f);
    CHECK(p.stress.xx == doctest::Approx(200.0 * std::log(s) / (s * lateral * lateral)).epsilon(1e-12));
    CHECK(std::abs(p.stress.yy) < 1e-12);
}

TEST_CASE("cells cannot have a law at finite strain, and it says so") {
    CHECK_FALSE(rubber->has_rates());
    CHECK_THROWS_AS((void)rubber->flow_at(1.0, {}), std::logic_error);
    const SymmetricTensor zero;
    Tangent t;
    CHECK_THROWS_AS(rubber->tangent(1, &zero, nullptr, 1.0, &t), std::logic_error);
}

TEST_SUITE_END();

} // namespace mpm_finite_strain_suite
