// SPDX-License-Identifier: GPL-3.0-or-later
// The axis-aligned manufactured solution of Wallstedt & Guilkey (2008) on the unit square between slip walls: displacements
//   u = A sin(pi X) sin(c pi t), v = A sin(pi Y) sin(c pi t + pi),   c^2 = E/rho_0,
// stretch the axes by F = 1 + du/dX and G = 1 + dv/dY and turn nothing. The law integrates strain rates, so its stress is that of
// the logarithmic strains, sigma_xx = alpha ln F + beta ln G, where alpha = K + 4 mu/3 and beta = K - 2 mu/3. With the density
// rho_0/(F G), and G the same all along x, the momentum balance rho b = rho d2u/dt2 - d(sigma_xx)/dx asks for
//   b_x = d2u/dt2 - (F G/rho_0) alpha (dF/dX)/F^2,   and likewise in y.
// Errors are taken at c pi t = pi/2, when the displacement is largest.
#include "cases.hpp"
#include <ductile/material/linear_elastic.hpp>

#include <numbers>

namespace solutions {

namespace {

constexpr double pi = std::numbers::pi, young_modulus = 1e4, density = 1000.0;

struct AxisAligned {
    double amplitude;
    IsotropicElasticity elasticity = elasticity_from_young(young_modulus, 0.3);
    double wave = std::sqrt(young_modulus / density);

    [[nodiscard]] double displacement(double x, double time, double phase) const {
        return amplitude * std::sin(pi * x) * std::sin(wave * pi * time + phase);
    }
    [[nodiscard]] double stretch(double x, double time, double phase) const {
        return 1.0 + amplitude * pi * std::cos(pi * x) * std::sin(wave * pi * time + phase);
    }
    [[nodiscard]] double start_velocity(double x, double phase) const {
        return amplitude * wave * pi * std::sin(pi * x) * std::cos(phase);
    }
    /// Along x at (x, y), or along y with both places and both phases exchanged.
    [[nodiscard]] double force(double x, double y, double time, double phase, double other_phase) const {
        const double f = stretch(x, time, phase), g = stretch(y, time, other_phase);
        const double acceleration = -std::pow(wave * pi, 2) * displacement(x, time, phase);
        const double f_slope = -pi * pi * displacement(x, time, phase);
        return acceleration - g / density * elasticity.alpha() * f_slope / f;
    }
};

struct Errors {
    double displacement, stress; // root mean squares [m], [Pa]
    int crossed;
    std::vector<double> places; // x and y of all particles in turn, in the order of their numbers
};

Errors errors_of(ShapeFunction shape, bool midpoint, double amplitude, int cells, int per_side, int steps) {
    const AxisAligned exact{.amplitude = amplitude};
    Scene scene{.grid = {.cells_x = cells,
                         .cells_y = cells,
                         .width = 1.0,
                         .height = 1.0,
                         .sides = {SideCondition::slip, SideCondition::slip, SideCondition::slip, SideCondition::slip}},
                .shape = shape,
                .materials = {{linear_elastic_law(exact.elasticity)}},
                .finite_rotation = false};
    State state;
    Particles& p = state.particles;
    add_body(p, {.shape = rectangle(0.0, 0.0, 1.0, 1.0), .density = density, .particles_per_side = per_side}, scene);
    const Places start(p);
    for (std::size_t i = 0; i < p.size(); ++i) {
        p.velocity_x[i] = exact.start_velocity(start.x[i], 0.0);
        p.velocity_y[i] = exact.start_velocity(start.y[i], pi);
    }
    scene.body_force = [&](std::int64_t id, double, double, double time) {
        const auto i = static_cast<std::size_t>(id);
        return std::array{exact.force(start.x[i], start.y[i], time, 0.0, pi), exact.force(start.y[i], start.x[i], time, pi, 0.0)};
    };
    ImplicitOptions options{.scheme = {.method = ImplicitMethod::midpoint}, .solver = SolverKind::newton_cg};
    options.newton.tolerance = 1e-10;
    const auto stepper = midpoint ? make_implicit_stepper(scene, options) : make_explicit_stepper(scene, Form::momentum);
    const double end = 0.5 / exact.wave;
    advance(*stepper, state, end, steps);
    RootMeanSquare displacement, stress;
    std::vector<double> places(2 * p.size());
    for (std::size_t i = 0; i < p.size(); ++i) {
        const auto q = static_cast<std::size_t>(p.id[i]);
        const double x = start.x[q], y = start.y[q];
        places[2 * q] = p.x[i];
        places[2 * q + 1] = p.y[i];
        displacement.add(p.x[i] - x - exact.displacement(x, end, 0.0));
        displacement.add(p.y[i] - y - exact.displacement(y, end, pi));
        const double f = std::log(exact.stretch(x, end, 0.0)), g = std::log(exact.stretch(y, end, pi));
        const double alpha = exact.elasticity.alpha(), beta = exact.elasticity.beta();
        stress.add(p.stress_xx[i] - alpha * f - beta * g);
        stress.add(p.stress_yy[i] - alpha * g - beta * f);
    }
    return {displacement.value(), stress.value(), crossed(scene.grid, p, start), std::move(places)};
}

} // namespace

void manufactured(const std::filesystem::path& folder) {
    Table table(folder / "manufactured.csv",
                "method,amplitude_m,shape,cells,particles_per_side,steps,displacement_m,stress_Pa,crossed");
    const auto report = [&](bool midpoint, double amplitude, const auto& shape, int cells, int per_side, int steps) {
        const Errors e = errors_of(shape.second, midpoint, amplitude, cells, per_side, steps);
        table.row(midpoint ? "midpoint" : "explicit", amplitude, shape.first, cells, per_side, steps, e.displacement, e.stress,
                  e.crossed);
    };
    for (const bool midpoint : {false, true})
        for (const double amplitude : {0.01, 0.05}) {
            const int steps_a_cell = midpoint ? 4 : 8;
            for (const auto& shape : all_shapes)
                for (const int cells : {8, 16, 32, 64})
                    report(midpoint, amplitude, shape, cells, 3, steps_a_cell * cells);
        }
    for (const auto& shape : all_shapes) // what is due to the sums over particles in place of integrals
        for (const int per_side : {2, 4, 6})
            report(false, 0.05, shape, 32, per_side, 256);

    Table in_time(folder / "manufactured_steps.csv", "method,amplitude_m,steps,displacement_m,difference_m");
    for (const bool midpoint : {false, true})
        for (const double amplitude : {0.0005, 0.01, 0.05}) {
            std::vector<double> before;
            for (int steps = midpoint ? 4 : 32; steps <= 512; steps *= 2) { // explicit ones must be as short as this
                Errors e = errors_of(ShapeFunction::gimp, midpoint, amplitude, 16, 3, steps);
                RootMeanSquare difference;
                for (std::size_t i = 0; i < before.size(); ++i)
                    difference.add(e.places[i] - before[i]);
                if (!before.empty())
                    in_time.row(midpoint ? "midpoint" : "explicit", amplitude, steps, e.displacement, difference.value());
                before = std::move(e.places);
            }
        }
}

} // namespace solutions
