// SPDX-License-Identifier: GPL-3.0-or-later
// Grids whose left and right sides are one: nothing knows where they meet.
#include "messages.hpp"
#include "mpm_scenes.hpp"

#include <ductile/mpm/contact_force.hpp>
#include <ductile/mpm/explicit_step.hpp>
#include <ductile/mpm/step_control.hpp>
#include <ductile/mpm/time_stepper.hpp>

#include <algorithm>
#include <numeric>

namespace mpm_periodic_suite {

using namespace mpm_scenes;

namespace {

constexpr Grid::Sides periodic_sides{.left = SideCondition::periodic, .right = SideCondition::periodic};
constexpr double cell = 0.1;

/// Seven cells wide and six high, filled but for a row above and a row below.
Block layer(ShapeFunction shape, const std::string& law) {
    Block b{
        .scene = {.grid = {7, 6, 7 * cell, 6 * cell, -0.3, 0.0, periodic_sides}, .shape = shape, .materials = {{law_named(law)}}},
        .state = {}};
    add_body(b.state.particles, {.shape = rectangle(-0.3, cell, 0.4, 5 * cell), .density = 10.0}, b.scene);
    return b;
}

/// To the right, and around.
void shift(Block& b, double distance) {
    const Grid& g = b.scene.grid;
    const auto move = [&](double& x) {
        x += distance;
        if (x > g.left + g.width)
            x -= g.width;
    };
    for (double& x : b.state.particles.x)
        move(x);
    for (RigidBody& body : b.state.rigid_bodies)
        for (double& x : body.x)
            move(x);
}

/// Disordered, stressed and in motion, pressed by a rigid body that is narrower than the grid.
Block busy_layer(ShapeFunction shape) {
    Block b = layer(shape, "von Mises");
    shake(b.state.particles, 0.02);
    for (double& x : b.state.particles.x)
        x = std::clamp(x, -0.299, 0.399);
    stress_randomly(b.scene, b.state.particles, 4.0);
    for (std::size_t p = 0; p < b.state.particles.size(); ++p) {
        b.state.particles.velocity_x[p] = 1.0 + b.state.particles.y[p];
        b.state.particles.velocity_y[p] = 0.2 * std::sin(20.0 * b.state.particles.x[p]);
    }
    b.state.rigid_bodies.push_back(make_rigid_body("plate", rectangle(-0.2, 0.5, 0.1, 0.6), 2, b.scene.grid));
    b.state.rigid_bodies[0].velocity = Velocity{0.7, -0.1};
    return b;
}

/// Largest difference of any array, particle by particle, over the array's largest value; places modulo the width.
double difference(const Block& a, const Block& b, double shifted) {
    const Particles &p = a.state.particles, &q = b.state.particles;
    std::vector<std::size_t> place(q.size());
    for (std::size_t n = 0; n < q.size(); ++n)
        place[static_cast<std::size_t>(q.id[n])] = n;
    const auto first = named_arrays(p), second = named_arrays(q);
    double worst = 0.0;
    for (std::size_t k = 0; k < first.size(); ++k) {
        double largest = 1e-300, most = 0.0;
        for (std::size_t n = 0; n < p.size(); ++n) {
            double d = (*second[k].second)[place[static_cast<std::size_t>(p.id[n])]] - (*first[k].second)[n];
            if (first[k].first == "x")
                d = std::remainder(d - shifted, a.scene.grid.width);
            most = std::max(most, std::abs(d));
            largest = std::max(largest, std::abs((*first[k].second)[n]));
        }
        worst = std::max(worst, most / largest);
    }
    return worst;
}

bool all_inside(const Block& b) {
    const Particles& p = b.state.particles;
    for (std::size_t n = 0; n < p.size(); ++n)
        if (!contains(b.scene.grid, p.x[n], p.y[n]))
            return false;
    return true;
}

ImplicitOptions implicit(ImplicitMethod method, PreconditionerKind preconditioner) {
    ImplicitOptions options{.scheme = {.method = method}, .solver = SolverKind::newton_gmres, .preconditioner = preconditioner};
    options.newton.tolerance = 1e-11;
    options.newton.largest_linear_iterations = 200;
    return options;
}

} // namespace

TEST_SUITE_BEGIN("mpm_periodic");

TEST_CASE("steps are the same wherever the sides meet") {
    const auto by = [](Block& b, const std::unique_ptr<TimeStepper>& stepper, double dt, int steps) {
        for (int n = 0; n < steps; ++n)
            REQUIRE(stepper->attempt(b.state, dt, b.state.time + dt).accepted);
        CHECK(all_inside(b));
    };
    for (const ShapeFunction shape : all_shapes)
        for (const int cells : {1, 3, 6}) {
            CAPTURE(static_cast<int>(shape));
            CAPTURE(cells);
            Block here = busy_layer(shape), there = busy_layer(shape);
            shift(there, cells * cell);
            Block now = here, then = there;
            by(now, make_explicit_stepper(now.scene, Form::momentum), 5e-4, 400); // particles cross two cells
            by(then, make_explicit_stepper(then.scene, Form::momentum), 5e-4, 400);
            CHECK(difference(here, now, 0.0) > 0.1);
            CHECK(difference(now, then, cells * cell) <= 1e-9);
            for (const auto preconditioner : {PreconditionerKind::diagonal, PreconditionerKind::tangent}) {
                now = here, then = there;
                by(now, make_implicit_stepper(now.scene, implicit(ImplicitMethod::paper, preconditioner)), 0.01, 15);
                by(then, make_implicit_stepper(then.scene, implicit(ImplicitMethod::paper, preconditioner)), 0.01, 15);
                CHECK(difference(now, then, cells * cell) <= 1e-7);
            }
        }
}

TEST_CASE("so they are for a body whose rim lies on the sides, where hat functions ask for the cell that has mass") {
    for (const double onto_edge : {0.025, -0.025}) {
        Block here = layer(ShapeFunction::linear, "elastic");
        here.state.particles = {};
        add_body(here.state.particles, {.shape = rectangle(0.0, 0.1, 0.1, 0.4), .density = 10.0}, here.scene);
        stress_randomly(here.scene, here.state.particles, 4.0);
        shift(here, onto_edge);
        const Block start = here;
        ExplicitStep(here.scene, Form::momentum).advance(here.state, 1e-3, 1e-3);
        for (int cells = 1; cells < 7; ++cells) {
            CAPTURE(cells);
            Block there = start;
            shift(there, cells * cell);
            ExplicitStep(there.scene, Form::momentum).advance(there.state, 1e-3, 1e-3);
            CHECK(difference(here, there, cells * cell) <= 1e-9);
        }
    }
}

TEST_CASE("a layer that nothing holds moves through the sides unstrained, and one under stress keeps its momentum") {
    for (const ShapeFunction shape : all_shapes) {
        CAPTURE(static_cast<int>(shape));
        Block free = layer(shape, "elastic");
        for (double& v : free.state.particles.velocity_x)
            v = 3.5;
        const Block start = free;
        ExplicitStep step(free.scene, Form::momentum);
        for (int n = 0; n < 200; ++n) // once around
            step.advance(free.state, 1e-3, free.state.time + 1e-3);
        CHECK(all_inside(free));
        CHECK(largest_stress(free.state.particles) <= 1e-9);
        for (const double v : free.state.particles.velocity_x)
            CHECK(v == doctest::Approx(3.5).epsilon(1e-12));
        const Particles& p = free.state.particles;
        for (std::size_t n = 0; n < p.size(); ++n)
            CHECK(std::abs(std::remainder(p.x[n] - start.state.particles.x[static_cast<std::size_t>(p.id[n])], 0.7)) <= 1e-12);

        Block busy = busy_layer(shape);
        busy.state.rigid_bodies.clear();
        const auto momentum = [](const Particles& q) {
            return std::array{std::inner_product(q.mass.begin(), q.mass.end(), q.velocity_x.begin(), 0.0),
                              std::inner_product(q.mass.begin(), q.mass.end(), q.velocity_y.begin(), 0.0)};
        };
        const auto before = momentum(busy.state.particles);
        ExplicitStep next(busy.scene, Form::velocity);
        for (int n = 0; n < 200; ++n)
            next.advance(busy.state, 5e-4, busy.state.time + 5e-4);
        const auto after = momentum(busy.state.particles);
        CHECK(after[0] == doctest::Approx(before[0]).epsilon(1e-12));
        CHECK(after[1] == doctest::Approx(before[1]).epsilon(1e-12).scale(before[0]));
    }
}

TEST_CASE("between two walls the shear stress is mu times the shear, and pushes them, however often they go around") {
    for (const ShapeFunction shape : all_shapes) {
        CAPTURE(static_cast<int>(shape));
        Block b{.scene = {.grid = {6, 5, 0.6, 0.5, -0.3, -0.25, periodic_sides},
                          .shape = shape,
                          .materials = {{law_named("elastic")}},
                          .finite_rotation = false},
                .state = {}};
        add_body(b.state.particles, {.shape = rectangle(-0.3, -0.25, 0.3, 0.25), .density = 10.0}, b.scene);
        for (const double side : {1.0, -1.0}) {
            RigidBody wall{.name = side > 0.0 ? "top" : "bottom", .velocity = Velocity{0.25 * side, 0.0}};
            for (int i = 0; i < 6; ++i) {
                wall.x.push_back(-0.25 + 0.1 * i);
                wall.y.push_back(0.25 * side);
            }
            CHECK(time_to_new_nodes(wall, 0.0, b.scene.grid, 0.0, 1e-9).time > 1e300);
            b.state.rigid_bodies.push_back(wall);
        }
        const auto stepper = make_implicit_stepper(b.scene, implicit(ImplicitMethod::quasi_static, PreconditionerKind::tangent));
        for (int n = 1; n <= 30; ++n) { // to a shear of 3: each wall goes once around and more
            // no particle comes to lie on an edge, where round-off would choose the hat functions' slope
            REQUIRE(stepper->attempt(b.state, 0.0987, b.state.time + 0.0987).accepted);
            const double tau = rubber.shear_modulus * b.state.time; // walls half a metre apart, at a quarter of a metre a second
            double worst = 0.0;
            for (std::size_t p = 0; p < b.state.particles.size(); ++p)
                worst = std::max({worst, std::abs(b.state.particles.stress_xy[p] - tau), std::abs(b.state.particles.stress_xx[p]),
                                  std::abs(b.state.particles.stress_yy[p])});
            CHECK(worst <= 1e-8 * tau);
            const auto force = contact_force(stepper->discretisation().nodes(), stepper->force(), 0);
            CHECK(force[0] == doctest::Approx(-0.6 * tau).epsilon(1e-8));
            CHECK(std::abs(force[1]) <= 1e-8 * tau);
        }
        CHECK(all_inside(b));
    }
}

TEST_CASE("a rigid body reaches new nodes across the sides, too") {
    const Grid grid{10, 10, 1.0, 1.0, 0.0, 0.0, periodic_sides};
    // into the first cells, which the second point leaves in one row and not in the other
    RigidBody body{.name = "stair", .velocity = Velocity{2.0, 0.0}, .x = {0.95, 0.05, 0.93}, .y = {0.55, 0.55, 0.65}};
    CHECK(time_to_new_nodes(body, 0.0, grid, 0.0, 1e-9).time == doctest::Approx(0.025)); // the second point
    body.x = {0.95, 0.05}, body.y = {0.55, 0.65};
    CHECK(time_to_new_nodes(body, 0.0, grid, 0.0, 1e-9).time == doctest::Approx(0.025));
    body.x = {0.01, 0.11, 0.21, 0.31, 0.41, 0.51, 0.61, 0.71, 0.81, 0.99}, body.y.assign(10, 0.55);
    body.velocity = Velocity{-2.0, 0.0};
    CHECK(time_to_new_nodes(body, 0.0, grid, 0.0, 1e-9).time > 1e300); // each into the cell of the one before
    body.x.pop_back(), body.y.pop_back();
    CHECK(time_to_new_nodes(body, 0.0, grid, 0.0, 1e-9).time == doctest::Approx(0.005));
}

TEST_CASE("a body that lies across the sides is in one piece, with the hole that it has") {
    Block b = layer(ShapeFunction::linear, "elastic");
    Particles& p = b.state.particles;
    p = {};
    add_body(p, {.shape = rectangle(-0.2, 0.1, 0.1, 0.4) - rectangle(-0.1, 0.2, 0.0, 0.3), .density = 10.0}, b.scene);
    for (const double distance : {0.0, 0.4}) {
        shift(b, distance);
        const Connectivity c = connectivity_of(b.scene.grid, p);
        CHECK(c.parts == 1);
        CHECK(c.holes == 1);
        CHECK(c.enclosed_empty_cells == 1);
    }
}

TEST_CASE("what cannot be periodic is refused, with what to do instead") {
    Block b = layer(ShapeFunction::bspline, "elastic");
    const auto refusal = [&](Grid grid, Geometry geometry) { return message_of<InputError>([&] { check(grid, geometry); }); };
    Grid grid = b.scene.grid;
    grid.left = 0.0;
    CHECK_NOTHROW(check(grid, Geometry::plane_stress));
    CHECK(contains(refusal(grid, Geometry::axisymmetric), "take plane strain"));
    grid.sides.right = SideCondition::free;
    CHECK(contains(refusal(grid, Geometry::plane_strain), "make both periodic, or none"));
    grid.sides = {.bottom = SideCondition::periodic, .top = SideCondition::periodic};
    CHECK(contains(refusal(grid, Geometry::plane_strain), "only left and right can be"));
    const auto narrow = [&](ShapeFunction shape, int cells) {
        Scene scene{
            .grid = {cells, 5, cells * cell, 0.5, 0.0, 0.0, periodic_sides}, .shape = shape, .materials = b.scene.materials};
        Particles particles;
        add_body(particles, {.shape = rectangle(0.0, 0.1, cells * cell, 0.4), .density = 1.0}, scene);
        return [=] { check(scene, particles); };
    };
    CHECK_NOTHROW(narrow(ShapeFunction::linear, 3)());
    CHECK_NOTHROW(narrow(ShapeFunction::gimp, 5)());
    CHECK(contains(message_of<InputError>(narrow(ShapeFunction::gimp, 4)), "must be 5 or more"));
}

TEST_SUITE_END();

} // namespace mpm_periodic_suite
