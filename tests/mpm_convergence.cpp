// SPDX-License-Identifier: GPL-3.0-or-later
// Orders of accuracy: a manufactured solution with particles that cross cells, and the midpoint rule in time.
#include "mpm_scenes.hpp"

#include <ductile/material/linear_elastic.hpp>
#include <ductile/mpm/explicit_step.hpp>
#include <ductile/mpm/time_stepper.hpp>

#include <algorithm>
#include <numbers>

namespace mpm_convergence_suite {

using namespace mpm_scenes;

namespace {

constexpr double pi = std::numbers::pi;

/// The axis-aligned solution of Wallstedt & Guilkey (2008) on the unit square: displacements
///   u = A sin(pi X) sin(c pi t), v = A sin(pi Y) sin(c pi t + pi)
/// stretch the axes by F = 1 + du/dX and G = 1 + dv/dY and turn nothing. The body force is what the stress P = tau_xx/F of the
/// undeformed area leaves open,
///   b_x = d2u/dt2 - (1/rho_0) (dP/dF) dF/dX,
/// with Hencky's tau_xx = alpha ln F + lambda ln G or the neo-Hookean one, mu (F^2 - 1) + lambda ln(F G). A stress in rate form,
/// whose strain increments are taken from the moving configuration, is a Cauchy stress of that size, sigma_xx = alpha ln F +
/// lambda ln G: there F G d(sigma_xx)/dF, G constant, takes the place of dP/dF.
struct AxisAligned {
    enum class Stress { rates, hencky, neo_hookean } stress = Stress::rates;
    double amplitude = 0.01, density = 1000.0;
    IsotropicElasticity elasticity = elasticity_from_young(1e4, 0.3);
    double wave = std::sqrt(1e4 / 1000.0);

    [[nodiscard]] double displacement(double x, double time, double phase) const {
        return amplitude * std::sin(pi * x) * std::sin(wave * pi * time + phase);
    }
    [[nodiscard]] double velocity(double x, double phase) const {
        return amplitude * wave * pi * std::sin(pi * x) * std::cos(phase);
    }
    [[nodiscard]] double force(double x, double y, double time, double phase, double other_phase) const {
        const double s = amplitude * pi * std::sin(wave * pi * time + phase), f = 1.0 + s * std::cos(pi * x);
        const double g = 1.0 + amplitude * pi * std::sin(wave * pi * time + other_phase) * std::cos(pi * y);
        const double lambda = elasticity.beta(), mu = elasticity.shear_modulus, alpha = elasticity.alpha();
        const double stiffness = stress == Stress::rates    ? f * g * alpha
                                 : stress == Stress::hencky ? alpha * (1.0 - std::log(f)) - lambda * std::log(g)
                                                            : mu * (1.0 + f * f) + lambda * (1.0 - std::log(f * g));
        const double acceleration = -std::pow(wave * pi, 2) * displacement(x, time, phase);
        return acceleration - stiffness / density * (-s * pi * std::sin(pi * x)) / (f * f);
    }
    [[nodiscard]] Law law() const {
        return stress == Stress::rates    ? linear_elastic_law(elasticity)
               : stress == Stress::hencky ? make_finite_law(Hencky(LinearElastic(elasticity)))
                                          : make_finite_law(NeoHookean(elasticity));
    }
};

/// Root mean square error of the displacement when it is largest, with n x n cells of nine particles each. The steps are so short
/// that their error does not count. `crossed` becomes the number of particles that are no longer in their first cell.
double error_of(const AxisAligned& exact, ShapeFunction shape, int n, int& crossed) {
    Scene scene{
        .grid = {n, n, 1.0, 1.0, 0.0, 0.0, {SideCondition::slip, SideCondition::slip, SideCondition::slip, SideCondition::slip}},
        .shape = shape,
        .materials = {{exact.law()}},
        .finite_rotation = exact.stress != AxisAligned::Stress::rates};
    State state;
    add_body(state.particles, {.shape = rectangle(0.0, 0.0, 1.0, 1.0), .density = exact.density, .particles_per_side = 3}, scene);
    Particles& p = state.particles;
    const std::vector<double> x0(p.x.begin(), p.x.end()), y0(p.y.begin(), p.y.end());
    for (std::size_t i = 0; i < p.size(); ++i) {
        p.velocity_x[i] = exact.velocity(x0[i], 0.0);
        p.velocity_y[i] = exact.velocity(y0[i], pi);
    }
    scene.body_force = [&](std::int64_t id, double, double, double time) {
        const auto i = static_cast<std::size_t>(id);
        return std::array{exact.force(x0[i], y0[i], time, 0.0, pi), exact.force(y0[i], x0[i], time, pi, 0.0)};
    };
    const double end = 0.5 / exact.wave; // the largest displacement
    const int steps = 8 * n;
    ExplicitStep step(scene, Form::momentum);
    for (int k = 0; k < steps; ++k)
        step.advance(state, end / steps, state.time + end / steps);
    double sum = 0.0;
    crossed = 0;
    for (std::size_t i = 0; i < p.size(); ++i) {
        const auto q = static_cast<std::size_t>(p.id[i]);
        crossed += std::floor(n * p.x[i]) != std::floor(n * x0[q]) || std::floor(n * p.y[i]) != std::floor(n * y0[q]) ? 1 : 0;
        sum += std::pow(p.x[i] - x0[q] - exact.displacement(x0[q], end, 0.0), 2) +
               std::pow(p.y[i] - y0[q] - exact.displacement(y0[q], end, pi), 2);
    }
    return std::sqrt(sum / (2.0 * static_cast<double>(p.size())));
}

/// The bar of the program vibrating_bar: its tip after a period, and its energy.
struct Vibration {
    double tip, energy_kept;
};
Vibration vibrate(ImplicitMethod method, int steps_a_period, int periods) {
    Scene scene{.grid = {27,
                         3,
                         27.0,
                         3.0,
                         0.0,
                         0.0,
                         {.left = SideCondition::slip, .bottom = SideCondition::slip, .top = SideCondition::slip}},
                .materials = {{linear_elastic_law(elasticity_from_young(100.0, 0.0))}},
                .finite_rotation = false};
    State state;
    Particles& p = state.particles;
    add_body(p, {.shape = rectangle(0.0, 0.0, 25.0, 3.0), .density = 1.0}, scene);
    for (std::size_t i = 0; i < p.size(); ++i)
        p.velocity_x[i] = 0.02 * std::sin(0.5 * pi * p.x[i] / 25.0);
    const double period = 4.0 * 25.0 / 10.0, start = *std::max_element(p.x.begin(), p.x.end());
    ImplicitOptions options{.scheme = {.method = method}, .solver = mpm::SolverKind::newton_cg};
    options.newton.tolerance = 1e-12;
    options.newton.largest_linear_iterations = 200;
    const auto stepper = make_implicit_stepper(scene, options);
    const auto energy = [&] {
        const Energies e = energies_of(scene, p);
        return e.kinetic + e.strain;
    };
    const double before = energy();
    for (int k = 0; k < steps_a_period * periods; ++k)
        REQUIRE(stepper->attempt(state, period / steps_a_period, state.time + period / steps_a_period).accepted);
    return {*std::max_element(p.x.begin(), p.x.end()) - start, energy() / before};
}

} // namespace

TEST_SUITE_BEGIN("mpm_convergence");

TEST_CASE("a manufactured solution: second order with GIMP and B-splines, and no convergence with hat functions") {
    int crossed = 0;
    const auto order = [&](ShapeFunction shape) {
        return 0.5 * std::log2(error_of({}, shape, 10, crossed) / error_of({}, shape, 40, crossed));
    };
    for (const ShapeFunction shape : {ShapeFunction::gimp, ShapeFunction::bspline}) {
        CAPTURE(static_cast<int>(shape));
        CHECK(order(shape) > 1.8);
        CHECK(crossed > 1000);
    }
    // the gradient of hat functions jumps under particles that cross cell edges: what finer cells gain is lost there
    CHECK(order(ShapeFunction::linear) < 0.5);
}

TEST_CASE("the midpoint rule is of second order in time and keeps energy; backward Euler damps") {
    const double exact = vibrate(ImplicitMethod::midpoint, 3200, 1).tip;
    const double coarse = vibrate(ImplicitMethod::midpoint, 25, 1).tip - exact,
                 fine = vibrate(ImplicitMethod::midpoint, 50, 1).tip - exact;
    CHECK(std::log2(std::abs(coarse / fine)) > 1.8);
    CHECK(std::abs(vibrate(ImplicitMethod::midpoint, 200, 10).energy_kept - 1.0) < 1e-3);
    CHECK(vibrate(ImplicitMethod::paper, 200, 10).energy_kept < 0.5);
}

TEST_CASE("laws at finite strain: a manufactured solution of second order in space") {
    int crossed = 0;
    // beyond such amplitudes the sum over particles is worse than the shape functions
    const AxisAligned hencky{.stress = AxisAligned::Stress::hencky},
        rubber_like{.stress = AxisAligned::Stress::neo_hookean, .amplitude = 0.02};
    const auto order = [&](const AxisAligned& exact, ShapeFunction shape) {
        return std::log(error_of(exact, shape, 8, crossed) / error_of(exact, shape, 24, crossed)) / std::log(3.0);
    };
    CHECK(order(hencky, ShapeFunction::gimp) > 1.8);
    CHECK(order(rubber_like, ShapeFunction::bspline) > 1.8);
    CHECK(crossed > 1000);
}

TEST_CASE("the midpoint rule follows stress in rate form through strain and rotation to second order") {
    // x = c + F (x_0 - c), F = R(0.8 t) (1 + t S): affine, so that every particle sees the same
    const auto deformation = [](double t) {
        const double c = std::cos(0.8 * t), s = std::sin(0.8 * t), xx = 1.0 + 0.2 * t, yy = 1.0 - 0.15 * t, xy = 0.1 * t;
        return std::array{c * xx - s * xy, c * xy - s * yy, s * xx + c * xy, s * xy + c * yy};
    };
    const auto over = [](const std::array<double, 4>& a, const std::array<double, 4>& b) { // a b^-1
        const double d = b[0] * b[3] - b[1] * b[2];
        return std::array{(a[0] * b[3] - a[1] * b[2]) / d, (a[1] * b[0] - a[0] * b[1]) / d, (a[2] * b[3] - a[3] * b[2]) / d,
                          (a[3] * b[0] - a[2] * b[1]) / d};
    };
    // the rates of Jaumann's law and of the energy in very many steps, by Heun's method
    const double lambda = rubber.beta(), mu = rubber.shear_modulus;
    const auto rate = [&](double t, const SymmetricTensor& s) {
        constexpr double h = 1e-5;
        const auto f = deformation(t), ahead = deformation(t + h), behind = deformation(t - h);
        std::array<double, 4> slope;
        for (std::size_t k = 0; k < 4; ++k)
            slope[k] = (ahead[k] - behind[k]) / (2.0 * h);
        const auto l = over(slope, f);
        const double w = 0.5 * (l[2] - l[1]), volumetric = lambda * (l[0] + l[3]);
        return SymmetricTensor{volumetric + 2.0 * mu * l[0] - 2.0 * w * s.xy, volumetric + 2.0 * mu * l[3] + 2.0 * w * s.xy,
                               volumetric, mu * (l[1] + l[2]) + w * (s.xx - s.yy)};
    };
    SymmetricTensor exact;
    constexpr int many = 20000;
    for (int n = 0; n < many; ++n) {
        const double dt = 1.0 / many;
        const SymmetricTensor first = rate(n * dt, exact), second = rate((n + 1) * dt, exact + dt * first);
        exact = exact + 0.5 * dt * (first + second);
    }
    const auto errors = [&](bool midpoint, Geometry geometry, int steps) {
        Block b = block(ShapeFunction::linear, geometry);
        const auto d = make_discretisation(b.scene, midpoint);
        for (int n = 0; n < steps; ++n) {
            const double dt = 1.0 / steps;
            d->prepare(b.state.particles, {});
            const auto step = over(deformation((n + 1) * dt), deformation(n * dt));
            std::vector<double> v(d->nodes().components()), none(v.size());
            for (std::size_t k = 0; k < d->nodes().count(); ++k) {
                const double x = 0.1 * (d->nodes().lattice[k] % d->nodes().lattice_width) - 0.4,
                             y = 0.1 * (d->nodes().lattice[k] / d->nodes().lattice_width) - 0.4;
                v[2 * k] = ((step[0] - 1.0) * x + step[1] * y) / dt;
                v[2 * k + 1] = (step[2] * x + (step[3] - 1.0) * y) / dt;
            }
            d->advance(b.state.particles, {v, v, none, false, dt, 1.0});
        }
        const Particles& p = b.state.particles;
        const SymmetricTensor off = stress_of(p, 7) - exact;
        const auto f = deformation(1.0);
        CHECK(10.0 / p.density[7] == doctest::Approx(f[0] * f[3] - f[1] * f[2]).epsilon(1e-12));
        return std::sqrt(contraction(off, off)) / mu;
    };
    const auto order = [&](bool midpoint) {
        return std::log2(errors(midpoint, Geometry::plane_strain, 16) / errors(midpoint, Geometry::plane_strain, 32));
    };
    CHECK(order(true) == doctest::Approx(2.0).epsilon(0.05));
    CHECK(order(false) == doctest::Approx(1.0).epsilon(0.1)); // the paper's way
    CHECK(errors(true, Geometry::plane_strain, 32) < 1e-4);
}

TEST_CASE("a disk spins by the midpoint rule and affine transfers without loss; increments lose what the grid does not see") {
    const auto spin = [](ShapeFunction shape, bool affine) {
        Scene scene{.grid = {16, 16, 1.6, 1.6, -0.8, -0.8, {}},
                    .shape = shape,
                    .materials = {{make_finite_law(NeoHookean(elasticity_from_young(1e6, 0.3)))}},
                    .affine = affine};
        State state;
        Particles& p = state.particles;
        add_body(p, {.shape = disk(0.0, 0.0, 0.6), .density = 1000.0}, scene);
        const double w = 1.0 / 0.6; // 1 m/s at the rim
        for (std::size_t i = 0; i < p.size(); ++i) {
            p.velocity_x[i] = -w * p.y[i];
            p.velocity_y[i] = w * p.x[i];
            if (affine) {
                p.affine[1][i] = -w;
                p.affine[2][i] = w;
            }
        }
        ImplicitOptions options{.scheme = {.method = ImplicitMethod::midpoint}};
        options.newton.tolerance = 1e-8;
        options.newton.largest_linear_iterations = 200;
        const auto stepper = make_implicit_stepper(scene, options);
        const auto energy = [&] {
            const Energies e = energies_of(scene, p);
            return e.kinetic + e.strain;
        };
        const double momentum = momenta_of(p).angular, start = energy(), dt = 2.0 * pi / w / 100.0;
        for (int k = 0; k < 100; ++k)
            REQUIRE(stepper->attempt(state, dt, state.time + dt).accepted);
        return std::array{momenta_of(p).angular / momentum - 1.0, energy() / start - 1.0};
    };
    for (const ShapeFunction shape : all_shapes) {
        CAPTURE(static_cast<int>(shape));
        const std::array affine = spin(shape, true), papers = spin(shape, false); // changes of momentum and energy
        CAPTURE(affine);
        CAPTURE(papers);
        CHECK(std::abs(affine[0]) < 5e-4);
        CHECK(std::abs(affine[1]) < 5e-4);
        CHECK(papers[0] < -0.01);
    }
}

TEST_SUITE_END();

} // namespace mpm_convergence_suite
