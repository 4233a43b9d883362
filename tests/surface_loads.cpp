// SPDX-License-Identifier: GPL-3.0-or-later
// Loads on the edges of bodies: resultants, what follows the body and what does not, derivative, energy, patch, closed form.
#include "messages.hpp"
#include "mpm_scenes.hpp"

#include <ductile/mpm/setup.hpp>

#include <cmath>
#include <numbers>
#include <string>

namespace surface_loads_suite {

using namespace mpm_scenes;

namespace {

const Shape square = rectangle(0.2, 0.2, 0.6, 0.6);

/// A block with this load on the sides of its edge that lie in a region.
Block loaded(ShapeFunction shape, Geometry geometry, const Load& load, const Shape& region, const std::string& law = "elastic") {
    Block b = block(shape, geometry, law);
    b.scene.loads = {load};
    add_loaded_sides(b.state.particles, 0, b.state.particles.size(), square, region, 0, b.scene);
    return b;
}

const Shape everywhere_in_grid = rectangle(0.0, 0.0, 0.8, 0.8), above = rectangle(0.0, 0.55, 0.8, 0.7),
            beside = rectangle(0.55, 0.0, 0.7, 0.8);

std::array<double, 2> sum_of(std::span<const double> force) {
    std::array<double, 2> sum{};
    for (std::size_t c = 0; c < force.size(); ++c)
        sum[c % 2] += force[c];
    return sum;
}

} // namespace

TEST_SUITE_BEGIN("surface_loads");

TEST_CASE("resultants: a pressure all around is none, on a side it is pressure times area, against the normal") {
    for (const ShapeFunction shape : all_shapes)
        for (const Geometry geometry : all_geometries) {
            CAPTURE(static_cast<int>(shape));
            CAPTURE(static_cast<int>(geometry));
            const bool axisymmetric = geometry == Geometry::axisymmetric;
            const auto resultant = [&](const Load& load, const Shape& region) {
                Block b = loaded(shape, geometry, load, region);
                const auto discretisation = make_discretisation(b.scene);
                discretisation->prepare(b.state.particles, {}, 0.5);
                std::vector<double> force(discretisation->nodes().components());
                discretisation->internal_force(b.state.particles, force);
                return sum_of(force);
            };
            const History<double> pressure({{0.0, 0.0}, {1.0, 6.0}}); // 3 Pa at 0.5 s
            const auto around = resultant({"p", pressure}, everywhere_in_grid);
            // in axisymmetry the hoop's share of a uniform pressure, p A in the plane, is left
            CHECK(around[0] == doctest::Approx(axisymmetric ? -3.0 * 0.4 * 0.4 : 0.0).epsilon(1e-12));
            CHECK(std::abs(around[1]) < 1e-12);
            const auto on_top = resultant({"p", pressure}, above);
            // the upper part of both sides lies in the region, too
            CHECK(on_top[1] == doctest::Approx(-3.0 * (axisymmetric ? 0.4 * 0.4 : 0.4)).epsilon(1e-12));
            const auto right = resultant({"p", pressure}, beside);
            CHECK(right[0] == doctest::Approx(-3.0 * (axisymmetric ? 0.6 * 0.4 : 0.4)).epsilon(1e-12));
            const auto pulled = resultant({"t", {}, History<Velocity>(Velocity{2.0, -1.0})}, rectangle(0.0, 0.59, 0.8, 0.7));
            CHECK(pulled[0] == doctest::Approx(2.0 * (axisymmetric ? 0.4 * 0.4 : 0.4)).epsilon(1e-12));
            CHECK(pulled[1] == doctest::Approx(-1.0 * (axisymmetric ? 0.4 * 0.4 : 0.4)).epsilon(1e-12));
        }
}

TEST_CASE("a pressure follows the edge where that turns and stretches, a traction does not; without a shape, boxes have edges") {
    for (const bool boxes : {false, true}) {
        Block b = block(ShapeFunction::gimp);
        b.scene.loads = {{"p", 3.0}, {"t", {}, History<Velocity>(Velocity{2.0, 0.0})}};
        const Shape region = rectangle(0.0, 0.59, 0.8, 0.7), shape = boxes ? Shape([](double, double) { return true; }) : square;
        add_loaded_sides(b.state.particles, 0, b.state.particles.size(), shape, region, 0, b.scene);
        add_loaded_sides(b.state.particles, 0, b.state.particles.size(), shape, region, 1, b.scene);
        const auto discretisation = make_discretisation(b.scene);
        constexpr double dt = 0.05;
        discretisation->prepare(b.state.particles, {}, 0.0, dt);
        const ActiveNodes& nodes = discretisation->nodes();
        std::vector<double> velocity(nodes.components()), force(velocity.size());
        for (std::size_t n = 0; n < nodes.count(); ++n) { // F = I + dt [[1, -2], [3, 1]]
            const double x = nodes.lattice[n] % nodes.lattice_width * 0.1, y = nodes.lattice[n] / nodes.lattice_width * 0.1;
            velocity[2 * n] = x - 2.0 * y;
            velocity[2 * n + 1] = 3.0 * x + y;
        }
        // the top side (-0.4, 0), with the outside on its right, becomes (-0.42, -0.06)
        const std::array<double, 2> expected = {-3.0 * -0.06 + 0.8, 3.0 * -0.42};
        const std::vector<double> none(velocity.size(), 0.0);
        Block without = block(ShapeFunction::gimp);
        const auto alone = make_discretisation(without.scene);
        alone->prepare(without.state.particles, {}, 0.0, dt);
        std::vector<double> inner(velocity.size());
        alone->force_after(without.state.particles, velocity, dt, inner);
        discretisation->force_after(b.state.particles, velocity, dt, force);
        const auto whole = sum_of(force), own = sum_of(inner);
        CHECK(whole[0] - own[0] == doctest::Approx(expected[0]).epsilon(1e-12));
        CHECK(whole[1] - own[1] == doctest::Approx(expected[1]).epsilon(1e-12));
        // and where the next step begins
        (void)discretisation->advance(b.state.particles, {velocity, velocity, none, false, dt, 1.0, velocity});
        (void)alone->advance(without.state.particles, {velocity, velocity, none, false, dt, 1.0, velocity});
        discretisation->prepare(b.state.particles, {}, dt, dt);
        alone->prepare(without.state.particles, {}, dt, dt);
        force.resize(discretisation->nodes().components());
        inner.resize(force.size());
        discretisation->internal_force(b.state.particles, force);
        alone->internal_force(without.state.particles, inner);
        const auto later = sum_of(force), own_later = sum_of(inner);
        CHECK(later[0] - own_later[0] == doctest::Approx(expected[0]).epsilon(1e-12));
        CHECK(later[1] - own_later[1] == doctest::Approx(expected[1]).epsilon(1e-12));
    }
}

TEST_CASE("the derivative agrees with difference quotients over four decades") {
    for (const ShapeFunction shape : all_shapes)
        for (const Geometry geometry : all_geometries)
            for (const ImplicitScheme scheme : {ImplicitScheme{.form = Form::velocity},
                                                {.form = Form::momentum},
                                                {.method = ImplicitMethod::midpoint},
                                                {.form = Form::velocity, .mu = 0.7},
                                                {.method = ImplicitMethod::quasi_static}}) {
                CAPTURE(static_cast<int>(shape));
                CAPTURE(static_cast<int>(geometry));
                CAPTURE(static_cast<int>(scheme.form));
                CAPTURE(static_cast<int>(scheme.method));
                Block b = loaded(shape, geometry, {"p", 800.0, History<Velocity>(Velocity{3.0, 4.0})}, everywhere_in_grid);
                MomentumBalance balance(b.scene, scheme);
                balance.prepare(b.state, 0.1);
                const auto errors = jacobian_errors(balance, 21);
                CAPTURE(errors[0]);
                CAPTURE(errors[1]);
                CAPTURE(errors[4]);
                CHECK(errors[4] < 1e-5);
                CHECK(errors[4] < 0.01 * errors[0] + 2e-7);
            }
}

TEST_CASE("the work of loads is all accounted for, and that of implicit steps is by the mean of both ends' forces") {
    for (const ShapeFunction shape : all_shapes)
        for (const Geometry geometry : all_geometries) {
            CAPTURE(static_cast<int>(shape));
            CAPTURE(static_cast<int>(geometry));
            const Load load{"p", History<double>({{0.0, 0.0}, {0.1, 40.0}}), History<Velocity>({{0.0, {}}, {0.1, {5.0, -10.0}}})};
            const auto check_steps = [&](TimeStepper& stepper, Block& b, double dt) {
                const StepBalance balance = balance_of_steps(stepper, b, dt);
                CHECK(std::abs(balance.load_work) > 1e-9);
                CHECK(std::abs(balance.open) < 1e-8 * balance.scale);
            };
            Block b = loaded(shape, geometry, load, above);
            const auto explicit_stepper = make_explicit_stepper(b.scene, Form::momentum);
            check_steps(*explicit_stepper, b, 2e-3);
            for (const ImplicitMethod method : {ImplicitMethod::paper, ImplicitMethod::midpoint}) {
                Block c = loaded(shape, geometry, load, above);
                ImplicitOptions options{.scheme = {.method = method}};
                options.newton.tolerance = 1e-12;
                const auto stepper = make_implicit_stepper(c.scene, options);
                check_steps(*stepper, c, 5e-3);
            }
        }
}

TEST_CASE("a uniform pressure makes a uniform stress: the patch, in one quasi-static step") {
    for (const ShapeFunction shape : {ShapeFunction::linear, ShapeFunction::gimp}) {
        for (const Geometry geometry : {Geometry::plane_strain, Geometry::axisymmetric}) {
            Block b{.scene = {.geometry = geometry,
                              .grid = {8, 8, 0.8, 0.8, 0.0, 0.0, {.left = SideCondition::slip, .bottom = SideCondition::slip}},
                              .shape = shape,
                              .materials = {{law_named("elastic")}},
                              .finite_rotation = false},
                    .state = {}};
            const Shape quarter = rectangle(0.0, 0.0, 0.4, 0.4);
            add_body(b.state.particles, {.shape = quarter, .density = 10.0}, b.scene);
            b.scene.loads = {{"p", History<double>({{0.0, 0.0}, {1.0, 1e-3}})}}; // at the end of the step
            add_loaded_sides(b.state.particles, 0, b.state.particles.size(), quarter, rectangle(0.01, 0.01, 0.8, 0.8), 0,
                             b.scene);
            ImplicitOptions options{.scheme = {.method = ImplicitMethod::quasi_static}};
            options.newton.tolerance = 1e-12;
            const auto stepper = make_implicit_stepper(b.scene, options);
            REQUIRE(stepper->attempt(b.state, 1.0, 1.0).accepted);
            const Particles& p = b.state.particles;
            for (std::size_t k = 0; k < p.size(); ++k) {
                CHECK(p.stress_xx[k] == doctest::Approx(-1e-3).epsilon(1e-5));
                CHECK(p.stress_yy[k] == doctest::Approx(-1e-3).epsilon(1e-5));
                CHECK(std::abs(p.stress_xy[k]) < 1e-8);
            }
        }
    }
}

TEST_CASE("impossible loads are refused") {
    Block b = loaded(ShapeFunction::gimp, Geometry::plane_strain, {"oil", 1.0}, above);
    const auto message = [&] { return message_of<InputError>([&] { check(b.scene, b.state.particles); }); };
    CHECK(message() == "nothing was thrown");
    b.scene.loads.push_back({"water", 1.0});
    CHECK(contains(message(), "the load 'water' acts on no edge"));
    b.scene.loads.clear();
    CHECK(contains(message(), "a load that the scene does not have"));
    b.scene.loads = {{"oil", 1.0}};
    b.state.particles.loaded.particle[0] = -1;
    CHECK(contains(message(), "particle -1"));
    b.state.particles.loaded.particle[0] = 0;
    b.state.particles.loaded.area[0] = NAN;
    CHECK(contains(message(), "finite"));
}

TEST_SUITE_END();

} // namespace surface_loads_suite
