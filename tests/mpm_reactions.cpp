// SPDX-License-Identifier: GPL-3.0-or-later
// What holds nodes: rigid bodies and sides, the forces on them, and the balances of momentum and energy that these close.
#include "messages.hpp"
#include "mpm_scenes.hpp"

#include <ductile/material/linear_elastic.hpp>
#include <ductile/mpm/contact_force.hpp>
#include <ductile/mpm/time_stepper.hpp>

#include <algorithm>
#include <array>

namespace mpm_reactions_suite {

using namespace mpm_scenes;

namespace {

struct Way {
    const char* name;
    std::function<std::unique_ptr<TimeStepper>(const Scene&)> make;
    double tolerance; // of the momentum balance: that of the step
    bool inertia = true;
    bool affine = false; ///< transfers

    /// The block with the transfers of this way, from affine fields that are not nothing.
    [[nodiscard]] Block prepared(Block b) const {
        b.scene.affine = affine;
        if (affine) {
            Particles& p = b.state.particles;
            p.provide_affine();
            for (std::size_t k = 0; k < 4; ++k) {
                const std::vector<double> c = random_vector(p.size(), 0.3, static_cast<unsigned>(31 + k));
                std::ranges::copy(c, p.affine[k].begin());
            }
        }
        return b;
    }
};

ImplicitOptions tight(const ImplicitScheme& scheme) {
    ImplicitOptions o{.scheme = scheme};
    o.newton.tolerance = 1e-12;
    o.newton.largest_linear_iterations = 200;
    return o;
}

std::vector<Way> all_ways() {
    const auto implicit_way = [](const char* name, const ImplicitScheme& scheme, bool affine = false) {
        return Way{name, [scheme](const Scene& scene) { return make_implicit_stepper(scene, tight(scheme)); }, 1e-7,
                   scheme.method != ImplicitMethod::quasi_static, affine};
    };
    return {{"explicit velocity", [](const Scene& scene) { return make_explicit_stepper(scene, Form::velocity); }, 1e-12},
            {"explicit momentum", [](const Scene& scene) { return make_explicit_stepper(scene, Form::momentum); }, 1e-12},
            implicit_way("implicit", {}),
            implicit_way("implicit momentum", {.form = Form::momentum}),
            implicit_way("mu = 0.7", {.mu = 0.7}),
            implicit_way("midpoint", {.method = ImplicitMethod::midpoint}),
            implicit_way("midpoint momentum", {.method = ImplicitMethod::midpoint, .form = Form::momentum}),
            Way{"explicit velocity, affine", [](const Scene& scene) { return make_explicit_stepper(scene, Form::velocity); },
                1e-12, true, true},
            implicit_way("implicit, affine", {}, true),
            implicit_way("midpoint, affine", {.method = ImplicitMethod::midpoint}, true),
            implicit_way("quasi-static", {.method = ImplicitMethod::quasi_static})};
}

std::array<double, 2> momentum(const Particles& p) {
    std::array<double, 2> sum{};
    for (std::size_t i = 0; i < p.size(); ++i) {
        sum[0] += p.mass[i] * p.velocity_x[i];
        sum[1] += p.mass[i] * p.velocity_y[i];
    }
    return sum;
}

/// A block of 0.8 x 0.4 m and 1000 kg/m^3 on a plate at rest, under gravity.
Block resting(ShapeFunction shape, Geometry geometry) {
    Block b{.scene = {.geometry = geometry,
                      .grid = {.cells_x = 12, .cells_y = 10, .width = 1.2, .height = 1.0},
                      .shape = shape,
                      .materials = {{linear_elastic_law(elasticity_from_young(1e7, 0.3))}},
                      .body_force =
                          [](std::int64_t, double, double, double) {
                              return std::array{0.0, -10.0};
                          }},
            .state = {}};
    const double left = geometry == Geometry::axisymmetric ? 0.0 : 0.2;
    b.scene.grid.sides.left = geometry == Geometry::axisymmetric ? SideCondition::slip : SideCondition::free;
    add_body(b.state.particles, {.shape = rectangle(left, 0.2, left + 0.8, 0.6), .density = 1000.0}, b.scene);
    b.state.rigid_bodies.push_back(make_rigid_body("plate", rectangle(0.0, 0.1, 1.2, 0.2), 2, b.scene.grid));
    return b;
}

/// A block that is strained and held by two sides and two rigid bodies that move, and pulled by a force of place and time.
Block held(ShapeFunction shape, Geometry geometry, const std::string& law) {
    Block b = strained_block(shape, geometry, law);
    b.scene.grid.sides.left = SideCondition::fixed;
    b.scene.body_force = [](std::int64_t, double x, double y, double time) {
        return std::array{3.0 + x - time, -10.0 + y + 5.0 * time};
    };
    for (double& x : b.state.particles.x)
        x = std::max(x - 0.18, 1e-3); // onto the fixed side
    b.state.rigid_bodies.push_back(make_rigid_body("plate", rectangle(0.2, 0.4, 0.8, 0.5), 2, b.scene.grid));
    b.state.rigid_bodies.push_back(make_rigid_body("wedge", rectangle(0.4, 0.1, 0.5, 0.2), 2, b.scene.grid));
    b.state.rigid_bodies[0].velocity = Velocity{0.0, -0.1};
    b.state.rigid_bodies[0].holds_x = false;
    b.state.rigid_bodies[1].velocity = Velocity{-0.2, 0.0};
    return b;
}

} // namespace

TEST_SUITE_BEGIN("mpm_reactions");

TEST_CASE("a block at rest weighs on its plate what it weighs, in every method, form, shape and geometry") {
    for (const ShapeFunction shape : all_shapes)
        for (const Geometry geometry : all_geometries) {
            CAPTURE(static_cast<int>(shape));
            CAPTURE(static_cast<int>(geometry));
            Block rest = resting(shape, geometry);
            const auto press = make_implicit_stepper(rest.scene, tight({.method = ImplicitMethod::quasi_static}));
            for (int n = 0; n < 4; ++n)
                REQUIRE(press->attempt(rest.state, 1.0, rest.state.time + 1.0).accepted);
            for (double* v : {rest.state.particles.velocity_x.data(), rest.state.particles.velocity_y.data()})
                std::fill_n(v, rest.state.particles.size(), 0.0);
            // 3200 N/m in the plane; of one radian, half the square of the radius in axisymmetry
            const double weight = geometry == Geometry::axisymmetric ? 0.5 * 0.8 * 0.8 * 0.4 * 1e4 : 3200.0;
            for (const Way& way : all_ways()) {
                CAPTURE(way.name);
                Block b = way.affine ? way.prepared(rest) : rest;
                if (way.affine)
                    for (auto& c : b.state.particles.affine)
                        std::ranges::fill(c, 0.0);
                const auto stepper = way.make(b.scene);
                REQUIRE(stepper->attempt(b.state, 1e-6, b.state.time + 1e-6).accepted);
                const auto force = contact_force(stepper->discretisation().nodes(), stepper->force(), 0);
                CHECK(force[1] == doctest::Approx(-weight).epsilon(1e-3));
                if (geometry != Geometry::axisymmetric)
                    CHECK(std::abs(force[0]) < 1e-6 * weight);
            }
        }
}

TEST_CASE("the momentum of all particles changes by body force and reactions, whatever happens inside") {
    for (const ShapeFunction shape : all_shapes)
        for (const Geometry geometry : all_geometries)
            for (const Way& way : all_ways()) {
                CAPTURE(static_cast<int>(shape));
                CAPTURE(static_cast<int>(geometry));
                CAPTURE(way.name);
                Block b = way.prepared(held(shape, geometry, "von Mises"));
                const auto stepper = way.make(b.scene);
                for (const double dt : {1e-4, 2e-4, 1e-4}) {
                    const std::array<double, 2> before = momentum(b.state.particles);
                    const Particles start = b.state.particles;
                    const double time = b.state.time;
                    REQUIRE(stepper->attempt(b.state, dt, b.state.time + dt).accepted);
                    const std::array<double, 2> after = momentum(b.state.particles);
                    const double at = std::string_view(way.name).starts_with("explicit")   ? time
                                      : std::string_view(way.name).starts_with("midpoint") ? time + 0.5 * dt
                                      : std::string_view(way.name) == "mu = 0.7"           ? time + 0.7 * dt
                                                                                           : time + dt;
                    std::array<double, 2> impulse{};
                    for (std::size_t p = 0; p < start.size(); ++p) {
                        const auto f = b.scene.body_force(0, start.x[p], start.y[p], at);
                        impulse[0] += start.mass[p] * f[0] * dt;
                        impulse[1] += start.mass[p] * f[1] * dt;
                    }
                    const ActiveNodes& nodes = stepper->discretisation().nodes();
                    double largest = std::abs(impulse[1]);
                    for (const std::int32_t holder :
                         {0, 1, static_cast<std::int32_t>(left_side), static_cast<std::int32_t>(bottom_side)}) {
                        const auto force = contact_force(nodes, stepper->force(), holder);
                        impulse[0] -= force[0] * dt;
                        impulse[1] -= force[1] * dt;
                        largest = std::max({largest, std::abs(force[0]) * dt, std::abs(force[1]) * dt});
                    }
                    CHECK(largest > 1e-6);
                    // hoop stress pushes outwards without a counterpart
                    for (const int c : {0, 1})
                        if (way.inertia && (c == 1 || geometry != Geometry::axisymmetric))
                            CHECK(std::abs(after[c] - before[c] - impulse[c]) <=
                                  way.tolerance * std::max(largest, std::abs(before[c])));
                        else if (!way.inertia && (c == 1 || geometry != Geometry::axisymmetric))
                            CHECK(std::abs(impulse[c]) <= way.tolerance * largest); // nothing accelerates
                }
            }
}

TEST_CASE("kinetic and internal energy change by the work done, less what the method is known to take, to round-off") {
    for (const ShapeFunction shape : all_shapes)
        for (const Geometry geometry : all_geometries)
            for (const char* law :
                 {"elastic", "von Mises", "Perzyna", "Drucker-Prager", "neo-Hookean", "Hencky von Mises", "Johnson-Cook"})
                for (const Way& way : all_ways()) {
                    CAPTURE(static_cast<int>(shape));
                    CAPTURE(static_cast<int>(geometry));
                    CAPTURE(law);
                    CAPTURE(way.name);
                    Block b = way.prepared(held(shape, geometry, law));
                    const auto stepper = way.make(b.scene);
                    double passed = 0.0, size = 0.0, lost = 0.0;
                    const auto energy = [&] {
                        const Energies e = energies_of(b.scene, b.state.particles);
                        return (way.inertia ? e.kinetic : 0.0) + e.internal;
                    };
                    const double start = energy();
                    for (const double dt : {1e-3, 2e-3, 1e-3}) {
                        const StepOutcome step = stepper->attempt(b.state, dt, b.state.time + dt);
                        REQUIRE(step.accepted);
                        passed += step.energies.body_work - step.energies.of_method;
                        size += std::abs(step.energies.body_work);
                        lost = std::max(lost, std::abs(step.energies.of_method));
                        for (const std::int32_t body : {0, 1}) {
                            const auto force = contact_force(stepper->discretisation().nodes(), stepper->force(), body);
                            const Velocity v = b.state.rigid_bodies[static_cast<std::size_t>(body)].velocity.after(0.0);
                            const double work = -dt * (force[0] * v.u + force[1] * v.v);
                            passed += work;
                            size += std::abs(work);
                        }
                    }
                    size = std::max(size, std::abs(energy() - start));
                    CHECK(size > 1e-4);
                    // with the consistent mass and a law in rate form the midpoint rule loses nothing
                    if (std::string_view(way.name) == "midpoint momentum" && !has_finite_strain(b.scene))
                        CHECK(lost < 1e-12 * size);
                    else
                        CHECK(lost > 1e-10);
                    CHECK(std::abs(energy() - start - passed) <= way.tolerance * size);
                }
}

TEST_CASE("what plastic flow dissipates is the internal energy that is not elastic, while strains are small") {
    for (const Geometry geometry : all_geometries)
        for (const char* law : {"elastic", "von Mises", "Perzyna", "neo-Hookean", "Hencky von Mises", "Johnson-Cook"}) {
            CAPTURE(static_cast<int>(geometry));
            CAPTURE(law);
            Block b = strained_block(ShapeFunction::linear, geometry, law);
            const auto stepper = make_implicit_stepper(b.scene, tight({}));
            const Energies start = energies_of(b.scene, b.state.particles);
            double dissipated = 0.0;
            for (int n = 0; n < 10; ++n) {
                const StepOutcome step = stepper->attempt(b.state, 2e-3, b.state.time + 2e-3);
                REQUIRE(step.accepted);
                dissipated += step.energies.dissipated;
            }
            const Energies end = energies_of(b.scene, b.state.particles);
            const double stored = end.strain - start.strain, worked = end.internal - start.internal;
            const bool flows = std::string_view(law) != "elastic" && std::string_view(law) != "neo-Hookean";
            CHECK((dissipated > 0.1 * std::abs(worked)) == flows);
            // a law at finite strain has an energy: nothing is left open
            const double open = has_finite_strain(b.scene) ? 1e-12 : 0.02;
            CHECK(std::abs(worked - stored - dissipated) < open * (std::abs(worked) + std::abs(stored)));
        }
}

TEST_CASE("a rigid body holds the nodes of its cells and no others, however many points it has") {
    for (const ShapeFunction shape : all_shapes)
        for (const int points : {1, 2, 3, 4, 6}) {
            CAPTURE(static_cast<int>(shape));
            CAPTURE(points);
            Block b = block(shape);
            b.state.rigid_bodies.push_back(make_rigid_body("plate", rectangle(0.3, 0.3, 0.5, 0.4), points, b.scene.grid));
            const auto discretisation = make_discretisation(b.scene);
            discretisation->prepare(b.state.particles, b.state.rigid_bodies);
            // 3 x 2 nodes at corners of cells; B-splines see one more beyond each edge
            CHECK(discretisation->nodes().holds.size() == 2 * (shape == ShapeFunction::bspline ? 4 * 3 : 3 * 2));
        }
}

TEST_CASE("rigid bodies that share nodes each get what they prescribe, in any order") {
    RigidBody floor{.name = "floor", .holds_x = false, .x = {0.25, 0.35, 0.45, 0.55}, .y = {0.15, 0.15, 0.15, 0.15}};
    RigidBody wall{
        .name = "wall", .velocity = Velocity{0.3, 0.0}, .holds_y = false, .x = {0.15, 0.15, 0.15}, .y = {0.15, 0.25, 0.35}};
    RigidBody lid = floor;
    lid.name = "lid";
    for (const ShapeFunction shape : all_shapes) {
        CAPTURE(static_cast<int>(shape));
        const auto forces = [&](const std::vector<RigidBody>& bodies) {
            Block b = block(shape);
            stress_randomly(b.scene, b.state.particles, 5.0);
            b.state.rigid_bodies = bodies;
            const auto stepper = make_explicit_stepper(b.scene, Form::momentum);
            REQUIRE(stepper->attempt(b.state, 1e-5, b.state.time + 1e-5).accepted);
            const ActiveNodes& nodes = stepper->discretisation().nodes();
            std::vector<std::array<double, 2>> all;
            for (std::size_t k = 0; k < bodies.size(); ++k)
                all.push_back(contact_force(nodes, stepper->force(), static_cast<std::int32_t>(k)));
            int both = 0;
            for (std::size_t n = 0; n < nodes.count(); ++n)
                if (nodes.prescribed[2 * n] && nodes.prescribed[2 * n + 1]) {
                    CHECK(nodes.velocity[2 * n] == 0.3);
                    CHECK(nodes.velocity[2 * n + 1] == 0.0);
                    ++both;
                }
            CHECK(both >= 1);
            return all;
        };
        const auto alone_floor = forces({floor, wall}), swapped = forces({wall, floor});
        CHECK(alone_floor[0] == swapped[1]);
        CHECK(alone_floor[1] == swapped[0]);
        CHECK(alone_floor[0][0] == 0.0); // it slips
        CHECK(alone_floor[1][1] == 0.0);
        CHECK(std::abs(alone_floor[0][1]) > 1e-3);
        CHECK(std::abs(alone_floor[1][0]) > 1e-3);
        // the lid is where the floor is: each bears half
        const auto shared = forces({lid, wall, floor});
        CHECK(shared[0][1] == doctest::Approx(0.5 * alone_floor[0][1]).epsilon(1e-12));
        CHECK(shared[2] == shared[0]);
        CHECK(shared[1] == alone_floor[1]);
    }
}

TEST_CASE("bodies and sides that prescribe different velocities to a node end the step with their names and the place") {
    const auto message = [](const std::vector<RigidBody>& bodies, SideCondition bottom) {
        Block b = block(ShapeFunction::linear);
        b.scene.grid.sides.bottom = bottom;
        for (double& y : b.state.particles.y)
            y -= 0.2;
        b.state.rigid_bodies = bodies;
        const auto stepper = make_explicit_stepper(b.scene, Form::momentum);
        return message_of<RunError>([&] { (void)stepper->attempt(b.state, 1e-5, b.state.time + 1e-5); });
    };
    const RigidBody upper{.name = "upper", .velocity = Velocity{0.0, -1.0}, .x = {0.25}, .y = {0.35}};
    const RigidBody lower{.name = "lower", .velocity = Velocity{0.0, 1.0}, .x = {0.25}, .y = {0.25}};
    const RigidBody along{.name = "along", .velocity = Velocity{2.0, 0.0}, .x = {0.25}, .y = {0.05}};
    for (const auto& bodies : {std::vector{upper, lower}, {lower, upper}}) {
        const std::string text = message(bodies, SideCondition::slip);
        CHECK(contains(text, "rigid body 'upper'"));
        CHECK(contains(text, "rigid body 'lower'"));
        CHECK(contains(text, "near (0.2, 0.3) m, at different velocities in y"));
    }
    CHECK(contains(message({along}, SideCondition::fixed), "'along' and the bottom side of the grid hold one node"));
    CHECK(message({along}, SideCondition::slip) == "nothing was thrown");
}

TEST_SUITE_END();

} // namespace mpm_reactions_suite
