// SPDX-License-Identifier: GPL-3.0-or-later
// A law that the library has never seen, in the scene of shear_band and in a billet, beside its ordinary differential equations.
#include "voce.hpp"
#include <ductile/mpm/options.hpp>
#include <ductile/quasistatic/options.hpp>
#include <ductile/sundials/erk.hpp>

#include <cmath>
#include <fmt/format.h>
#include <numeric>

using namespace ductile;
using own::Voce;

namespace {

/// Stress and accumulated shear after `duration` at a rate of the stress of `elastic(t) - plastic * D^pl(stress/magnitude)`.
double stress_by_ode(const Voce& law, double duration, const auto& elastic, double plastic, double magnitude) {
    std::vector<double> y{0.0, 0.0};
    sundials::ErkIntegrator integrator(
        [&](double t, std::span<const double> x, std::span<double> slope) {
            const double sbar = std::max(x[0] / magnitude, 1e-300), flow = law.rates(sbar, std::array{x[1]}).internal[0];
            slope[0] = elastic(t) - plastic * flow;
            slope[1] = flow;
        },
        2, {.relative_tolerance = 1e-10, .absolute_tolerance = 1e-12 * law.saturation, .largest_step = 1e-3 * duration});
    integrator.integrate(y, 0.0, duration);
    return y[0];
}

//! [grid]
/// Simple shear of the square between the walls, without inclusions: every cell is the same.
void shear() {
    using namespace quasistatic;
    Options options;
    options.cells = {16, 16};
    options.model = Model::reduced;
    options.material.plasticity = PlasticityChoice::perzyna;
    Scene scene = make_scene(options);
    const Voce voce{.first_yield = 1.0, .saturation = 1.4, .strain = 0.02, .rate = 2e-6};
    scene.law = make_law(scene.law->elasticity(), voce);
    auto space = make_space(options, scene);
    State state = initial_state(scene, *space, Field(16, 16));
    const auto stepper = make_time_stepper(options, scene, std::move(space));
    const double end = 35e4;
    for (int n = 0; n < 700; ++n)
        stepper->attempt(state, end / 700, (n + 1) * end / 700, [](const StepAttempt&) { return true; });
    const double mu = scene.law->elasticity().shear_modulus, rate = scene.walls.after(0.0).shear / (0.5 * scene.grid.height);
    const double expected = stress_by_ode(
        voce, end, [&](double) { return mu * rate; }, 2.0 * mu, 1.0);
    const double found = stepper->space().observe(state.cells).wall_traction;
    fmt::print("shear: traction {} of the first yield stress, agrees: {}\n", found > 1.2 ? "beyond 1.2" : "too small",
               std::abs(found / expected - 1.0) < 1e-4);
}
//! [grid]

//! [points]
/// A billet between smooth plates: uniaxial stress.
void press() {
    using namespace mpm;
    const double height = 15e-3, cell = 1e-3, speed = 1.0, end = 2.4e-4; // before the plate reaches new nodes
    const IsotropicElasticity steel = elasticity_from_young(200e9, 0.3);
    const Voce voce{.first_yield = 0.4e9, .saturation = 0.6e9, .strain = 0.01, .rate = 300.0};
    Scene scene{.geometry = Geometry::axisymmetric,
                .grid = {.cells_x = 14,
                         .cells_y = 17,
                         .width = 14 * cell,
                         .height = 17 * cell,
                         .sides = {.left = SideCondition::slip, .bottom = SideCondition::slip}},
                .materials = {{make_law(steel, voce)}}};
    State state;
    add_body(state.particles, {.shape = rectangle(0.0, 0.0, 10 * cell, height), .density = 7800.0}, scene);
    RigidBody plate = make_rigid_body("plate", rectangle(0.0, height, 14 * cell, 17 * cell), 2, scene.grid);
    plate.velocity = Velocity{0.0, -speed};
    plate.holds_x = false;
    state.rigid_bodies.push_back(plate);
    const auto stepper = make_implicit_stepper(scene, {.scheme = {.method = ImplicitMethod::quasi_static}});
    for (int n = 0; n < 80; ++n)
        if (const auto outcome = stepper->attempt(state, end / 80, (n + 1) * end / 80); !outcome.accepted)
            fmt::print("step {}: {}\n", n, outcome.reason);
    const double young = young_modulus(steel);
    const double expected = stress_by_ode(
        voce, end, [&](double t) { return young * speed / (height - speed * t); }, young * 2.0 / std::sqrt(3.0), std::sqrt(3.0));
    const auto& stress = state.particles.stress_yy;
    const double found = -std::accumulate(stress.begin(), stress.end(), 0.0) / static_cast<double>(stress.size());
    fmt::print("billet: stress {} the first yield stress, agrees: {}\n", found > 0.8e9 ? "far beyond" : "not beyond",
               std::abs(found / expected - 1.0) < 0.01);
}
//! [points]

} // namespace

int main() {
    shear();
    press();
}
