// SPDX-License-Identifier: GPL-3.0-or-later
#include "fields.hpp"
#include "messages.hpp"
#include <ductile/base/error.hpp>
#include <ductile/quasistatic/initial.hpp>
#include <ductile/quasistatic/schemes.hpp>
#include <ductile/quasistatic/step_control.hpp>
#include <ductile/space/space.hpp>

#include <cmath>
#include <doctest/doctest.h>
#include <vector>

namespace index_reduced_suite {

using namespace ductile;
using namespace ductile::quasistatic;

namespace {

constexpr double mu = 37.4 / 0.85, U = 2e-7;
constexpr const char* fused_schemes[] = {"ralston", "bogacki-shampine", "dormand-prince", "chebyshev"};

fields::Stepping stepper_for(const char* scheme, const Scene& scene, const State& start, const PassOptions& passes = {}) {
    return {make_stepper(scheme, scene, fields::space_for(scene), {.passes = passes}), start};
}

fields::Stepping sundials_for(const char* scheme, const Scene& scene, const State& start, double tolerance,
                              bool fixed_steps = false, const PassOptions& passes = {.largest = 10, .tolerance = 1e-11}) {
    return {make_stepper(scheme, scene, fields::space_for(scene),
                         {.passes = passes, .tolerance = tolerance, .fixed_steps = fixed_steps}),
            start};
}

State at_rest(const Scene& scene) {
    const RandomField rough{.mean = 0.033, .deviation = 0.0015, .correlation_length = 0.25, .seed = 5};
    return fields::initial_state(scene, initial_internal(scene.grid, rough, scene.law->variables()[0]));
}

/// A state that flows plastically everywhere and stays so: smooth in time, without the corner at yield.
State flowing(const Scene& scene) {
    State state = at_rest(scene);
    for (int j = 0; j < scene.grid.cells_y; ++j)
        for (int i = 0; i < scene.grid.cells_x; ++i)
            state.cells.stress.tau(i, j) = 1.1;
    fields::wrap(state.cells.stress.tau);
    return state;
}

State run(const char* scheme, const Scene& scene, const State& start, double duration, int steps,
          const PassOptions& passes = {}) {
    auto stepper = stepper_for(scheme, scene, start, passes);
    const double dt = duration / steps;
    for (int n = 1; n <= steps; ++n)
        stepper.advance(dt, start.time + n * dt);
    return stepper.state();
}

struct Distance {
    double stress = 0.0, internal = 0.0, velocity = 0.0;
};
Distance distance(const State& a, const State& b) {
    Distance d;
    const auto fa = fields::fields_of(a), fb = fields::fields_of(b);
    for (std::size_t k = 0; k < fa.size(); ++k) {
        double& target = k < 4 ? d.stress : k == 4 ? d.internal : d.velocity;
        target = std::max(target, fields::distance(*fa[k], *fb[k]) / (k > 4 ? U : 1.0));
    }
    return d;
}

} // namespace

TEST_SUITE("index_reduced") {
    TEST_CASE_FIXTURE(fields::OneThread,
                      "forward Euler on the method of lines is the first-order projection with Euler plasticity") {
        const Grid grid{17, 12, 2.0, 2.2};
        for (const Model model : {Model::reduced, Model::full}) {
            const Scene scene = fields::scene_on(grid, model, {U, 0.4 * U});
            // an equilibrated, plastic state with a velocity of its own
            const State start = fields::run(scene, Predictor::incremental, flowing(scene), 3000.0, 30);
            const double dt = 50.0;
            const State projected = fields::run(scene, Predictor::euler, start, start.time + dt, 1);

            State state = start;
            CellState rate(grid, 1), end(grid, 1);
            const auto space = fields::space_for(scene);
            MethodOfLines lines(scene, *space, {.largest = 1}); // one pass: spin and advection by v_n, as the projection has them
            lines.evaluate(state.cells, scene.walls.after(0.0), state.velocity, rate);
            CHECK(lines.solves() == 1);
            const std::array terms{Space::Term{&start.cells, 1.0}};
            space->combine(terms, {&rate, &state.velocity, dt}, end);
            state.cells = end;
            const Distance d = distance(state, projected);
            CHECK(d.stress < 1e-13);
            CHECK(d.internal < 1e-15);
            CHECK(d.velocity < 1e-9); // the projection divides a difference of stresses by dt
            CHECK(distance(state, start).stress > 1e-4);
        }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "the velocity passes contract, and stop when the contraction says so") {
        const Scene scene = fields::scene_on({16, 12, 2.0, 2.0}, Model::full, {U, 0.0});
        const State start = fields::run(scene, Predictor::incremental, flowing(scene), 5000.0, 20);
        const auto velocity_after = [&](const PassOptions& passes, RateReport& report) {
            State state = start;
            fields::space_for(scene)->add_affine({0.1 * U, 0.05 * U}, state.velocity); // a poor guess
            CellState rate(scene.grid, 1);
            const auto space = fields::space_for(scene);
            report = MethodOfLines(scene, *space, passes).evaluate(state.cells, scene.walls.after(0.0), state.velocity, rate);
            return state;
        };
        RateReport report;
        const State exact = velocity_after({.largest = 12, .tolerance = 1e-300}, report);
        CHECK(report.solves == 12);
        double previous = 0.0;
        for (int passes = 1; passes <= 4; ++passes) {
            const double error = distance(velocity_after({.largest = passes, .tolerance = 1e-300}, report), exact).velocity;
            if (passes > 1)
                CHECK(error < 0.08 * previous);
            previous = error;
        }
        for (const double tolerance : {1e-3, 1e-6, 1e-9}) {
            const State state = velocity_after({.largest = 12, .tolerance = tolerance}, report);
            CHECK(report.solves > 1);
            CHECK(report.solves < 9);
            CHECK(distance(state, exact).velocity < tolerance);
        }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "the schemes have their design order in stress and internal variable") {
        const Scene scene = fields::scene_on({8, 6, 2.0, 2.0}, Model::reduced, {U, 0.0});
        const State start = flowing(scene);
        const double duration = 8000.0;
        const State exact = run("dormand-prince", scene, start, duration, 640);
        for (const auto& [scheme, order, steps] :
             {std::tuple{"ralston", 2, 64}, {"bogacki-shampine", 3, 64}, {"dormand-prince", 5, 4}, {"chebyshev", 2, 64}}) {
            const Distance coarse = distance(run(scheme, scene, start, duration, steps), exact);
            const Distance fine = distance(run(scheme, scene, start, duration, 2 * steps), exact);
            const std::string name = scheme;
            CAPTURE(name);
            CHECK(fine.stress > 1e-13); // above round-off
            CHECK(std::abs(std::log2(coarse.stress / fine.stress) - order) < 0.35);
            CHECK(std::abs(std::log2(coarse.internal / fine.internal) - order) < 0.35);
            CHECK(std::log2(coarse.velocity / fine.velocity) > order - 0.35);
        }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "in the full model the schemes converge to one answer, with all terms at their order") {
        const Scene scene = fields::scene_on({12, 10, 2.0, 2.0}, Model::full, {U, 0.0});
        const State start = flowing(scene);
        const PassOptions tight{.largest = 10, .tolerance = 1e-12};
        const State exact = run("dormand-prince", scene, start, 4000.0, 400, tight);
        for (const char* scheme : {"ralston", "chebyshev"}) {
            const Distance coarse = distance(run(scheme, scene, start, 4000.0, 40, tight), exact);
            const Distance fine = distance(run(scheme, scene, start, 4000.0, 80, tight), exact);
            CHECK(std::abs(std::log2(coarse.stress / fine.stress) - 2.0) < 0.35);
            CHECK(fine.stress < 1e-5);
            CHECK(fine.internal < 1e-6);
        }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "stress stays in equilibrium to round-off through yield and localisation") {
        const Scene scene = fields::scene_on({24, 18, 2.0, 2.0}, Model::full, {U, 0.0});
        for (const char* scheme : fused_schemes) {
            auto stepper = stepper_for(scheme, scene, at_rest(scene));
            StepControl control(scene.grid, ErrorSteps{.tolerance = 1e-4, .order = 3});
            double worst = 0.0;
            VectorField force(scene.grid);
            int rejected = 0;
            while (stepper.state().time < 3e5) {
                const double now = stepper.state().time;
                const auto planned = control.next(now, 3e5);
                const auto step = StepControl::shortened(planned, now, stepper.limit_step(planned.dt));
                bool accepted = false;
                try {
                    accepted =
                        stepper.attempt(step.dt, step.end, [&](const StepAttempt& made) { return control.judge(step, made); })
                            .accepted;
                } catch (const RunError&) {
                    REQUIRE(control.retry_shorter(step));
                }
                if (!accepted) {
                    REQUIRE(++rejected < 100);
                    continue;
                }
                worst = std::max(worst, fields::equilibrium_residual(scene, stepper.state().cells, force));
            }
            CHECK(worst < 1e-12);
            CHECK(stepper.state().time == 3e5);
            CHECK(stepper.state().step < 400);
            CHECK(fields::observe(scene, stepper.state().cells).plastic_fraction > 0.5);
        }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "a refused attempt leaves no trace in the state, nor in the stepper for other states") {
        const Scene scene = fields::scene_on({12, 9, 2.0, 2.0}, Model::full, {U, 0.0});
        for (const char* scheme : {"ralston", "bogacki-shampine", "dormand-prince", "chebyshev", "auto", "arkode-3", "euler",
                                   "substepped", "incremental", "extrapolated"}) {
            CAPTURE(scheme);
            auto plain = stepper_for(scheme, scene, flowing(scene));
            const auto disturbed = make_stepper(scheme, scene, fields::space_for(scene), {});
            State state = flowing(scene), other = at_rest(scene);
            const auto step = [&](State& s, double dt, bool accepted) {
                return disturbed->attempt(s, dt, s.time + dt, [=](const StepAttempt&) { return accepted; });
            };
            for (int n = 1; n <= 4; ++n) {
                plain.advance(100.0, 100.0 * n);
                (void)disturbed->limit_step(state, 100.0); // finds the velocity of the initial state
                disturbed->adopt(state);
                State before = state;
                const auto unchanged = [&] {
                    const auto now = named_fields(scene, state), then = named_fields(scene, before);
                    CHECK(now.size() == then.size());
                    for (std::size_t k = 0; k < now.size(); ++k)
                        CHECK(fields::same_bits(*now[k].second, *then[k].second));
                    CHECK(state.memory.numbers == before.memory.numbers);
                    CHECK(state.step == before.step);
                };
                CHECK(!step(state, 2500.0, false).accepted);
                unchanged();
                const auto fail = [](const StepAttempt&) -> bool { throw RunError("no"); };
                CHECK_THROWS_AS((void)disturbed->attempt(state, 150.0, state.time + 150.0, fail), RunError);
                unchanged();
                CHECK(step(other, 70.0, true).accepted);
                CHECK(step(state, 100.0, true).accepted);
                CHECK(fields::same_bits(state, plain.state()));
                CHECK(state.memory.numbers == plain.state().memory.numbers);
            }
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread,
                      "what lies within a step is in equilibrium, has its own velocity, and is as good as its end") {
        for (const Model model : {Model::reduced, Model::full}) {
            Scene scene = fields::scene_on({8, 7}, model, {U, 0.0});
            scene.walls = {
                {WallControl::By::velocity, History<double>(std::vector<History<double>::Knot>{{0.0, U}, {4e4, 3.0 * U}})}, {}};
            const State start = flowing(scene);
            const double dt = 4e3, time = 0.4 * dt;
            const PassOptions passes{.largest = 10, .tolerance = 1e-12};
            const State within = run("dormand-prince", scene, start, time, 40, passes);
            const State end = run("dormand-prince", scene, start, dt, 100, passes);
            for (const Scheme& scheme : schemes()) {
                CAPTURE(scheme.name);
                CAPTURE(static_cast<int>(model));
                const bool fused = scheme.kind == SchemeKind::index_reduced, projected = scheme.kind == SchemeKind::projection;
                const SchemeOptions options{
                    .passes = passes, .tolerance = 1e-5, .fixed_steps = scheme.steps == Scheme::Steps::fixed};
                const auto stepper = make_stepper(scheme.name, scene, fields::space_for(scene), options);
                State state = start, alone = start;
                std::vector<State> shown;
                const auto show = [&](const State& at) { shown.push_back(at); };
                const auto accept = [](const StepAttempt&) { return true; };
                // the second step has a past, which some schemes make use of
                (void)stepper->attempt(state, 0.1 * dt, 0.1 * dt, accept);
                const StepAttempt made = stepper->attempt(state, 0.9 * dt, dt, accept, {std::array{0.2 * dt, time}, show});
                REQUIRE(made.accepted);
                REQUIRE(shown.size() == 2);
                const State& at = shown[1];
                CHECK(shown[0].time == 0.2 * dt);
                CHECK(at.time == time);
                const auto other = make_stepper(scheme.name, scene, fields::space_for(scene), options);
                (void)other->attempt(alone, 0.1 * dt, 0.1 * dt, accept);
                (void)other->attempt(alone, 0.9 * dt, dt, accept);
                CHECK(fields::same_bits(alone, state)); // whether it is looked at or not
                const State before = state;
                const auto fail = [](const State&) { throw RunError("the disk is full"); };
                CHECK(message_of<RunError>([&] {
                          (void)stepper->attempt(state, dt, 2.0 * dt, accept, {std::array{1.5 * dt}, fail});
                      }) == "the disk is full");
                CHECK(fields::same_bits(before, state)); // the step is not made
                const auto refuse = [](const StepAttempt&) { return false; };
                CHECK(!stepper->attempt(state, dt, 2.0 * dt, refuse, {std::array{1.2 * dt, 1.5 * dt}, show}).accepted);
                const auto break_off = [](const StepAttempt&) -> bool { throw RunError("interrupted"); };
                CHECK_THROWS_AS((void)stepper->attempt(state, dt, 2.0 * dt, break_off, {std::array{1.5 * dt}, show}), RunError);
                CHECK(shown.size() == 2); // so that nothing is shown twice when it is made again
                CHECK(fields::same_bits(before, state));
                VectorField force = stepper->space().make_velocity();
                CHECK(stepper->space().equilibrium_residual(at.cells.stress, force) < (scheme.name == "ida" ? 1e-6 : 1e-12));
                const Distance here = distance(at, within), there = distance(state, end);
                CHECK(there.stress > 1e-12);
                const double allowed = projected ? 0.0 // SUNDIALS and its cubics may be off by the tolerance
                                       : !fused  ? options.tolerance
                                       : scheme.name == "dormand-prince" ? 1e-7
                                                                         : 0.1 * made.error;
                CHECK(here.stress < 2.0 * there.stress + allowed);
                CHECK(here.internal < 2.0 * there.internal + allowed);
                CHECK(here.velocity < 2.0 * there.velocity + allowed);
                if (!projected) // there v belongs to the middle of the step
                    CHECK(at.velocity.u(0, scene.grid.cells_y) == doctest::Approx(1.08 * U).epsilon(1e-12));
                CHECK(std::abs(at.cells.energy.work - within.cells.energy.work) <
                      2.0 * std::abs(state.cells.energy.work - end.cells.energy.work) + allowed);
            }
        }
    }

    TEST_CASE("a tolerance below 1e-3 asks more of the steps of a method whose runs forgive less") {
        for (const char* name : {"auto", "ralston", "bogacki-shampine", "dormand-prince"})
            for (const double tolerance : {1e-2, 1e-4, 1e-8})
                CHECK(step_tolerance(scheme_named(name), tolerance) == tolerance);
        const Scheme& chebyshev = scheme_named("chebyshev");
        CHECK(step_tolerance(chebyshev, 1e-2) == 1e-2);
        CHECK(step_tolerance(chebyshev, 1e-3) == 1e-3);
        CHECK(step_tolerance(chebyshev, 1e-5) == doctest::Approx(1e-6).epsilon(1e-12)); // (1e-2)^(3/2) of 1e-3
    }

    TEST_CASE_FIXTURE(fields::OneThread, "the memory of another scheme is nothing to a stepper") {
        const Scene scene = fields::scene_on({8, 6, 2.0, 2.0}, Model::full, {U, 0.0});
        auto earlier = stepper_for("extrapolated", scene, flowing(scene));
        earlier.advance(100.0, 100.0);
        earlier.advance(100.0, 200.0);
        State with = earlier.state(), bare = earlier.state();
        bare.memory = {};
        for (State* state : {&with, &bare})
            (void)make_stepper("ralston", scene, fields::space_for(scene), {})
                ->attempt(*state, 100.0, 300.0, [](const StepAttempt&) { return true; });
        CHECK(fields::same_bits(with, bare));
        CHECK(with.memory.scheme == "ralston");
        CHECK(with.memory.numbers == bare.memory.numbers);
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "a step ends where the first cell yields") {
        const Scene scene = fields::scene_on({9, 8, 2.0, 2.0}, Model::reduced, {U, 0.0});
        auto stepper = stepper_for("bogacki-shampine", scene, at_rest(scene));
        const double yield_time = 1.0 / (mu * U); // sbar = mu U t
        CHECK(stepper.limit_step(0.9 * yield_time) == 0.9 * yield_time);
        CHECK(stepper.limit_step(3.0 * yield_time) == doctest::Approx(yield_time).epsilon(1e-8));
        stepper.advance(0.25 * yield_time, 0.25 * yield_time);
        CHECK(stepper.limit_step(yield_time) == doctest::Approx(0.75 * yield_time).epsilon(1e-8));
        const double dt = stepper.limit_step(yield_time);
        stepper.advance(dt, 0.25 * yield_time + dt);
        CHECK(stepper.limit_step(1000.0) == 1000.0); // beyond yield nothing limits it
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "a closed elastic cycle with jumps of the wall velocity returns to zero stress") {
        Scene scene = fields::scene_on({8, 7, 2.0, 2.0}, Model::reduced, {});
        const double T = 3e4;
        const WallHistory history(
            {{0.0, {U, 0.5 * U}}, {T, {U, 0.5 * U}}, {T, {-U, -0.5 * U}}, {1.5 * T, {-U, -0.5 * U}}, {2.5 * T, {0.0, 0.0}}});
        scene.walls = moving(history);
        for (const char* scheme : fused_schemes) {
            auto stepper = stepper_for(scheme, scene, at_rest(scene));
            double time = 0.0;
            for (const double end : {0.6 * T, T, 1.2 * T, 1.5 * T, 2.0 * T, 2.5 * T, 3.0 * T}) {
                stepper.advance(end - time, end);
                time = end;
                fields::check_uniform(stepper.state().cells.stress.tau, mu * history.displacement(end).u, 1e-13);
            }
            CHECK(std::abs(history.displacement(time).u) < 1e-15);
            CHECK(fields::largest(stepper.state().cells.stress.p) < 1e-13);
        }
    }

    TEST_CASE("results are the same bits for any number of threads") {
        const Scene scene = fields::scene_on({20, 15, 2.0, 2.0}, Model::full, {U, 0.0});
        const int before = thread_count();
        for (const char* scheme : {"dormand-prince", "chebyshev"}) {
            set_thread_count(1);
            const State one = run(scheme, scene, flowing(scene), 400.0, 4);
            for (const int threads : {2, 3, 8}) {
                set_thread_count(threads, 0);
                CHECK(fields::same_bits(run(scheme, scene, flowing(scene), 400.0, 4), one));
            }
        }
        set_thread_count(before);
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "ARKODE takes the steps of the fused integrators, to round-off") {
        for (const Model model : {Model::reduced, Model::full}) {
            const Scene scene = fields::scene_on({14, 10, 2.0, 2.2}, model, {U, 0.2 * U});
            const State start = flowing(scene);
            const PassOptions passes{.largest = 14, .tolerance = 1e-15}; // or else the guess of v shows
            for (const auto& [native, arkode] : {std::pair{"ralston", "arkode-2"}, std::pair{"bogacki-shampine", "arkode-3"},
                                                 std::pair{"dormand-prince", "arkode-5"}}) {
                const State expected = run(native, scene, start, 4000.0, 40, passes);
                auto stepper = sundials_for(arkode, scene, start, 1e-4, true, passes);
                for (int n = 1; n <= 40; ++n)
                    stepper.advance(100.0, n * 100.0);
                CHECK(stepper.counts().inner_steps == 40);
                const Distance d = distance(stepper.state(), expected);
                CHECK(d.stress < 1e-12);
                CHECK(d.internal < 1e-13);
                CHECK(d.velocity < 1e-9);
                CHECK(distance(expected, start).stress > 1e-2);
            }
        }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "SUNDIALS with its own error control finds the solution of the fused integrators") {
        const Scene scene = fields::scene_on({12, 10, 2.0, 2.0}, Model::reduced, {U, 0.0});
        const State start = flowing(scene);
        const State exact = run("dormand-prince", scene, start, 8000.0, 400);
        VectorField force(scene.grid);
        for (const char* scheme : {"arkode-3", "arkode-4", "arkode-5", "cvode-adams", "cvode-bdf", "ida"}) {
            double coarse = 0.0;
            for (const double tolerance : {1e-4, 1e-7}) {
                auto stepper = sundials_for(scheme, scene, start, tolerance);
                for (const double end : {3000.0, 8000.0}) // it may be started again
                    stepper.advance(end - stepper.state().time, end);
                const Distance d = distance(stepper.state(), exact);
                CAPTURE(scheme);
                CAPTURE(tolerance);
                CHECK(d.stress < 100.0 * tolerance);
                CHECK(d.internal < 10.0 * tolerance);
                CHECK(d.velocity < 100.0 * tolerance);
                CHECK(fields::equilibrium_residual(scene, stepper.state().cells, force) < 1e-13);
                CHECK(stepper.counts().inner_steps > 5);
                if (coarse > 0.0)
                    CHECK((d.stress < 0.05 * coarse || d.stress < 1e-8));
                coarse = d.stress;
            }
        }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "multirate steps keep the stress in equilibrium and converge at third order") {
        const Scene scene = fields::scene_on({8, 6, 2.0, 2.0}, Model::reduced, {U, 0.0});
        const State start = flowing(scene);
        const State exact = run("dormand-prince", scene, start, 4000.0, 400);
        VectorField force(scene.grid);
        const auto error = [&](int steps) {
            auto stepper = sundials_for("mri", scene, start, 1e-12, true);
            for (int n = 1; n <= steps; ++n)
                stepper.advance(4000.0 / steps, n * 4000.0 / steps);
            CHECK(fields::equilibrium_residual(scene, stepper.state().cells, force) < 1e-13);
            CHECK(stepper.counts().pointwise_substeps > steps);
            return distance(stepper.state(), exact);
        };
        const Distance coarse = error(5), fine = error(10);
        CHECK(std::log2(coarse.stress / fine.stress) > 2.5);
        CHECK(std::log2(coarse.internal / fine.internal) > 2.5);
        CHECK(fine.stress < 1e-6);
    }

    TEST_CASE_FIXTURE(fields::OneThread, "the limits of steps: Courant rate of the velocity, time scale of the rates") {
        const Grid grid{13, 9, 3.0, 2.0};
        const double speed_u = U, speed_v = -0.4 * U;
        for (const Model model : {Model::reduced, Model::full}) {
            const Scene scene = fields::scene_on(grid, model, {speed_u, speed_v});
            State state = at_rest(scene); // elastic: the velocity is affine, largest on the walls
            CellState rate(grid, 1);
            const auto space = fields::space_for(scene);
            const RateReport report =
                MethodOfLines(scene, *space, {}).evaluate(state.cells, scene.walls.after(0.0), state.velocity, rate);
            const double expected = model == Model::full ? U / grid.dx() + 0.4 * U / grid.dy() : 0.0;
            CHECK(std::abs(report.courant_rate - expected) < 1e-9 * U / grid.dx());
        }
        // simple shear of the stress-free solid: |d sigma/dt| = sqrt(2) mu U/(H/2), chi at rest
        const Scene scene = fields::scene_on(grid, Model::reduced, {U, 0.0});
        auto stepper = stepper_for("ralston", scene, at_rest(scene));
        CHECK(stepper.time_scale() == doctest::Approx(1.0 / (std::sqrt(2.0) * mu * U)).epsilon(1e-9).scale(0.0));
    }

    TEST_CASE_FIXTURE(fields::OneThread,
                      "the constraint projection of CVODE puts a stress into equilibrium, other schemes keep it out") {
        const Scene scene = fields::scene_on({12, 10, 2.0, 2.0}, Model::reduced, {U, 0.0});
        State start = flowing(scene);
        for (int j = 0; j < 10; ++j)
            for (int i = 0; i < 12; ++i)
                start.cells.stress.s(i, j) += 0.01 * std::sin(1.0 + i * i + 3.0 * j);
        fields::wrap(start.cells.stress.s);
        VectorField force(scene.grid);
        REQUIRE(fields::equilibrium_residual(scene, start.cells, force) > 1e-3);
        const auto residual_by = [&](const char* scheme) {
            auto stepper = sundials_for(scheme, scene, start, 1e-6);
            stepper.advance(2000.0, 2000.0);
            return fields::equilibrium_residual(scene, stepper.state().cells, force);
        };
        CHECK(residual_by("cvode-bdf") < 1e-12);
        CHECK(residual_by("cvode-adams") > 1e-3);
    }

    TEST_CASE("error control: PI steps, rejection, stability limit") {
        const Grid grid{8, 8, 2.0, 2.0};
        StepControl control(grid, ErrorSteps{.tolerance = 1e-4, .order = 3});
        control.start(10.0 / std::pow(1e-4, 1.0 / 3.0));
        auto step = control.next(0.0, 1e9);
        CHECK(step.dt == 10.0);
        CHECK(!control.judge(step, {.measure = 8e-4})); // E = 8: 0.9 * 8^(-1/3)
        step = control.next(0.0, 1e9);
        CHECK(step.dt == doctest::Approx(4.5));
        CHECK(step.limit == StepLimit::accuracy);
        CHECK(control.judge(step, {.measure = 0.5e-4}));
        step = control.next(4.5, 1e9);
        CHECK(step.dt == doctest::Approx(4.5 * 0.9 * std::pow(0.5, -0.7 / 3.0)));
        const double before = step.dt;
        CHECK(control.judge(step, {.measure = 0.2e-4}));
        step = control.next(0.0, 1e9);
        CHECK(step.dt == doctest::Approx(before * 0.9 * std::pow(0.2, -0.7 / 3.0) * std::pow(0.5, 0.4 / 3.0)));
        CHECK(control.judge(step, {.measure = 1e-9, .relaxation_step = 7.0}));
        CHECK(control.next(0.0, 1e9).dt == 7.0);
        CHECK(control.next(0.0, 1e9).limit == StepLimit::relaxation);
        CHECK(control.judge(control.next(0.0, 1e9), {.measure = 1e-9, .relaxation_step = 9.0, .advection_step = 8.0}));
        CHECK(control.next(0.0, 1e9).dt == 8.0);
        CHECK(control.next(0.0, 1e9).limit == StepLimit::advection);
        CHECK(control.judge(control.next(0.0, 1e9), {.measure = 1e-9, .relaxation_step = 7.0, .advection_step = 8.0}));
        CHECK(control.retry_shorter(control.next(0.0, 1e9)));
        CHECK(control.next(0.0, 1e9).dt == doctest::Approx(1.4));
        for (int n = 0; n < 20; ++n)
            if (!control.retry_shorter(control.next(0.0, 1e9)))
                break;
        CHECK(!control.retry_shorter(control.next(0.0, 1e9))); // below the smallest step
        StepControl fixed(grid, FixedSteps{1.0});
        CHECK(fixed.next(0.0, 1.02).dt == 1.0);
        CHECK(fixed.next(0.0, 1.009).dt == 1.009); // no sliver of a step after it
        CHECK(fixed.next(0.0, 1.009).lands);
        CHECK(!fixed.retry_shorter(fixed.next(0.0, 9.0)));
        CHECK(fixed.judge(fixed.next(0.0, 9.0), {.measure = 1e9}));
    }
}

} // namespace index_reduced_suite
