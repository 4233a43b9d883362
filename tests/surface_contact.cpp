// SPDX-License-Identifier: GPL-3.0-or-later
// Contact with the surfaces of rigid bodies: gaps, forces, their derivative, energy, and closed forms with friction.
#include "messages.hpp"
#include "mpm_scenes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace surface_contact_suite {

using namespace mpm_scenes;

namespace {

using Point = std::array<double, 2>;

RigidBody with_surface(const Shape& shape, double friction = 0.0) {
    RigidBody body{.name = "tool", .x = {0.0}, .y = {0.0}, .surface = shape.outlines().front(), .friction = friction};
    return body;
}

/// The surface of the block's particles, and room for the friction of its rigid bodies.
void give_surface(Block& b, const Shape& shape) {
    b.scene.surface_contact = true;
    Particles& p = b.state.particles;
    p.surface = {};
    const Law& law = b.scene.materials[0].law;
    add_surface(p, 0, p.size(), shape, law->elasticity().alpha(), b.scene);
    for (std::size_t k = 0; k < b.state.rigid_bodies.size(); ++k)
        if (b.state.rigid_bodies[k].friction > 0.0)
            p.surface.provide_friction(k);
}

/// A block between tools: a floor that it lies on, one that turns, and a circle that moves down on it.
Block pressed(ShapeFunction shape, Geometry geometry, double friction, const std::string& law = "elastic") {
    Block b = block(shape, geometry, law);
    const Shape square = rectangle(0.2, 0.2, 0.6, 0.6);
    b.state.rigid_bodies = {with_surface(rectangle(0.0, 0.0, 0.8, 0.201), friction),
                            with_surface(disk(0.42, 0.69, 0.1), friction)};
    b.state.rigid_bodies[1].velocity = Velocity{0.02, -0.05};
    if (geometry != Geometry::axisymmetric) {
        b.state.rigid_bodies.push_back(with_surface(polygon({{0.595, 0.3}, {0.7, 0.25}, {0.75, 0.5}, {0.62, 0.48}}), friction));
        b.state.rigid_bodies[2].spin = 0.3;
        b.state.rigid_bodies[2].centre = {0.7, 0.4};
    }
    give_surface(b, square);
    return b;
}

double distance_to(const std::vector<Point>& corners, const Point& place) {
    double least = 1e300;
    for (std::size_t k = 0; k < corners.size(); ++k)
        for (int j = 0; j < 20000; ++j) {
            const Point &a = corners[k], &c = corners[(k + 1) % corners.size()];
            const double s = j / 20000.0;
            least = std::min(least, std::hypot(a[0] + s * (c[0] - a[0]) - place[0], a[1] + s * (c[1] - a[1]) - place[1]));
        }
    return least;
}

} // namespace

TEST_SUITE_BEGIN("surface_contact");

TEST_CASE("gaps, normals and curvatures are those of the figure, moved and turned") {
    const std::vector<Point> corners = {{0.0, 0.0}, {2.0, 0.0}, {2.0, 1.0}, {1.0, 0.4}, {0.0, 1.0}}; // a reentrant one
    for (const bool reversed : {false, true}) {
        std::vector<Point> order = corners;
        if (reversed)
            std::ranges::reverse(order);
        RigidBody body = with_surface(polygon(order));
        body.velocity = Velocity{0.3, -0.2};
        body.spin = 0.5;
        body.centre = {1.0, 0.5};
        const Pose pose = pose_of(body, 2.0);
        std::vector<Point> moved;
        for (const Point& corner : corners)
            moved.push_back(pose.place(body, corner));
        CHECK(moved[0][0] == doctest::Approx(1.0 + 0.6 - std::cos(1.0) + 0.5 * std::sin(1.0)));
        CHECK(moved[0][1] == doctest::Approx(0.5 - 0.4 - std::sin(1.0) - 0.5 * std::cos(1.0)));
        const Shape there = polygon(moved);
        for (const Point& at_start :
             {Point{0.5, 0.2}, {1.0, 0.3}, {0.97, 0.32}, {1.5, -0.3}, {-0.2, -0.1}, {2.2, 1.3}, {1.1, 0.7}}) {
            const Point place = pose.place(body, at_start);
            const Gap gap = gap_to(body, pose, place);
            CHECK(std::abs(gap.gap) == doctest::Approx(distance_to(moved, place)).epsilon(1e-6));
            CHECK((gap.gap < 0.0) == there(place[0], place[1]));
            // the gap grows along the normal, which turns along the tangent
            constexpr double h = 1e-6;
            const Point n = gap.normal, t = {-n[1], n[0]};
            CHECK(gap_to(body, pose, {place[0] + h * n[0], place[1] + h * n[1]}).gap - gap.gap ==
                  doctest::Approx(h).epsilon(1e-5));
            const Gap beside = gap_to(body, pose, {place[0] + h * t[0], place[1] + h * t[1]});
            CHECK((beside.normal[0] - n[0]) / h == doctest::Approx(gap.curvature * t[0]).epsilon(1e-4));
            CHECK((beside.normal[1] - n[1]) / h == doctest::Approx(gap.curvature * t[1]).epsilon(1e-4));
        }
        const Gap on = gap_to(body, pose, pose.place(body, {1.5, 0.0}));
        CHECK(std::abs(on.gap) < 1e-15);
        CHECK(on.normal[0] == doctest::Approx(std::sin(1.0)));
        CHECK(on.normal[1] == doctest::Approx(-std::cos(1.0)));
    }
    const RigidBody ball = with_surface(disk(1.0, 2.0, 0.5));
    const Gap within = gap_to(ball, {}, {1.3, 2.0}), outside = gap_to(ball, {}, {1.0, 3.0});
    CHECK(within.gap == doctest::Approx(-0.2));
    CHECK(within.normal[0] == 1.0);
    CHECK(within.curvature == doctest::Approx(1.0 / 0.3));
    CHECK(outside.gap == doctest::Approx(0.5));
    CHECK(outside.normal[1] == 1.0);
    CHECK(outside.curvature == doctest::Approx(1.0));
}

TEST_CASE("surface points lie on the edge, corners included, and stand for all of it") {
    for (const Geometry geometry : all_geometries) {
        Block b = block(ShapeFunction::gimp, geometry);
        const auto stiffness = [&](const Shape& shape) {
            b.state.particles.surface = {};
            add_surface(b.state.particles, 0, b.state.particles.size(), shape, 8.0, b.scene);
            double sum = 0.0;
            for (const double k : b.state.particles.surface.stiffness)
                sum += k;
            return sum;
        };
        const double size = 0.05;
        const bool axisymmetric = geometry == Geometry::axisymmetric;
        // sides, without the smaller of the two halves that meet at each corner
        const double around = axisymmetric ? 2.0 * 0.4 * 0.4 + 0.4 * 0.2 + 0.4 * 0.6 - 0.05 * (0.2 + 0.5875) : 1.5;
        CHECK(stiffness(rectangle(0.2, 0.2, 0.6, 0.6)) == doctest::Approx(8.0 / size * around));
        const Particles& p = b.state.particles;
        CHECK(p.surface.size() == 32);
        int corners = 0;
        for (std::size_t c = 0; c < p.surface.size(); ++c) {
            const std::size_t owner = p.surface.carrier(c);
            const double x = p.x[owner] + p.surface.x[c], y = p.y[owner] + p.surface.y[c];
            const bool beside = std::abs(x - 0.2) < 1e-12 || std::abs(x - 0.6) < 1e-12;
            const bool above = std::abs(y - 0.2) < 1e-12 || std::abs(y - 0.6) < 1e-12;
            CHECK((beside || above));
            corners += beside && above ? 1 : 0;
            CHECK(std::hypot(p.surface.x[c], p.surface.y[c]) < 0.04);
        }
        CHECK(corners == 4);
        // without a shape's outlines, the boxes of the particles have the same edge
        CHECK(stiffness(Shape([](double, double) { return true; })) == doctest::Approx(8.0 / size * around).epsilon(1e-12));
        // a hole has an edge, and what is taken away beyond the body has none
        if (!axisymmetric)
            CHECK(stiffness(rectangle(0.2, 0.2, 0.6, 0.6) - rectangle(0.3, 0.3, 0.4, 0.4) - rectangle(0.7, 0.2, 0.8, 0.4)) ==
                  doctest::Approx(8.0 / size * 1.8));
    }
}

TEST_CASE("at rest on a plane nothing acts; a little closer the force is that of a layer of particles; farther, none") {
    for (const ShapeFunction shape : all_shapes) {
        Block b = block(shape);
        b.state.rigid_bodies = {with_surface(rectangle(0.0, 0.0, 0.8, 0.2), 0.5)};
        give_surface(b, rectangle(0.2, 0.2, 0.6, 0.6));
        const auto discretisation = make_discretisation(b.scene);
        const auto force_with = [&](double way) {
            discretisation->prepare(b.state.particles, b.state.rigid_bodies, 0.0, 1.0);
            std::vector<double> velocity(discretisation->nodes().components(), 0.0), force(velocity.size());
            for (std::size_t c = 1; c < velocity.size(); c += 2)
                velocity[c] = -way;
            discretisation->force_after(b.state.particles, velocity, 1.0, force);
            double sum = 0.0, moment = 0.0;
            for (std::size_t c = 1; c < force.size(); c += 2) {
                sum += force[c];
                const int node = discretisation->nodes().lattice[c / 2];
                moment += force[c] * (node % discretisation->nodes().lattice_width);
            }
            return std::pair{sum, moment};
        };
        CHECK(std::abs(force_with(0.0).first) < 1e-12);
        CHECK(std::abs(force_with(-0.01).first) < 1e-12);
        const double modulus = b.scene.materials[0].law->elasticity().alpha();
        const auto [sum, moment] = force_with(0.001);
        CHECK(sum == doctest::Approx(modulus * 0.4 * 0.001 / 0.05));
        if (shape != ShapeFunction::bspline)             // whose nodes' coefficients lie elsewhere at the sides
            CHECK(moment / sum == doctest::Approx(4.0)); // of the middle, in cells
    }
}

TEST_CASE("the forces on the nodes and on the rigid bodies are opposite") {
    for (const ShapeFunction shape : all_shapes)
        for (const Geometry geometry : all_geometries)
            for (const bool midpoint : {false, true}) {
                Block b = pressed(shape, geometry, 0.4);
                const auto discretisation = make_discretisation(b.scene, midpoint);
                discretisation->prepare(b.state.particles, b.state.rigid_bodies, 0.0, 0.1);
                const std::size_t size = discretisation->nodes().components();
                const std::vector<double> velocity = random_vector(size, 0.05, 5);
                std::vector<double> force(size);
                discretisation->force_after(b.state.particles, velocity, 0.1, force);
                if (geometry != Geometry::axisymmetric) {
                    double x = 0.0, y = 0.0;
                    for (std::size_t c = 0; c < size; c += 2) {
                        x += force[c];
                        y += force[c + 1];
                    }
                    const std::vector<double> zero(size, 0.0);
                    (void)discretisation->advance(b.state.particles, {velocity, velocity, zero, false, 0.1, 1.0, velocity});
                    for (const auto& on_body : discretisation->surface_forces()) {
                        x += on_body[0];
                        y += on_body[1];
                        CHECK(std::hypot(on_body[0], on_body[1]) > 0.1);
                    }
                    CHECK(std::abs(x) < 1e-9);
                    CHECK(std::abs(y) < 1e-9);
                }
            }
}

TEST_CASE("surface points go with the body, and what moves along with it does not rub") {
    for (const ShapeFunction shape : all_shapes) {
        Block b = block(shape);
        b.state.rigid_bodies = {with_surface(rectangle(0.0, 0.0, 0.8, 0.201), 0.5)};
        b.state.rigid_bodies[0].velocity = Velocity{0.3, 0.0};
        give_surface(b, rectangle(0.2, 0.2, 0.6, 0.6));
        const auto discretisation = make_discretisation(b.scene);
        constexpr double dt = 0.01;
        discretisation->prepare(b.state.particles, b.state.rigid_bodies, 0.0, dt);
        const std::size_t size = discretisation->nodes().components();
        std::vector<double> velocity(size), force(size);
        const auto tangential_force = [&](double speed) {
            for (std::size_t c = 0; c < size; ++c)
                velocity[c] = c % 2 == 0 ? speed : 0.0;
            discretisation->force_after(b.state.particles, velocity, dt, force);
            double sum = 0.0;
            for (std::size_t c = 0; c < size; c += 2)
                sum += force[c];
            return sum;
        };
        CHECK(std::abs(tangential_force(0.3)) < 1e-9);
        CHECK(tangential_force(0.2) > 0.1);  // it is taken along
        CHECK(tangential_force(0.4) < -0.1); // it is held back

        if (shape == ShapeFunction::bspline)
            continue; // whose nodes' coefficients lie elsewhere at the sides
        // a field that is linear in space, which the offsets follow exactly
        const auto field = [](double x, double y) { return Point{0.2 * x - 3.0 * y, 2.5 * x + 0.4 * y}; };
        const ActiveNodes& nodes = discretisation->nodes();
        for (std::size_t n = 0; n < nodes.count(); ++n) {
            const Point v = field(nodes.lattice[n] % nodes.lattice_width * 0.1, nodes.lattice[n] / nodes.lattice_width * 0.1);
            velocity[2 * n] = v[0];
            velocity[2 * n + 1] = v[1];
        }
        const auto places = [&] {
            const Particles& p = b.state.particles;
            std::vector<Point> all(p.surface.size());
            for (std::size_t c = 0; c < all.size(); ++c)
                all[c] = {p.x[p.surface.carrier(c)] + p.surface.x[c], p.y[p.surface.carrier(c)] + p.surface.y[c]};
            return all;
        };
        const std::vector<Point> before = places();
        const std::vector<double> none(size, 0.0);
        (void)discretisation->advance(b.state.particles, {velocity, velocity, none, false, dt, 1.0, velocity});
        const std::vector<Point> after = places();
        for (std::size_t c = 0; c < before.size(); ++c) {
            const Point v = field(before[c][0], before[c][1]);
            CHECK(after[c][0] == doctest::Approx(before[c][0] + dt * v[0]).epsilon(1e-12));
            CHECK(after[c][1] == doctest::Approx(before[c][1] + dt * v[1]).epsilon(1e-12));
        }
    }
}

TEST_CASE(
    "the derivative agrees with difference quotients over four decades, sticking and slipping, on plane and round surfaces") {
    for (const ShapeFunction shape : all_shapes)
        for (const Geometry geometry : all_geometries)
            for (const double friction : {0.0, 0.2, 100.0})
                for (const std::string law : {"elastic", "Hencky von Mises"})
                    for (const ImplicitScheme scheme : {ImplicitScheme{.form = Form::velocity},
                                                        {.method = ImplicitMethod::midpoint},
                                                        {.form = Form::velocity, .mu = 0.7},
                                                        {.method = ImplicitMethod::quasi_static}}) {
                        CAPTURE(static_cast<int>(shape));
                        CAPTURE(static_cast<int>(geometry));
                        CAPTURE(friction);
                        CAPTURE(law);
                        CAPTURE(static_cast<int>(scheme.method));
                        Block b = pressed(shape, geometry, friction, law);
                        for (auto& held : b.state.particles.surface.held)
                            for (std::size_t c = 0; c < held.size(); ++c)
                                held[c] = 0.02 * std::sin(static_cast<double>(c));
                        MomentumBalance balance(b.scene, scheme);
                        balance.prepare(b.state, 0.1);
                        const auto errors = jacobian_errors(balance, 21);
                        CAPTURE(errors[0]);
                        CAPTURE(errors[1]);
                        CAPTURE(errors[4]);
                        CHECK(errors[4] < 1e-4);
                        CHECK(errors[4] < 0.01 * errors[0] + 2e-7);
                    }
}

TEST_CASE("the energy that passes in a step is all accounted for") {
    for (const ShapeFunction shape : all_shapes)
        for (const Geometry geometry : all_geometries)
            for (const double friction : {0.0, 0.01}) {
                CAPTURE(static_cast<int>(shape));
                CAPTURE(static_cast<int>(geometry));
                CAPTURE(friction);
                check_balance_of_contact([&] { return pressed(shape, geometry, friction); }, friction);
                CHECK_THROWS_WITH_AS(
                    (void)make_implicit_stepper(pressed(shape, geometry, friction).scene, {.scheme = {.form = Form::momentum}}),
                    doctest::Contains("--form velocity"), InputError);
            }
}

TEST_CASE(
    "what the nodes do against a plane is stored to the last joule by the midpoint rule, entering and leaving, or rubbed off") {
    for (const double friction : {0.0, 0.01})
        for (const double speed : {-0.3, -0.05, 0.02, 0.3}) { // towards the floor, out of it, off it
            CAPTURE(friction);
            CAPTURE(speed);
            Block b = block(ShapeFunction::bspline, Geometry::plane_strain, "neo-Hookean");
            b.state.rigid_bodies = {with_surface(rectangle(0.0, 0.0, 0.8, speed == -0.3 ? 0.199 : 0.201), friction)};
            give_surface(b, rectangle(0.2, 0.2, 0.6, 0.6));
            const double dt = 0.01;
            const auto touching = make_discretisation(b.scene, true);
            Scene without = b.scene;
            without.surface_contact = false;
            const auto alone = make_discretisation(without, true);
            Particles copy = b.state.particles;
            touching->prepare(b.state.particles, b.state.rigid_bodies, 0.0, dt);
            alone->prepare(copy, b.state.rigid_bodies, 0.0, dt);
            const std::size_t size = touching->nodes().components();
            std::vector<double> velocity = random_vector(size, 0.01, 8), force(size), inner(size);
            for (std::size_t c = 0; c < size; ++c)
                velocity[c] += c % 2 == 1 ? speed : 0.4;
            touching->force_after(b.state.particles, velocity, dt, force);
            alone->force_after(copy, velocity, dt, inner);
            double work = 0.0;
            for (std::size_t c = 0; c < size; ++c)
                work += dt * (force[c] - inner[c]) * velocity[c];
            const std::vector<double> zero(size, 0.0);
            const ParticleEnergies e = touching->advance(b.state.particles, {velocity, velocity, zero, false, dt, 1.0, velocity});
            CHECK(std::abs(e.in_contact) > 1e-5);
            CHECK((friction > 0.0) == (e.friction > 1e-9));
            const double lost = -(work + e.in_contact + e.friction); // to the stick before the slip
            if (friction == 0.0)
                CHECK(std::abs(lost) < 1e-12 * std::abs(e.in_contact));
            else
                CHECK((lost >= -1e-15 && lost < 0.02 * std::abs(e.friction) + 1e-15));
            CHECK(e.surface_work == 0.0);
        }
}

TEST_CASE("a block on a slope sticks below the angle of friction and slides above as Coulomb says, by every method") {
    constexpr double gravity = 10.0, friction = 0.4;
    for (const double angle : {0.3, 0.5}) { // the angle of friction is 0.381
        const auto run = [&](const std::string& method) {
            Block b{.scene = {.grid = {16, 6, 1.6, 0.6, 0.0, 0.0, {}},
                              .shape = ShapeFunction::bspline,
                              .materials = {{linear_elastic_law(elasticity_from_young(1e5, 0.2))}}},
                    .state = {}};
            const Shape brick = rectangle(0.2, 0.1, 0.6, 0.3);
            add_body(b.state.particles, {.shape = brick, .density = 100.0}, b.scene);
            b.state.rigid_bodies = {with_surface(rectangle(-1.0, -0.1, 3.0, 0.1), friction)};
            give_surface(b, brick);
            // load from nothing, so that it does not bounce
            b.scene.body_force = [=](std::int64_t, double, double, double t) {
                const double share = std::min(t / 0.05, 1.0);
                return std::array{gravity * std::sin(angle) * share, -gravity * std::cos(angle) * share};
            };
            const bool is_explicit = method == "explicit";
            const auto stepper =
                is_explicit
                    ? make_explicit_stepper(b.scene, Form::momentum)
                    : make_implicit_stepper(b.scene, {.scheme = {.method = method == "midpoint" ? ImplicitMethod::midpoint
                                                                                                : ImplicitMethod::paper}});
            const double dt = is_explicit ? 5e-4 : 2.5e-3;
            const auto speed = [&] {
                double sum = 0.0;
                for (const double v : b.state.particles.velocity_x)
                    sum += v;
                return sum / static_cast<double>(b.state.particles.size());
            };
            double at_begin = 0.0;
            const int steps = static_cast<int>(std::round(0.3 / dt));
            for (int n = 0; n < steps; ++n) {
                if (n == steps / 3)
                    at_begin = speed();
                REQUIRE(stepper->attempt(b.state, dt, b.state.time + dt).accepted);
            }
            return (speed() - at_begin) / 0.2;
        };
        const double expected = angle < std::atan(friction) ? 0.0 : gravity * (std::sin(angle) - friction * std::cos(angle));
        for (const std::string method : {"explicit", "implicit", "midpoint"}) {
            CAPTURE(method);
            CAPTURE(angle);
            CHECK(std::abs(run(method) - expected) < 0.01 * gravity * std::sin(angle) + 0.01 * expected);
        }
    }
}

TEST_CASE("Hertz: force and width of the contact of a cylinder with a plane, within 3 %") {
    constexpr double young = 1e6, poisson = 0.3, radius = 1.0, modulus = young / (1.0 - poisson * poisson);
    Block b{.scene = {.grid = {24, 24, 1.2, 1.2, 0.0, 0.0, {.left = SideCondition::slip, .bottom = SideCondition::slip}},
                      .shape = ShapeFunction::gimp,
                      .materials = {{linear_elastic_law(elasticity_from_young(young, poisson))}}},
            .state = {}};
    const Shape cylinder = disk(0.0, 0.0, radius);
    add_body(b.state.particles, {.shape = cylinder, .density = 1000.0}, b.scene);
    b.state.rigid_bodies = {with_surface(rectangle(-0.5, 1.0, 1.2, 1.1))};
    b.state.rigid_bodies[0].velocity = Velocity{0.0, -0.03};
    b.scene.surface_contact = true;
    add_surface(b.state.particles, 0, b.state.particles.size(), cylinder, 10.0 * elasticity_from_young(young, poisson).alpha(),
                b.scene);
    const auto stepper = make_implicit_stepper(b.scene, {.scheme = {.method = ImplicitMethod::quasi_static}});
    double work = 0.0, in_contact = 0.0;
    for (int n = 0; n < 20; ++n) {
        const StepOutcome outcome = stepper->attempt(b.state, 0.05, b.state.time + 0.05);
        REQUIRE(outcome.accepted);
        work += outcome.energies.surface_work;
        in_contact += outcome.energies.in_contact;
    }
    // by the force at the end of a step alone it would be 5 % more
    CHECK(work == doctest::Approx(energies_of(b.scene, b.state.particles).strain + in_contact).epsilon(0.015));

    double force = 0.0, moment = 0.0; // of the half that the grid holds
    const Particles& p = b.state.particles;
    const Pose pose = pose_of(b.state.rigid_bodies[0], b.state.time);
    for (std::size_t c = 0; c < p.surface.size(); ++c) {
        const std::size_t owner = p.surface.carrier(c);
        const Point at = {p.x[owner] + p.surface.x[c], p.y[owner] + p.surface.y[c]};
        const double f = p.surface.stiffness[c] * std::max(-gap_to(b.state.rigid_bodies[0], pose, at).gap, 0.0);
        force += f;
        moment += f * at[0] * at[0];
    }
    CHECK(stepper->discretisation().surface_forces()[0][1] == doctest::Approx(force).epsilon(1e-9));
    // the way of each half, 2 F/(pi E*) (ln(4 R/b) - 1/2), with b^2 = 4 F R/(pi E*); pressure sqrt(1 - x^2/b^2): <x^2> = b^2/4
    double low = 1.0, high = 1e6;
    for (int n = 0; n < 100; ++n) {
        const double middle = std::sqrt(low * high), width = std::sqrt(4.0 * middle * radius / (std::numbers::pi * modulus));
        (2.0 * middle / (std::numbers::pi * modulus) * (std::log(4.0 * radius / width) - 0.5) < 0.03 ? low : high) = middle;
    }
    CHECK(2.0 * force == doctest::Approx(low).epsilon(0.03));
    CHECK(2.0 * std::sqrt(moment / force) ==
          doctest::Approx(std::sqrt(4.0 * low * radius / (std::numbers::pi * modulus))).epsilon(0.03));
}

TEST_CASE("impossible surfaces are refused") {
    Block b = block(ShapeFunction::linear);
    const Shape square = rectangle(0.2, 0.2, 0.6, 0.6);
    const auto message = [&] { return message_of<InputError>([&] { check(b.scene, b.state.particles, b.state.rigid_bodies); }); };
    b.state.rigid_bodies = {with_surface(rectangle(0.0, 0.0, 0.8, 0.2), 0.5)};
    CHECK(contains(message(), "set Scene::surface_contact"));
    give_surface(b, square);
    CHECK(message() == "nothing was thrown");
    b.state.particles.surface.held.clear();
    CHECK(contains(message(), "no room for the friction"));
    give_surface(b, square);
    b.state.rigid_bodies[0].friction = -1.0;
    CHECK(contains(message(), "friction -1"));
    b.state.rigid_bodies[0].friction = 0.5;
    b.state.particles.surface.particle[3] = 1000;
    CHECK(contains(message(), "particle 1000"));
    give_surface(b, square);
    b.state.particles.surface.stiffness[3] = 0.0;
    CHECK(contains(message(), "stiffness positive"));
    give_surface(b, square);
    b.state.rigid_bodies[0].surface = rectangle(0.0, 0.0, 0.8, 0.25).outlines().front();
    CHECK(contains(message(), "0.5 cells within the surface"));
    b.state.rigid_bodies[0].surface = rectangle(0.0, 0.0, 0.8, 0.2).outlines().front();
    b.scene.grid.sides = {.left = SideCondition::periodic, .right = SideCondition::periodic};
    CHECK(contains(message(), "periodic"));
    b.scene.grid.sides = {};
    b.scene.geometry = Geometry::axisymmetric;
    b.state.rigid_bodies[0].spin = 1.0;
    CHECK(contains(message(), "spins"));
}

TEST_SUITE_END();

} // namespace surface_contact_suite
