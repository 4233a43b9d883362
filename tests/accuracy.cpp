// SPDX-License-Identifier: GPL-3.0-or-later
// What a run knows about its own errors: estimates of every scheme with fixed steps against the true errors, and what is said of
// them.
#include "fields.hpp"
#include "messages.hpp"
#include <ductile/base/error.hpp>
#include <ductile/quasistatic/accuracy_watch.hpp>
#include <ductile/quasistatic/index_reduced.hpp>
#include <ductile/quasistatic/initial.hpp>
#include <ductile/quasistatic/options.hpp>
#include <ductile/quasistatic/step_control.hpp>
#include <ductile/space/space.hpp>

#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <numbers>
#include <random>
#include <vector>

namespace accuracy_suite {

using namespace ductile;
using namespace ductile::quasistatic;

namespace {

constexpr double U = 2e-7, T = 35e4;
constexpr int instants = 840; ///< of the reference

double error_of(const Scene& scene, CellState& a, CellState& b) {
    const CombinationNorm n = fields::norm(scene, std::array{Space::Term{&a, 1.0}, Space::Term{&b, -1.0}});
    return std::max(n.stress, n.internal / fields::stz.variables()[0].natural_scale());
}

std::vector<CellState> reference(const Scene& scene, const State& start) {
    fields::Stepping stepper(make_stepper("dormand-prince", scene, fields::space_for(scene),
                                          {.passes = {.largest = 6, .tolerance = 1e-9}, .tolerance = 1e-7}),
                             start);
    StepControl control(scene.grid, ErrorSteps{.tolerance = 1e-7, .order = 5});
    control.start(stepper.time_scale());
    std::vector<CellState> states{start.cells};
    for (int n = 1; n <= instants; ++n) {
        const double target = T * n / instants;
        while (stepper.state().time < target) {
            const double now = stepper.state().time;
            const auto planned = control.next(now, target);
            const auto step = StepControl::shortened(planned, now, stepper.limit_step(planned.dt));
            try {
                (void)stepper.attempt(step.dt, step.end, [&](const StepAttempt& made) { return control.judge(step, made); });
            } catch (const RunError&) {
                REQUIRE(control.retry_shorter(step));
            }
        }
        states.push_back(stepper.state().cells);
    }
    return states;
}

struct Outcome {
    bool refused = false;
    double estimate = 0.0, error = 0.0; ///< the largest of the run
};

/// A run of `steps` equal steps as the program makes it.
Outcome fixed_run(const std::string& scheme, const Scene& scene, const State& start, int steps, std::vector<CellState>& exact) {
    Options options;
    options.scheme = scheme;
    options.step = StepChoice::fixed;
    fields::Stepping stepper(make_time_stepper(options, scene, fields::space_for(scene)), start);
    const auto space = fields::space_for(scene);
    AccuracyWatch watch(scene, *space);
    Outcome outcome;
    const double dt = T / steps;
    try {
        for (int n = 1; n <= steps; ++n) {
            const StepAttempt attempt = stepper.attempt(dt, T * n / steps, [&](const StepAttempt& made) {
                watch.judge(made, stepper.state().time, dt);
                return true;
            });
            CellState now = stepper.state().cells;
            outcome.estimate = std::max(outcome.estimate, attempt.error);
            outcome.error = std::max(outcome.error, error_of(scene, now, exact[static_cast<std::size_t>(instants / steps * n)]));
        }
    } catch (const RunError&) {
        outcome.refused = true;
    }
    return outcome;
}

} // namespace

TEST_SUITE("accuracy") {
    TEST_CASE_FIXTURE(fields::OneThread, "a run with equal steps of any length ends right, or says that it does not") {
        for (const Model model : {Model::reduced, Model::full}) {
            const Scene scene = fields::scene_on({12, 10, 2.0, 2.0}, model, {U, 0.0});
            const State start = fields::initial_state(
                scene, initial_internal(scene.grid, PaperPattern{640. / 21000, 180. / 21000}, scene.law->variables()[0]));
            std::vector<CellState> exact = reference(scene, start);
            for (const Scheme& scheme : schemes()) {
                if (scheme.steps == Scheme::Steps::adaptive)
                    continue; // no equal steps
                for (const int steps : {1, 2, 3, 4, 6, 10, 14, 20, 28, 42, 84, 168, 420, 840}) {
                    const Outcome o = fixed_run(scheme.name, scene, start, steps, exact);
                    CAPTURE(scheme.name);
                    CAPTURE(steps);
                    CAPTURE(o.estimate);
                    CAPTURE(o.error);
                    if (o.refused)
                        continue;
                    const bool warned = o.estimate > AccuracyWatch::doubtful_error;
                    CHECK((warned || o.error < 0.013));
                    if (o.error > 0.01) // where it matters the estimate has the size of the error
                        CHECK(o.estimate > 0.1 * o.error);
                    if (o.error < 5e-4)
                        CHECK(!warned); // short steps are not suspected
                }
            }
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "what is known to be doubtful is said with figure, time and remedy") {
        const Scene scene = fields::scene_on({8, 6, 2.0, 2.0}, Model::full, {U, 0.0});
        const auto space = fields::space_for(scene);
        AccuracyWatch watch(scene, *space);
        const double second = 1.0 / scene.units.time;
        watch.judge({.error = 0.0099}, 10.0 * second, 2.0 * second);
        CHECK(watch.warnings().empty());
        watch.judge({.error = 0.034}, 20.0 * second, 3.0 * second);
        watch.judge({.error = 0.021}, 30.0 * second, 4.0 * second);
        REQUIRE(watch.warnings().size() == 1);
        for (const char* part : {"0.034", "t = 20 s", "dt = 3 s", "--dt", "--tolerance"})
            CHECK(contains(watch.warnings()[0], part));
        const std::string message = message_of<RunError>([&] { watch.judge({.error = 0.11}, 40.0 * second, 5.0 * second); });
        for (const char* part : {"0.11", "t = 40 s", "dt = 5 s", "--dt", "--tolerance"})
            CHECK(contains(message, part));
        CHECK_THROWS_AS(watch.judge({.error = std::nan("")}, 40.0, 5.0), RunError);
        CHECK(watch.warnings().size() == 1);

        // a stress out of equilibrium, at a step that is looked at, and at one that is not unless it is the last
        State state = fields::initial_state(scene, initial_internal(scene.grid, Uniform{0.03}, scene.law->variables()[0]));
        for (Field* f : {&state.cells.stress.tau, &state.cells.stress.p})
            for (int j = 0; j < 6; ++j)
                for (int i = 0; i < 8; ++i)
                    (*f)(i, j) = f == &state.cells.stress.tau ? 1.0 : 0.01 * ((i + j) % 3);
        fields::wrap(state.cells.stress.p);
        fields::wrap(state.cells.stress.tau);
        AccuracyWatch other(scene, *space);
        state.step = AccuracyWatch::residual_interval + 1;
        state.time = 7.0 * second;
        const auto stepper = make_stepper("auto", scene, fields::space_for(scene), {});
        other.observe(state, false, *stepper);
        CHECK(other.warnings().empty());
        other.observe(state, true, *stepper);
        REQUIRE(other.warnings().size() == 1);
        CHECK(contains(other.warnings()[0], "t = 7 s"));
        CHECK(contains(other.warnings()[0], "--operator exact"));
        AccuracyWatch third(scene, *space);
        state.step = 5 * AccuracyWatch::residual_interval;
        third.observe(state, false, *stepper);
        CHECK(third.warnings() == other.warnings());

        // what a restart restores
        AccuracyWatch again(scene, *space);
        const auto from = watch.hidden_numbers(), to = again.hidden_numbers();
        for (std::size_t k = 0; k < from.size(); ++k)
            *to[k].second = *from[k].second;
        CHECK(again.warnings() == watch.warnings());
    }

    TEST_CASE_FIXTURE(fields::OneThread,
                      "a ledger that does not close is said with its cause, and one that closes because two errors cancel") {
        const Scene scene = fields::scene_on({8, 6, 2.0, 2.0}, Model::full, {U, 0.0});
        const auto stepper = make_stepper("auto", scene, fields::space_for(scene), {});
        State state = fields::initial_state(scene, initial_internal(scene.grid, Uniform{0.03}, scene.law->variables()[0]));
        AccuracyWatch watch(scene, stepper->space());
        watch.begin(state);
        state.step = 1;
        state.cells.energy.work = 2.0;
        watch.observe(state, false, *stepper);
        const auto said = [&](double error, double by_advection) { // of the work
            const EnergyFlow passed{.work = 2.0, .dissipation = 1.5, .transport = 2.0 * by_advection};
            return watch.ledger_warning(0.5 + 2.0 * error, passed).value_or("");
        };
        CHECK(said(0.009, 0.0).empty());
        CHECK(said(-0.009, 0.0).empty());
        CHECK(contains(said(0.03, 0.02), "0.03 of the work of the walls is unaccounted for, most of it because the cells"));
        CHECK(contains(said(-0.03, -0.01), "-0.03 of the work of the walls is unaccounted for, because of the steps"));
        CHECK(
            contains(said(0.005, 0.03), "two errors cancel, 0.03 of the work of the walls by advection and -0.025 by the steps"));
        CHECK(contains(said(0.0, -0.02), "two errors cancel, -0.02 of the work of the walls by advection and 0.02 by the steps"));
        CHECK(said(0.008, 0.012).empty());
    }

    TEST_CASE_FIXTURE(fields::OneThread, "spin and advection alone are the rates of cells that do not flow") {
        const Scene scene = fields::scene_on({12, 10, 2.0, 2.0}, Model::full, {U, 0.0});
        State state = fields::initial_state(scene, initial_internal(scene.grid, Uniform{0.03}, scene.law->variables()[0]));
        std::mt19937 engine(4);
        for (Field* f : fields::fields_of(state.cells))
            fields::fill_smoothly(*f, engine, 0.1, 0.02);
        fields::fill_smoothly(state.velocity.u, engine, 0.0, 1.0);
        fields::fill_smoothly(state.velocity.v, engine, 0.0, 1.0);
        const auto space = fields::space_for(scene);
        CellState rate = space->make_cells(), expected = space->make_cells();
        VectorField room = space->make_velocity();
        space->transport(state.cells, state.velocity, rate, room);
        space->rates(state.cells, state.velocity, expected, room);
        for (int k = 0; k < rate.count(); ++k) {
            CHECK(fields::largest(rate.field(k)) > 0.0);
            CHECK(fields::same_bits(rate.field(k), expected.field(k)));
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "what frozen advection adds up to is known by schemes that freeze it, and said") {
        // chi = base + a sin(k x) carried by u = U y: [advection]^2 chi/2 = (U y k)^2 a sin(k x)/2
        constexpr double speed = 0.3, a = 1e-3;
        const Scene scene = fields::scene_on({96, 8, 2.0, 2.0}, Model::full, {speed, 0.0});
        const double k = 2.0 * std::numbers::pi / 2.0;
        State state = fields::initial_state(scene, initial_internal(scene.grid, Uniform{0.03}, scene.law->variables()[0]));
        double sum = 0.0;
        for (int j = 0; j < 8; ++j)
            for (int i = 0; i < 96; ++i) {
                const double y = -1.0 + (j + 0.5) * 0.25, wave = a * std::sin(k * (i + 0.5) * 2.0 / 96);
                state.cells.internal[0](i, j) = 0.03 + wave;
                sum += std::pow(0.5 * speed * speed * y * y * k * k * wave, 2);
            }
        fields::wrap(state.cells.internal[0]);
        const double expected = std::sqrt(sum / (96 * 8)) / scene.law->variables()[0].natural_scale();
        for (const Scheme& scheme : schemes()) {
            const auto stepper =
                make_stepper(scheme.name, scene, make_space(scene), {.fixed_steps = scheme.steps == Scheme::Steps::fixed});
            const double found = stepper->frozen_transport(state);
            const bool freezes = scheme.kind == SchemeKind::projection && scheme.name != "extrapolated";
            CAPTURE(scheme.name);
            CHECK(found == (freezes ? doctest::Approx(expected).epsilon(0.02) : doctest::Approx(0.0)));
        }
        const auto stepper = make_stepper("incremental", scene, make_space(scene), {});
        AccuracyWatch watch(scene, stepper->space());
        watch.begin(state);
        double squares = 0.0;
        while (squares * expected < 0.98 * AccuracyWatch::doubtful_error / 1.02) {
            state.time += 0.01;
            ++state.step;
            squares += 1e-4;
            watch.observe(state, false, *stepper);
        }
        const auto doubted = [&] {
            watch.observe(state, true, *stepper);
            return std::ranges::any_of(watch.warnings(), [](const std::string& w) {
                return contains(w, "which the scheme takes as at the start of each step, have an estimated error of 0.01");
            });
        };
        CHECK_FALSE(doubted());
        state.time += std::sqrt(0.08 * AccuracyWatch::doubtful_error / expected);
        CHECK(doubted());
        AccuracyWatch again(scene, stepper->space()); // what a restart restores
        const auto from = watch.hidden_numbers(), to = again.hidden_numbers();
        for (std::size_t n = 0; n < from.size(); ++n)
            *to[n].second = *from[n].second;
        CHECK(again.warnings() == watch.warnings());
    }
}

} // namespace accuracy_suite
