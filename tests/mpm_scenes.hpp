// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/material/drucker_prager.hpp>
#include <ductile/material/finite_strain.hpp>
#include <ductile/material/johnson_cook.hpp>
#include <ductile/material/linear_elastic.hpp>
#include <ductile/material/perzyna.hpp>
#include <ductile/material/von_mises.hpp>
#include <ductile/mpm/diagnostics.hpp>
#include <ductile/mpm/discretisation.hpp>
#include <ductile/mpm/krylov.hpp>
#include <ductile/mpm/momentum_balance.hpp>
#include <ductile/mpm/scene.hpp>
#include <ductile/mpm/state.hpp>
#include <ductile/mpm/time_stepper.hpp>

#include <array>
#include <cmath>
#include <doctest/doctest.h>
#include <functional>
#include <numeric>
#include <random>
#include <span>
#include <vector>

/// Small scenes that several suites of the material point method share.
namespace mpm_scenes {

using namespace ductile;
using namespace ductile::mpm;

inline const IsotropicElasticity rubber = elasticity_from_young(1000.0, 0.3);

inline Law law_named(const std::string& name) {
    if (name == "elastic")
        return linear_elastic_law(rubber);
    if (name == "von Mises")
        return von_mises_law(rubber, {.yield_stress = 6.0, .modulus = 50.0});
    if (name == "neo-Hookean")
        return make_finite_law(NeoHookean(rubber));
    if (name == "Hencky von Mises")
        return hencky_von_mises_law(rubber, {.yield_stress = 6.0, .modulus = 50.0});
    if (name == "Johnson-Cook")
        return johnson_cook_law(rubber, {.yield_stress = 3.0,
                                         .hardening = 20.0,
                                         .hardening_exponent = 0.5,
                                         .rate_coefficient = 0.1,
                                         .reference_rate = 1e-3,
                                         .thermal_exponent = 1.2,
                                         .reference_temperature = 300.0,
                                         .melting_temperature = 400.0,
                                         .temperature_by_plastic_work = 10.0});
    if (name == "Perzyna")
        return perzyna_law(rubber, {.yield_stress = 3.0, .hardening_modulus = 20.0, .reference_rate = 0.5});
    return drucker_prager_law(rubber, {.cohesion = 6.0, .friction = 0.5, .dilatancy = 0.2, .hardening = 50.0});
}

/// A square block of 4 x 4 cells amid a grid of 8 x 8, from (0.2, 0.2) to (0.6, 0.6) m; in axisymmetry a ring.
struct Block {
    Scene scene;
    State state;
};
inline Block block(ShapeFunction shape, Geometry geometry = Geometry::plane_strain, const std::string& law = "elastic",
                   int particles_per_side = 2) {
    Block b{
        .scene = {.geometry = geometry, .grid = {8, 8, 0.8, 0.8, 0.0, 0.0, {}}, .shape = shape, .materials = {{law_named(law)}}},
        .state = {}};
    add_body(b.state.particles,
             {.shape = rectangle(0.2, 0.2, 0.6, 0.6), .density = 10.0, .particles_per_side = particles_per_side}, b.scene);
    return b;
}

/// Moves every particle a little, so that no weight is a round number.
inline void shake(Particles& particles, double distance, unsigned seed = 3) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> uniform(-distance, distance);
    for (std::size_t p = 0; p < particles.size(); ++p) {
        particles.x[p] += uniform(engine);
        particles.y[p] += uniform(engine);
    }
}

/// Random stresses about as large as this; sigma_zz = 0 in plane stress.
inline void stress_randomly(const Scene& scene, Particles& particles, double scale, unsigned seed = 4) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> uniform(-scale, scale);
    for (std::size_t p = 0; p < particles.size(); ++p) {
        particles.stress_xx[p] = uniform(engine);
        particles.stress_yy[p] = uniform(engine);
        particles.stress_zz[p] = scene.geometry == Geometry::plane_stress ? 0.0 : uniform(engine);
        particles.stress_xy[p] = uniform(engine);
    }
}

/// Random deformations as large as this, from none: the stress is that of the law, which is one at finite strain.
inline void deform_randomly(const Scene& scene, Particles& particles, double scale, unsigned seed = 4) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> uniform(-scale, scale);
    for (std::size_t p = 0; p < particles.size(); ++p) {
        Deformation f{uniform(engine), uniform(engine), uniform(engine), uniform(engine),
                      scene.geometry == Geometry::plane_strain ? 0.0 : uniform(engine)};
        double* internal[most_variables] = {};
        for (std::size_t k = 0; k < particles.internal.size(); ++k)
            internal[k] = &particles.internal[k][p];
        const FiniteStrain& law = *scene.materials[static_cast<std::size_t>(particles.material[p])].law->finite_strain();
        if (scene.geometry == Geometry::plane_stress)
            law.release_thickness(1, &f, internal, 1.0);
        SymmetricTensor stress;
        StepWork work;
        law.correct(1, &f, internal, 1.0, &stress, internal, &work);
        particles.stress_xx[p] = stress.xx;
        particles.stress_yy[p] = stress.yy;
        particles.stress_zz[p] = stress.zz;
        particles.stress_xy[p] = stress.xy;
    }
}

/// A block under random stress that is about to be strained by some per cent in the step: both elastic and plastic particles.
inline Block strained_block(ShapeFunction shape, Geometry geometry, const std::string& law) {
    Block b = block(shape, geometry, law);
    b.scene.grid.sides.bottom = SideCondition::slip;
    for (double& y : b.state.particles.y)
        y -= 0.2; // onto the wall
    shake(b.state.particles, 0.015);
    for (double& y : b.state.particles.y)
        y = std::max(y, 0.001);
    if (has_finite_strain(b.scene))
        deform_randomly(b.scene, b.state.particles, law == "neo-Hookean" ? 0.1 : 3e-3);
    else
        stress_randomly(b.scene, b.state.particles, law == "elastic" ? 5.0 : 3.0);
    for (std::size_t p = 0; p < b.state.particles.size(); ++p) {
        b.state.particles.velocity_x[p] = 0.5 * b.state.particles.y[p];
        b.state.particles.velocity_y[p] = -0.3 * b.state.particles.y[p];
    }
    return b;
}

/// Largest component of the stress of any particle.
inline double largest_stress(const Particles& particles) {
    double largest = 0.0;
    for (const auto* component : {&particles.stress_xx, &particles.stress_yy, &particles.stress_zz, &particles.stress_xy})
        for (const double s : *component)
            if (std::abs(s) > largest || std::isnan(s)) // NaN stays
                largest = std::abs(s);
    return largest;
}

inline const ShapeFunction all_shapes[] = {ShapeFunction::linear, ShapeFunction::gimp, ShapeFunction::bspline};
inline const Geometry all_geometries[] = {Geometry::plane_strain, Geometry::plane_stress, Geometry::axisymmetric};

inline std::vector<double> random_vector(std::size_t size, double scale, unsigned seed) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> uniform(-scale, scale);
    std::vector<double> v(size);
    for (double& x : v)
        x = uniform(engine);
    return v;
}

inline double length(std::span<const double> v) { return std::sqrt(std::inner_product(v.begin(), v.end(), v.begin(), 0.0)); }

/// |J s - (F(u + h s) - F(u))/h| for four decades of h, with s about as long as u.
inline std::array<double, 5> jacobian_errors(MomentumBalance& balance, unsigned seed) {
    std::vector<double> u(balance.initial_guess().begin(), balance.initial_guess().end());
    const std::vector<double> shift = random_vector(u.size(), 0.02, seed), direction = random_vector(u.size(), 1.0, seed + 1);
    std::vector<double> s(u.size()), f(u.size()), f_h(u.size()), js(u.size()), moved(u.size());
    const auto& nodes = balance.nodes();
    const bool momentum = balance.scheme().form == Form::momentum;
    for (std::size_t c = 0; c < u.size(); ++c)
        if (!nodes.prescribed[c]) {
            const double unit = momentum ? nodes.mass[c / 2] : 1.0;
            u[c] += unit * shift[c];
            s[c] = 0.05 * unit * direction[c];
        }
    balance.residual(u, f);
    balance.linearise(u);
    balance.jacobian_times(s, js);
    std::array<double, 5> errors{};
    double h = 1e-1;
    for (double& error : errors) {
        for (std::size_t c = 0; c < u.size(); ++c)
            moved[c] = u[c] + h * s[c];
        balance.residual(moved, f_h);
        double sum = 0.0;
        for (std::size_t c = 0; c < u.size(); ++c)
            sum += std::pow((f_h[c] - f[c]) / h - js[c], 2);
        error = std::sqrt(sum) / length(js);
        h *= 0.1;
    }
    return errors;
}

/// What some steps leave of the balance of energy.
struct StepBalance {
    double open = 0.0;  ///< what is left of it
    double scale = 0.0; ///< the magnitudes that it is the difference of
    double rubbed = 0.0, load_work = 0.0;
};
inline StepBalance balance_of_steps(TimeStepper& stepper, Block& b, double dt, int steps = 5) {
    const Energies start = energies_of(b.scene, b.state.particles);
    StepBalance balance;
    double brought = 0.0;
    for (int n = 0; n < steps; ++n) {
        const StepOutcome outcome = stepper.attempt(b.state, dt, b.state.time + dt);
        REQUIRE(outcome.accepted);
        const StepEnergies& e = outcome.energies;
        CHECK(e.friction >= -1e-12);
        balance.rubbed += e.friction;
        balance.load_work += e.load_work;
        balance.scale += std::abs(e.surface_work) + std::abs(e.load_work) + std::abs(e.in_contact) + std::abs(e.of_method);
        brought += e.surface_work + e.load_work - e.in_contact - e.friction - e.of_method;
    }
    const Energies end = energies_of(b.scene, b.state.particles);
    balance.open = end.kinetic + end.internal - start.kinetic - start.internal - brought;
    balance.scale += std::abs(end.internal - start.internal);
    return balance;
}

/// Explicit and implicit steps and those of the midpoint rule of what `make` makes, which rubs if friction is positive.
inline void check_balance_of_contact(const std::function<Block()>& make, double friction) {
    const auto check_steps = [&](TimeStepper& stepper, Block& b, double dt) {
        const StepBalance balance = balance_of_steps(stepper, b, dt);
        CHECK(std::abs(balance.open) < 1e-8 * balance.scale);
        CHECK((friction > 0.0) == (balance.rubbed > 1e-9));
    };
    Block b = make();
    // explicit steps of the other form do not bear nodes that are almost empty
    check_steps(*make_explicit_stepper(b.scene, Form::momentum), b, 1e-3);
    for (const ImplicitMethod method : {ImplicitMethod::paper, ImplicitMethod::midpoint}) {
        Block c = make();
        ImplicitOptions options{.scheme = {.method = method}};
        options.newton.tolerance = 1e-12;
        check_steps(*make_implicit_stepper(c.scene, options), c, 2e-3);
    }
}

} // namespace mpm_scenes
