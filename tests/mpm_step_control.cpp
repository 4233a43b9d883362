// SPDX-License-Identifier: GPL-3.0-or-later
// Which steps are taken: ramps, contact, rigid travel, failures, Newton iterations.
#include <ductile/material/linear_elastic.hpp>
#include <ductile/mpm/discretisation.hpp>
#include <ductile/mpm/options.hpp>
#include <ductile/mpm/step_control.hpp>

#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>

namespace mpm_step_control_suite {

using namespace ductile;
using namespace ductile::mpm;

namespace {

const Grid grid{.cells_x = 8, .cells_y = 10, .width = 0.8, .height = 1.0};

/// A plate of two rows of points, 0.875 and 0.925 m high, that comes down at 1 m/s: a cell every 0.1 s, for the first time after
/// 0.075 s.
State scene() {
    State state;
    state.rigid_bodies.push_back(make_rigid_body("plate", rectangle(0.0, 0.85, 0.8, 0.95), 2, grid));
    state.rigid_bodies[0].velocity = Velocity{0.0, -1.0};
    return state;
}

constexpr double never = 1e300;

/// Takes a step as a run does.
StepControl::Step take(StepControl& control, State& state, int newton_iterations = 3, bool touching = false, double end = never) {
    const StepControl::Step step = control.next(state, end);
    move_rigid_bodies(state, step.dt);
    state.time = step.end;
    control.accepted(step, newton_iterations, std::vector<std::int64_t>(state.rigid_bodies.size(), touching ? 1 : 0));
    return step;
}

} // namespace

TEST_SUITE_BEGIN("mpm_step_control");

TEST_CASE("steps end where a rigid body reaches new nodes, and grow anew from the first contact") {
    State state = scene();
    StepControl control({.target = 0.03, .first = 0.01, .growth = 2.0, .grid = grid, .ends_at_contact = true});
    CHECK(take(control, state).limit == StepLimit::ramp);
    CHECK(take(control, state).dt == doctest::Approx(0.02));
    CHECK(take(control, state).limit == StepLimit::target);
    const StepControl::Step step = take(control, state, 3, true);
    CHECK(step.limit == StepLimit::contact);
    CHECK(step.dt == doctest::Approx(0.015));
    CHECK(step.planned == 0.03);
    CHECK(state.rigid_bodies[0].y.front() < 0.8);
    CHECK(state.rigid_bodies[0].y.front() > 0.8 - 1e-9);
    CHECK(control.next(state, never).dt == 0.01);

    // in contact only where a cell takes many steps, or less than two
    StepControl later({.target = 0.03, .first = 0.03, .grid = grid, .ends_at_contact = true});
    later.restore({.next = 0.03, .touching = {1}});
    StepControl fine({.target = 0.011, .first = 0.011, .grid = grid, .ends_at_contact = true});
    fine.restore({.next = 0.011, .touching = {1}});
    for (int n = 0; n < 3; ++n)
        CHECK(take(later, state, 3, true).dt == 0.03);
    for (int n = 0; n < 10 && take(fine, state, 3, true).limit != StepLimit::contact; ++n)
        CHECK(n < 1);
    CHECK(std::abs(state.rigid_bodies[0].y.front() - 0.7) < 1e-9);
    StepControl longest({.target = 0.5, .first = 0.5, .grid = grid, .ends_at_contact = true});
    longest.restore({.next = 0.5, .touching = {1}});
    for (int n = 1; n < 4; ++n) {
        CHECK(take(longest, state, 3, true).limit == StepLimit::contact);
        CHECK(std::abs(state.rigid_bodies[0].y.front() - (0.7 - 0.1 * n)) < 1e-8);
    }
}

TEST_CASE("of several rigid bodies the first event counts, and each has a first contact of its own") {
    for (const bool swapped : {false, true}) {
        State state = scene();
        RigidBody later = state.rigid_bodies[0];
        for (double& y : later.y)
            y += 5e-4; // its event comes so soon after the other's that a step could be stretched to it
        state.rigid_bodies.insert(swapped ? state.rigid_bodies.begin() : state.rigid_bodies.end(), later);
        StepControl control({.target = 0.08, .first = 0.08, .grid = grid, .ends_at_contact = true});
        CHECK(control.next(state, never).dt == doctest::Approx(0.075));
    }
    State state = scene(); // an anvil at rest that holds nodes from the beginning
    state.rigid_bodies.push_back({.name = "anvil", .x = {0.05}, .y = {0.05}});
    StepControl control({.target = 0.03, .first = 0.01, .growth = 10.0, .grid = grid, .ends_at_contact = true});
    control.restore({.next = 0.03, .touching = {0, 1}});
    for (int n = 0; n < 2; ++n)
        control.accepted(take(control, state), 3, std::vector<std::int64_t>{0, 1});
    const StepControl::Step step = control.next(state, never);
    CHECK(step.limit == StepLimit::contact);
    CHECK(step.first_contact);
}

TEST_CASE("at first contact the steps begin anew, but never longer than they were") {
    State state = scene();
    StepControl control({.target = 0.08, .first = 0.08, .grid = grid, .ends_at_contact = true, .many_newton_iterations = 20});
    CHECK(take(control, state, 25).limit == StepLimit::contact);
    CHECK(control.next(state, never).dt == doctest::Approx(0.7 * 0.08));
    CHECK(control.next(state, never).limit == StepLimit::newton_iterations);
}

TEST_CASE("from where a step ends at contact the body holds new nodes, with every shape function") {
    for (const ShapeFunction shape : {ShapeFunction::linear, ShapeFunction::gimp, ShapeFunction::bspline}) {
        CAPTURE(static_cast<int>(shape));
        const Scene scene{.grid = grid, .shape = shape, .materials = {{linear_elastic_law(elasticity_from_young(1000.0, 0.3))}}};
        State state;
        add_body(state.particles, {.shape = rectangle(0.2, 0.2, 0.6, 0.6), .density = 10.0}, scene);
        state.rigid_bodies.push_back(make_rigid_body("plate", rectangle(0.0, 0.85, 0.8, 0.95), 2, grid));
        state.rigid_bodies[0].velocity = Velocity{0.0, -1.0};
        Options options{.cell_size = 0.1, .shape = shape, .dt = "0.03", .duration = 1.0};
        StepControl control = make_step_control(options, scene, state);
        const auto discretisation = make_discretisation(scene);
        const auto touching = [&] {
            discretisation->prepare(state.particles, state.rigid_bodies);
            const auto& holds = discretisation->nodes().holds;
            return std::any_of(holds.begin(), holds.end(), [](const Hold& hold) { return hold.holder >= 0; });
        };
        StepControl::Step step;
        for (int n = 0; n < 30 && !touching(); ++n)
            step = take(control, state);
        CHECK(touching());
        CHECK(step.first_contact);
    }
}

TEST_CASE("a step a little longer than planned takes the place of a remainder") {
    State state = scene();
    StepControl control({.target = 0.0745, .first = 0.0745, .grid = grid, .ends_at_contact = true});
    CHECK(take(control, state).dt == doctest::Approx(0.075));
}

TEST_CASE("new nodes of bodies with several leading points, and for wider points") {
    RigidBody body{.name = "stair", .velocity = Velocity{2.0, 0.0}, .x = {0.05, 0.19}, .y = {0.55, 0.65}};
    NewNodes next = time_to_new_nodes(body, 0.0, grid, 0.0, 1e-9);
    CHECK(next.time == doctest::Approx(0.005)); // 0.01 m to the cell beyond 0.2 m
    CHECK(next.interval == doctest::Approx(0.05));
    body.y[0] = 0.65; // now one row: the first point follows into cells that the second leaves
    next = time_to_new_nodes(body, 0.0, grid, 0.0, 1e-9);
    CHECK(next.time == doctest::Approx(0.005));
    next = time_to_new_nodes(body, 0.0, grid, 0.25, 1e-9); // sees the nodes beyond a quarter of a cell before the edge
    CHECK(next.time == doctest::Approx(0.0125));
    body.velocity = Velocity{0.0, 0.0};
    CHECK(time_to_new_nodes(body, 0.0, grid, 0.0, 1e-9).time > 1e300);
}

TEST_CASE("no point of a surface turns by a cell in a step; knots of a spin end steps") {
    State state = scene();
    RigidBody& body = state.rigid_bodies[0];
    body.velocity = Velocity{};
    body.surface = rectangle(0.0, 0.85, 0.8, 0.95).outlines().front();
    body.centre = {0.4, 0.9};
    body.spin = History<double>({{0.0, 2.0}, {0.2, 2.0}, {0.2, 0.5}});
    StepControl control({.target = 1.0, .first = 1.0, .grid = grid, .ends_at_contact = true});
    const StepControl::Step step = take(control, state);
    CHECK(step.limit == StepLimit::rigid_travel);
    CHECK(step.dt == doctest::Approx(0.099 / (2.0 * std::hypot(0.4, 0.05))));
    const StepControl::Step next = take(control, state);
    CHECK(next.limit == StepLimit::history_knot);
    CHECK(state.time == 0.2);
    CHECK(take(control, state).dt == doctest::Approx(0.099 / (0.5 * std::hypot(0.4, 0.05))));
}

TEST_CASE("no rigid body travels a cell, a failure halves the step, and many Newton iterations shorten the next") {
    State state = scene();
    StepControl control({.target = 0.5, .first = 0.5, .growth = 1.2, .grid = grid, .many_newton_iterations = 20});
    const StepControl::Step step = control.next(state, never);
    CHECK(step.limit == StepLimit::rigid_travel);
    CHECK(step.dt == doctest::Approx(0.099));
    CHECK(control.failed(step));
    CHECK(control.next(state, never).dt == doctest::Approx(0.0495));
    CHECK(control.next(state, never).limit == StepLimit::failed_step);
    take(control, state, 3);
    CHECK(control.next(state, never).dt == doctest::Approx(1.2 * 0.0495));
    take(control, state, 15);
    CHECK(control.next(state, never).dt == doctest::Approx(1.2 * 0.0495));
    take(control, state, 21);
    CHECK(control.next(state, never).limit == StepLimit::newton_iterations);
    CHECK(control.next(state, never).dt == doctest::Approx(0.7 * 1.2 * 0.0495));
    int halvings = 0;
    while (control.failed(control.next(state, never)))
        ++halvings;
    CHECK(halvings > 20);
}

TEST_CASE("steps end at output times; the rest of a step that was cut follows, and then all is as without output") {
    State state;
    StepControl control({.target = 0.1, .first = 0.1, .grid = grid});
    for (const auto& [output, steps] : {std::pair{0.25, 3}, {0.3, 1}, {0.7, 4}, {0.70000000001, 1}}) {
        int taken = 0;
        StepControl::Step step;
        do {
            step = take(control, state, 3, false, output);
            ++taken;
            CHECK(step.lands == (taken == steps));
            CHECK((step.lands || step.dt == 0.1));
            REQUIRE(taken < 10);
        } while (!step.lands);
        CHECK(taken == steps);
        CHECK(state.time == output); // to the bit
        CHECK(step.limit == (steps == 4 ? StepLimit::target : StepLimit::end));
    }
    CHECK(control.next(state, never).dt == doctest::Approx(0.1)); // all but 1e-11 s of it
    state.time += control.next(state, never).dt;
    CHECK(state.time == doctest::Approx(0.8));

    // a ramp goes on from the step that was planned
    StepControl ramp({.target = 1.0, .first = 0.1, .growth = 2.0, .grid = grid});
    state.time = 0.0;
    CHECK(take(ramp, state, 3, false, 0.01).dt == doctest::Approx(0.01));
    CHECK(take(ramp, state, 3).dt == doctest::Approx(0.09));
    CHECK(ramp.next(state, never).dt == doctest::Approx(0.2));
    CHECK(ramp.next(state, never).limit == StepLimit::ramp);
    // many Newton iterations and failures shorten what follows, landing or not
    CHECK(take(ramp, state, 31, false, state.time + 0.01).dt == doctest::Approx(0.01));
    CHECK(ramp.next(state, never).dt == doctest::Approx(0.7 * 0.2));
    CHECK(ramp.failed(ramp.next(state, state.time + 0.01)));
    CHECK(ramp.next(state, never).dt == doctest::Approx(0.005));
}

TEST_CASE("sums of steps that miss an output time by round-off make no sliver of a step") {
    for (const double dt : {0.1, 0.24, 1.0 / 3.0, 1e-7, 9.5585e-8}) {
        State state;
        StepControl control({.target = dt, .first = dt, .grid = grid});
        const int count = 20'000;
        const double end = count * dt;
        int steps = 0;
        for (bool lands = false; !lands; ++steps)
            lands = take(control, state, 3, false, end).lands;
        CHECK(steps == count);
        CHECK(state.time == end);
    }
}

TEST_CASE("of an output time and a contact the earlier ends the step") {
    State state = scene(); // contact after 0.075 s
    StepControl control({.target = 0.08, .first = 0.08, .grid = grid, .ends_at_contact = true});
    StepControl::Step step = control.next(state, 0.05);
    CHECK(step.lands);
    CHECK(step.dt == doctest::Approx(0.05));
    CHECK_FALSE(step.first_contact);
    take(control, state, 3, false, 0.05);
    step = control.next(state, 0.09);
    CHECK_FALSE(step.lands);
    CHECK(step.limit == StepLimit::contact);
    CHECK(step.dt == doctest::Approx(0.025));
    CHECK(step.first_contact);
}

TEST_SUITE_END();

} // namespace mpm_step_control_suite
