// SPDX-License-Identifier: GPL-3.0-or-later
#include "fields.hpp"
#include "messages.hpp"
#include <ductile/base/threads.hpp>
#include <ductile/quasistatic/initial.hpp>
#include <ductile/quasistatic/step_control.hpp>
#include <ductile/quasistatic/walls.hpp>
#include <ductile/sundials/erk.hpp>

#include <cmath>
#include <doctest/doctest.h>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace quasistatic_suite {

using namespace ductile;
using namespace ductile::quasistatic;

namespace {

constexpr double mu = 37.4 / 0.85, K = 122.0 / 0.85, U = 2e-7;
constexpr Predictor predictors[] = {Predictor::euler, Predictor::substepped, Predictor::incremental};
constexpr Model models[] = {Model::reduced, Model::full};

/// A law that never yields in these tests.
Law elastic() { return perzyna_law(fields::metallic_glass, {.yield_stress = 1e30}, Units{}); }

/// A temperature in kelvins: the law of no model.
constexpr InternalVariable kelvin{.name = "effective_temperature", .unit = "K", .lower = 1.0, .upper = 1e4};

State at_rest(const Scene& scene, double internal) {
    return fields::initial_state(scene, initial_internal(scene.grid, Uniform{internal}, scene.law->variables()[0]));
}
State at_rest(const Scene& scene, const InitialInternal& internal) {
    return fields::initial_state(scene, initial_internal(scene.grid, internal, scene.law->variables()[0]));
}

/// The pattern of the paper in units of e_Z/k_B.
const PaperPattern paper_pattern{640.0 / 21000.0, 180.0 / 21000.0};
/// Something without any symmetry, hot enough to flow early.
const RandomField rough{.mean = 0.033, .deviation = 0.0015, .correlation_length = 0.25, .seed = 5};

/// The largest difference of any field of two states, velocities in units of U.
double distance(const State& a, const State& b) {
    double d = 0.0;
    const auto fa = fields::fields_of(a), fb = fields::fields_of(b);
    for (std::size_t k = 0; k < fa.size(); ++k)
        d = std::max(d, fields::distance(*fa[k], *fb[k]) / (k >= 5 ? U : 1.0));
    return d;
}

/// The image of a state in the mirrors x -> -x and y -> -y; `velocity` and `shear` are the signs that velocities and tau take.
struct Mirror {
    bool x = false, y = false;
};

State image(const Grid& grid, const State& s, const Mirror& mirror) {
    State r = s;
    const auto cell = [](bool flip, int i, int n) { return flip ? n - 1 - i : i; };
    const auto fr = fields::fields_of(r.cells);
    const auto fs = fields::fields_of(s.cells);
    for (std::size_t k = 0; k < 5; ++k) {
        for (int j = 0; j < grid.cells_y; ++j)
            for (int i = 0; i < grid.cells_x; ++i) // tau is odd in each mirror, everything else even
                (*fr[k])(i, j) = (k == 2 && mirror.x != mirror.y ? -1.0 : 1.0) *
                                 (*fs[k])(cell(mirror.x, i, grid.cells_x), cell(mirror.y, j, grid.cells_y));
        fields::wrap(*fr[k]);
    }
    for (int j = 0; j <= grid.cells_y; ++j)
        for (int i = 0; i < grid.cells_x; ++i) {
            const int column = mirror.x ? (grid.cells_x - i) % grid.cells_x : i, row = mirror.y ? grid.cells_y - j : j;
            r.velocity.u(i, j) = (mirror.x ? -1.0 : 1.0) * s.velocity.u(column, row);
            r.velocity.v(i, j) = (mirror.y ? -1.0 : 1.0) * s.velocity.v(column, row);
        }
    fields::wrap(r.velocity.u);
    fields::wrap(r.velocity.v);
    return r;
}

double order(double coarse, double fine) { return std::log2(coarse / fine); }

} // namespace

TEST_SUITE("quasistatic") {
    TEST_CASE_FIXTURE(fields::EachSpace, "elastic shear: tau = mu gamma without spin") {
        const Grid grid{9, 6, 1.0, 3.0};
        const Scene scene = fields::scene_on(grid, Model::reduced, {U, 0.0}, elastic());
        for (const Predictor predictor : predictors) {
            const State end = fields::run(scene, predictor, at_rest(scene, 0.0), 1e5, 10);
            const double gamma = U / 1.5 * 1e5;
            fields::check_uniform(end.cells.stress.tau, mu * gamma, 1e-13 * mu * gamma);
            for (const Field* f : {&end.cells.stress.p, &end.cells.stress.s, &end.cells.stress.q})
                fields::check_uniform(*f, 0.0, 1e-13 * mu * gamma);
            const Observables o = fields::observe(scene, end.cells);
            CHECK(o.wall_traction == doctest::Approx(mu * gamma).epsilon(1e-13));
            CHECK(o.largest_magnitude == doctest::Approx(mu * gamma).epsilon(1e-13));
            CHECK(o.plastic_fraction == 0.0);
        }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "elastic shear with the Jaumann rate: tau = mu sin gamma, s = mu (1 - cos gamma)") {
        const Grid grid{5, 4, 2.0, 2.0};
        const double gamma = 1.2, T = 100.0;
        const Scene scene = fields::scene_on(grid, Model::full, {gamma / T, 0.0}, elastic());
        for (const Predictor predictor : predictors) {
            double previous = 0.0;
            for (const int steps : {40, 80, 160, 320}) {
                const State end = fields::run(scene, predictor, at_rest(scene, 0.0), T, steps);
                const double tau = end.cells.stress.tau(2, 1), s = end.cells.stress.s(2, 1);
                fields::check_uniform(end.cells.stress.tau, tau, 1e-12 * mu);
                fields::check_uniform(end.cells.stress.s, s, 1e-12 * mu);
                fields::check_uniform(end.cells.stress.p, 0.0, 1e-12 * mu);
                const double error = std::hypot(tau - mu * std::sin(gamma), s - mu * (1.0 - std::cos(gamma))) / mu;
                CHECK(error < 2.0 / steps);
                if (previous > 0.0) // the spin is frozen at the beginning of each step
                    CHECK(order(previous, error) == doctest::Approx(1.0).epsilon(0.05).scale(0.0));
                previous = error;
            }
        }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "opening walls: the stress of uniaxial strain") {
        const Grid grid{6, 8, 2.0, 0.5};
        const double V = -3e-8, T = 2e4;
        for (const Model model : models)
            for (const Predictor predictor : predictors) {
                const Scene scene = fields::scene_on(grid, model, {0.0, V}, elastic());
                const State end = fields::run(scene, predictor, at_rest(scene, 0.0), T, 7);
                const double strain = V / 0.25 * T, alpha = K + 4.0 / 3.0 * mu, beta = K - 2.0 / 3.0 * mu;
                const double p = end.cells.stress.p(1, 1), s = end.cells.stress.s(1, 1), q = end.cells.stress.q(1, 1);
                CHECK(-p - s - q == doctest::Approx(alpha * strain).epsilon(1e-12));
                CHECK(-p + s - q == doctest::Approx(beta * strain).epsilon(1e-12));
                CHECK(-p + 2.0 * q == doctest::Approx(beta * strain).epsilon(1e-12));
                fields::check_uniform(end.cells.stress.p, p, 1e-12);
                fields::check_uniform(end.cells.stress.tau, 0.0, 1e-12);
                CHECK(fields::observe(scene, end.cells).normal_traction == doctest::Approx(alpha * strain).epsilon(1e-12));
            }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "a homogeneous body stays homogeneous and follows the equations of one point") {
        const Grid grid{11, 6, 2.0, 2.0};
        const double chi = 700.0 / 21000.0, T = 8e4;
        for (const Model model : models) {
            const Scene scene = fields::scene_on(grid, model, {U, 0.0});
            State start = at_rest(scene, chi);
            for (int j = 0; j < grid.cells_y; ++j) // at yield, so that no step crosses its kink
                for (int i = 0; i < grid.cells_x; ++i) {
                    start.cells.stress.tau(i, j) = 1.0;
                    start.cells.stress.s(i, j) = 0.1;
                }
            for (Field* f : fields::fields_of(start.cells))
                fields::wrap(*f);

            // s, tau, chi of a point in simple shear
            std::vector<double> point{0.1, 1.0, chi};
            const double turn = model == Model::full ? U : 0.0;
            sundials::ErkIntegrator exact(
                [&](double, std::span<const double> y, std::span<double> rate) {
                    const double sbar = std::hypot(y[0], y[1]);
                    const auto plastic = fields::stz.rates(sbar, std::array{y[2]});
                    rate[0] = turn * y[1] - 2.0 * mu * plastic.fluidity * y[0];
                    rate[1] = mu * U - turn * y[0] - 2.0 * mu * plastic.fluidity * y[1];
                    rate[2] = plastic.internal[0];
                },
                3, {.relative_tolerance = 1e-12, .absolute_tolerance = 1e-14, .largest_step = 200.0});
            exact.integrate(point, 0.0, T);
            CHECK(point[1] < 1.4); // far below the elastic 1.7: it flows
            CHECK(point[2] > 1.007 * chi);

            for (const Predictor predictor : predictors) {
                std::array<double, 3> previous{};
                for (const int steps : {200, 400, 800}) {
                    const State end = fields::run(scene, predictor, start, T, steps);
                    std::array<double, 3> error;
                    const Field* compared[] = {&end.cells.stress.s, &end.cells.stress.tau, &end.cells.internal[0]};
                    for (std::size_t k = 0; k < 3; ++k) {
                        const double value = (*compared[k])(0, 0);
                        fields::check_uniform(*compared[k], value, 1e-13);
                        error[k] = std::abs(value - point[k]);
                    }
                    fields::check_uniform(end.cells.stress.p, 0.0, 1e-13);
                    CHECK(error[1] < 0.02);
                    CHECK(error[2] < 1e-4);
                    if (previous[1] > 0.0 && model == Model::reduced) {
                        const double expected = predictor == Predictor::incremental ? 2.0 : 1.0;
                        CAPTURE(static_cast<int>(predictor));
                        CAPTURE(steps);
                        CHECK(order(previous[1], error[1]) == doctest::Approx(expected).epsilon(0.12).scale(0.0));
                        CHECK(order(previous[2], error[2]) == doctest::Approx(expected).epsilon(0.12).scale(0.0));
                    }
                    previous = error;
                }
            }
        }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "reflected and rotated problems give the reflected and rotated answers") {
        for (const Model model : models)
            for (const Predictor predictor : predictors)
                for (const Grid& grid : {Grid{14, 12, 2.0, 2.0}, Grid{19, 9, 3.0, 2.0}}) {
                    const Scene scene = fields::scene_on(grid, model, {U, 3e-9}),
                                reversed = fields::scene_on(grid, model, {-U, 3e-9});
                    const State start = at_rest(scene, rough);
                    const State end = fields::run(scene, predictor, start, 14e4, 70);
                    CHECK(fields::observe(scene, end.cells).plastic_fraction > 0.99);
                    CHECK(fields::largest(end.cells.stress.p) > 0.01); // no longer uniform
                    for (const Mirror mirror : {Mirror{true, false}, Mirror{false, true}, Mirror{true, true}}) {
                        // one mirror turns the shear round, two bring it back
                        const Scene& there = mirror.x != mirror.y ? reversed : scene;
                        const State other = fields::run(there, predictor, image(grid, start, mirror), 14e4, 70);
                        CAPTURE(static_cast<int>(predictor));
                        CAPTURE(mirror.x);
                        CAPTURE(mirror.y);
                        CHECK(distance(other, image(grid, end, mirror)) < 1e-10);
                    }
                    // and it is not symmetric by itself
                    CHECK(distance(end, image(grid, end, {true, true})) > 1e-3);
                }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "a closed elastic cycle returns to zero stress without spin") {
        const Grid grid{8, 7, 2.0, 2.0};
        const double T = 3e4;
        Scene scene = fields::scene_on(grid, Model::reduced, {});
        // load, unload with a ramp, hold, reverse, return: the displacement is zero at the end
        const WallHistory history({{0.0, {U, 0.5 * U}},
                                   {T, {U, 0.5 * U}},
                                   {T, {-U, -0.5 * U}},
                                   {2.5 * T, {-U, -0.5 * U}},
                                   {2.5 * T, {0.0, 0.0}},
                                   {3.0 * T, {0.0, 0.0}},
                                   {4.0 * T, {U, 0.5 * U}}});
        scene.walls = moving(history);
        const double end_time = 4.0 * T; // integral: T - 1.5 T + 0 + T/2
        CHECK(std::abs(history.displacement(end_time).u) < 1e-15);
        for (const Predictor predictor : predictors) {
            fields::Stepping stepper = fields::stepper_for(scene, predictor, at_rest(scene, rough), 1e-9);
            StepControl control(grid, FixedSteps{1234.5});
            double largest = 0.0;
            while (stepper.state().time < end_time) {
                const double time = stepper.state().time;
                const auto next = control.next(time, std::min(end_time, scene.walls.next_knot(time)));
                stepper.advance(next.dt, next.end);
                const double tau = stepper.state().cells.stress.tau(3, 3);
                CHECK(tau == doctest::Approx(mu * history.displacement(next.end).u).epsilon(1e-10));
                largest = std::max(largest, tau);
            }
            CHECK(largest > 0.25);
            CHECK(stepper.state().time == end_time);
            for (const Field* f : {&stepper.state().cells.stress.p, &stepper.state().cells.stress.s,
                                   &stepper.state().cells.stress.tau, &stepper.state().cells.stress.q})
                CHECK(fields::largest(*f) < 1e-13);
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "wall history: mean, kinks, jumps and displacement against quadrature") {
        const std::vector<WallKnot> knots{{-0.5, {0.3, 0.0}}, {0.4, {1.0, -1.0}}, {1.0, {1.0, 2.0}}, {1.0, {-2.0, 0.5}},
                                          {1.7, {0.5, 0.5}},  {2.5, {0.5, 0.5}},  {2.5, {0.0, -3.0}}};
        const WallHistory walls(knots);
        // straight from the definition: the last knot at or before t, the first after it
        const auto velocity = [&](double t) {
            if (t < knots.front().time)
                return knots.front().value;
            std::size_t k = 0;
            while (k + 1 < knots.size() && knots[k + 1].time <= t)
                ++k;
            if (k + 1 == knots.size())
                return knots.back().value;
            const double w = (t - knots[k].time) / (knots[k + 1].time - knots[k].time);
            return WallVelocity{(1.0 - w) * knots[k].value.u + w * knots[k + 1].value.u,
                                (1.0 - w) * knots[k].value.v + w * knots[k + 1].value.v};
        };
        const auto integral = [&](double from, double to) {
            const int pieces = 20000;
            WallVelocity sum;
            for (int n = 0; n < pieces; ++n) {
                const WallVelocity v = velocity(from + (n + 0.5) * (to - from) / pieces);
                sum.u += v.u * (to - from) / pieces;
                sum.v += v.v * (to - from) / pieces;
            }
            return sum;
        };
        for (const double from : {-1.0, -0.5, 0.0, 0.2, 0.4, 0.9, 1.0, 1.7, 2.0, 2.5, 3.0})
            for (const double to : {-0.7, -0.5, 0.1, 0.4, 0.7, 1.0, 1.3, 1.7, 2.2, 2.5, 2.6, 4.0})
                if (to > from) {
                    const WallVelocity mean = walls.mean(from, to), expected = integral(from, to);
                    CHECK(mean.u * (to - from) == doctest::Approx(expected.u).epsilon(1e-3));
                    CHECK(mean.v * (to - from) == doctest::Approx(expected.v).epsilon(1e-3));
                    // exact: the mean of two halves is the mean of the whole
                    const double middle = 0.37 * from + 0.63 * to;
                    const WallVelocity left = walls.mean(from, middle), right = walls.mean(middle, to);
                    CHECK(std::abs(0.63 * left.u + 0.37 * right.u - mean.u) < 1e-13);
                    CHECK(std::abs(0.63 * left.v + 0.37 * right.v - mean.v) < 1e-13);
                    if (from == 0.0) {
                        CHECK(walls.displacement(to).u == doctest::Approx(expected.u).epsilon(1e-3));
                        CHECK(walls.displacement(to).v == doctest::Approx(expected.v).epsilon(1e-3));
                    }
                }
        for (const double t : {-2.0, -0.5, 0.3, 0.4, 1.0, 1.2, 2.5, 9.0}) {
            CHECK(walls.after(t).u == doctest::Approx(velocity(t).u));
            CHECK(walls.after(t).v == doctest::Approx(velocity(t).v));
        }
        CHECK(walls.next_knot(-1.0) == -0.5);
        CHECK(walls.next_knot(0.4) == 1.0);
        CHECK(walls.next_knot(1.0) == 1.7);
        CHECK(walls.next_knot(2.5) == std::numeric_limits<double>::infinity());
        CHECK(walls.displacement(0.0) == WallVelocity{});

        CHECK(parse_wall_history("0:5e-4,0.7:5e-4,0.7:-5e-4:1e-5").knots() ==
              std::vector<WallKnot>{{0.0, {5e-4, 0.0}}, {0.7, {5e-4, 0.0}}, {0.7, {-5e-4, 1e-5}}});
        for (const std::string& wrong : std::vector<std::string>{"", "0", "0:", "0:x", "0:1,", "0:1:2:3", "1:1,0:1",
                                                                 "0:1,0:2,0:3", "0:nan", "inf:1", ",0:1"}) {
            CAPTURE(wrong);
            CHECK(contains(message_of<InputError>([&] { (void)parse_wall_history(wrong); }), "wall"));
        }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "jumps of the wall velocity: displacement and stress follow the mean of each step") {
        const Grid grid{6, 5, 2.0, 2.0};
        Scene scene = fields::scene_on(grid, Model::reduced, {}, elastic());
        const WallHistory history({{0.0, {0.0, 0.0}}, {10.0, {1e-3, 0.0}}, {10.0, {-2e-3, 5e-4}}, {25.0, {3e-3, 0.0}}});
        scene.walls = moving(history);
        for (const Predictor predictor : predictors) {
            fields::Stepping stepper = fields::stepper_for(scene, predictor, at_rest(scene, 0.0));
            for (int n = 1; n <= 9; ++n) { // steps do not land on the knots
                stepper.advance(3.5, 3.5 * n);
                const double gamma = history.displacement(3.5 * n).u, strain = history.displacement(3.5 * n).v;
                fields::check_uniform(stepper.state().cells.stress.tau, mu * gamma, 1e-13);
                fields::check_uniform(stepper.state().cells.stress.p, -K * strain, 1e-13);
            }
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "steps land exactly on targets") {
        const Grid grid{8, 8, 2.0, 2.0};
        for (const double dt : {0.1, 1.0 / 3.0, 0.7, 5.0}) {
            StepControl control(grid, FixedSteps{dt});
            double time = 0.0;
            int steps = 0;
            for (const double target : {0.3, 0.30001, 1.0, 1.7, 3.1}) {
                bool landed = false;
                while (!landed) {
                    const StepControl::Step step = control.next(time, target);
                    CHECK(step.dt > 0.0);
                    CHECK(step.dt <= dt * (1.0 + 1.02e-2));
                    CHECK(std::abs(time + step.dt - step.end) <= 1e-15 * step.end);
                    time = step.end;
                    landed = step.lands;
                    CHECK(landed == (time == target));
                    REQUIRE(++steps < 1000);
                }
            }
            CHECK(time == 3.1);
            CHECK(steps <= static_cast<int>(3.1 / dt) + 6);
        }
        // a step that would leave less than a hundredth of itself goes on to the target
        StepControl control(grid, FixedSteps{1.0});
        CHECK(control.next(0.0, 1.0 + 5e-7).lands);
        CHECK(!control.next(0.0, 1.1).lands);
        CHECK(control.next(0.0, 1.1).dt == 1.0);
        CHECK(control.next(0.0, 0.2).limit == StepLimit::output);
        CHECK(control.next(0.0, 9.0).limit == StepLimit::fixed);
    }

    TEST_CASE_FIXTURE(fields::OneThread, "adaptive steps follow Eq. (56)") {
        const Grid grid{20, 10, 2.0, 3.0};
        const double h2 = grid.dx() * grid.dy();
        const ProjectionSteps o{.tolerance = 0.002,
                                .largest_growth = 1.8,
                                .safety = 0.85,
                                .smallest_step = 0.5,
                                .largest_step = 700.0,
                                .first_step = 12.0};
        StepControl control(grid, o);
        const PointwiseTolerance by_cell{PointwiseTolerance::Scale::cell, 0.03}, by_step{PointwiseTolerance::Scale::step, 1e-6};
        CHECK(by_cell.options(grid, 5.0).absolute_tolerance == doctest::Approx(0.03 * h2).epsilon(1e-15));
        CHECK(by_cell.options(grid, 5.0).relative_tolerance == doctest::Approx(0.03 * h2).epsilon(1e-15));
        CHECK(by_cell.options(grid, 5.0).exact_components == 1);
        CHECK(by_step.options(grid, 5.0).absolute_tolerance == doctest::Approx(1e-6 * 25.0).epsilon(1e-15));
        CHECK(by_step.options(grid, 1e-9).absolute_tolerance == 1e-16); // Sec. 8.1
        CHECK(by_step.options(grid, 1e-9).relative_tolerance == 1e-17);

        double dt = 12.0; // Delta t_init
        std::mt19937 engine(1);
        std::uniform_real_distribution<double> exponent(-4.0, 2.0);
        bool grew = false, shrank = false, largest = false, smallest = false;
        for (int n = 0; n < 400; ++n) {
            const StepControl::Step step = control.next(0.0, 1e9);
            CHECK(step.dt == doctest::Approx(dt).epsilon(1e-14));
            const double bias = n < 200 ? 0.0 : 2.0; // towards short steps in the second half
            const double Q = n == 50 ? 0.0 : 0.002 * h2 * std::pow(10.0, exponent(engine) + bias);
            CHECK(control.judge(step, {.measure = Q}));
            const double factor = Q > 0.0 ? std::min(1.8, 0.85 * std::sqrt(0.002 * h2 / Q)) : 1.8;
            dt = std::min(700.0, std::max(0.5, dt * factor)); // Eq. (56)
            CHECK(control.planned_step() == doctest::Approx(dt).epsilon(1e-14));
            grew = grew || factor == 1.8;
            shrank = shrank || factor < 1.0;
            largest = largest || dt == 700.0;
            smallest = smallest || dt == 0.5;
        }
        CHECK((grew && shrank && largest && smallest));

        // rejection, where it is asked for
        ProjectionSteps strict = o;
        strict.largest_excess = 3.0;
        StepControl rejecting(grid, strict);
        CHECK(rejecting.judge(rejecting.next(0.0, 1e9), {.measure = 2.9 * 0.002 * h2}));
        const double planned = rejecting.planned_step();
        CHECK(!rejecting.judge(rejecting.next(0.0, 1e9), {.measure = 4.0 * 0.002 * h2}));
        CHECK(rejecting.planned_step() == doctest::Approx(planned * 0.85 / 2.0).epsilon(1e-14));
        for (int n = 0; n < 10 && rejecting.planned_step() > 0.5; ++n)
            CHECK(!rejecting.judge(rejecting.next(0.0, 1e9), {.measure = 1e6 * h2}));
        CHECK(rejecting.planned_step() == 0.5);
        CHECK(rejecting.judge(rejecting.next(0.0, 1e9), {.measure = 1e6 * h2})); // not below the smallest step

        // a step cut to land on a target does not shorten those after it, unless its projection asks for it
        *control.hidden_numbers().front().second = 100.0; // the planned step
        const StepControl::Step cut = control.next(0.0, 3.0);
        CHECK(cut.lands);
        CHECK(cut.dt == 3.0);
        CHECK(control.judge(cut, {.measure = 1e-9 * h2}));
        CHECK(control.planned_step() == 100.0);
        CHECK(control.judge(cut, {.measure = 4.0 * 0.002 * h2}));
        CHECK(control.planned_step() == doctest::Approx(3.0 * 0.85 / 2.0));
        // two equal steps rather than a long and a short one
        *control.hidden_numbers().front().second = 100.0; // the planned step
        CHECK(control.next(0.0, 130.0).dt == 65.0);
        CHECK(control.next(0.0, 130.0).end == 65.0);
        CHECK(control.next(0.0, 210.0).dt == 100.0);
        *control.hidden_numbers().front().second = 100.0; // the planned step
        for (double time = 0.0; time < 333.25;) {
            const StepControl::Step step = control.next(time, 333.25);
            CHECK(step.dt > 30.0);
            time = step.end;
            CHECK(step.lands == (time == 333.25));
        }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "stress is in equilibrium after every step, and Q* is what the stepper reports") {
        const Grid grid{17, 12, 2.0, 2.0};
        for (const Model model : models)
            for (const Predictor predictor : predictors) {
                const Scene scene = fields::scene_on(grid, model, {U, 0.0});
                fields::Stepping stepper = fields::stepper_for(scene, predictor, at_rest(scene, rough), 1e-9);
                double largest_measure = 0.0;
                VectorField force(grid);
                for (int n = 1; n <= 60; ++n) {
                    const StepAttempt report = stepper.advance(2500.0, 2500.0 * n);
                    CHECK(fields::equilibrium_residual(scene, stepper.state().cells, force) < 1e-12);
                    largest_measure = std::max(largest_measure, report.measure);
                }
                CHECK(stepper.counts().elliptic_solves == 60);
                CHECK(stepper.state().step == 60);
                CHECK(largest_measure > 1e-6);
                // the force on a wall is the same at any height
                const Observables o = fields::observe(scene, stepper.state().cells);
                for (int j = 0; j < grid.cells_y; ++j) {
                    double tau = 0.0, yy = 0.0;
                    const StressField& f = stepper.state().cells.stress;
                    for (int i = 0; i < grid.cells_x; ++i) {
                        tau += f.tau(i, j) / grid.cells_x;
                        yy += (-f.p(i, j) - f.s(i, j) - f.q(i, j)) / grid.cells_x;
                    }
                    CHECK(tau == doctest::Approx(o.wall_traction).epsilon(1e-11));
                    CHECK(std::abs(yy - o.normal_traction) < 1e-11);
                }
            }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "observables are those of a plain sum") {
        const Grid grid{13, 5, 2.0, 2.0};
        const Scene scene = fields::scene_on(grid, Model::full, {U, 0.0});
        std::mt19937 engine(3);
        CellState cells(grid, 1);
        for (Field* f : fields::fields_of(cells))
            fields::fill_randomly(*f, engine, -1.0, 1.2);
        const Observables o = fields::observe(scene, cells);
        double tau = 0.0, yy = 0.0, magnitude = 0.0, largest = 0.0, low = 9.0, high = -9.0, plastic = 0.0;
        for (int j = 0; j < 5; ++j)
            for (int i = 0; i < 13; ++i) {
                const auto& [p, s, t, q] = cells.stress;
                const double sbar = std::sqrt(s(i, j) * s(i, j) + t(i, j) * t(i, j) + 3.0 * q(i, j) * q(i, j));
                tau += t(i, j) / 65.0;
                yy += (-p(i, j) - s(i, j) - q(i, j)) / 65.0;
                magnitude += sbar / 65.0;
                largest = std::max(largest, sbar);
                low = std::min(low, cells.internal[0](i, j));
                high = std::max(high, cells.internal[0](i, j));
                plastic += sbar >= 1.0 ? 1.0 / 65.0 : 0.0;
            }
        CHECK(o.wall_traction == doctest::Approx(tau).epsilon(1e-12));
        CHECK(o.normal_traction == doctest::Approx(yy).epsilon(1e-12));
        CHECK(o.mean_magnitude == doctest::Approx(magnitude).epsilon(1e-12));
        CHECK(o.largest_magnitude == doctest::Approx(largest).epsilon(1e-14));
        CHECK(o.smallest_internal[0] == low);
        CHECK(o.largest_internal[0] == high);
        CHECK(o.plastic_fraction == doctest::Approx(plastic).epsilon(1e-12));
    }

    TEST_CASE_FIXTURE(fields::OneThread, "the number of threads changes no bit of a run") {
        const Grid grid{19, 14, 2.0, 2.0};
        for (const Predictor predictor : predictors) {
            const Scene scene = fields::scene_on(grid, Model::full, {U, 0.0});
            const State start = at_rest(scene, rough);
            set_thread_count(1);
            const State expected = fields::run(scene, predictor, start, 14e4, 40);
            for (const int threads : {2, 3, 8}) {
                set_thread_count(threads, 0);
                CHECK(fields::same_bits(fields::run(scene, predictor, start, 14e4, 40), expected));
            }
        }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "going on from a copy of the state is going on, to the last bit") {
        const Grid grid{19, 14, 2.0, 2.0};
        for (const Model model : models)
            for (const Predictor predictor : predictors) {
                const Scene scene = fields::scene_on(grid, model, {U, 0.0});
                fields::Stepping whole = fields::stepper_for(scene, predictor, at_rest(scene, rough), 1e-9);
                State copy;
                for (int n = 1; n <= 30; ++n) {
                    whole.advance(5000.0, 5000.0 * n);
                    if (n == 12)
                        copy = whole.state();
                }
                for (const int stop : {21, 30}) { // and a second time, from the first copy's copy
                    fields::Stepping rest = fields::stepper_for(scene, predictor, copy, 1e-9);
                    for (int n = static_cast<int>(copy.step) + 1; n <= stop; ++n)
                        rest.advance(5000.0, 5000.0 * n);
                    copy = rest.state();
                }
                CHECK(fields::same_bits(copy, whole.state()));
            }
    }

    TEST_CASE_FIXTURE(
        fields::OneThread,
        "temporal order on a fixed grid, reduced model: two, and one for the first-order schemes, to the same answer") {
        // From the state a little after yield, which all steps share: the corner at yield is another matter (below).
        const Grid grid{16, 16, 2.0, 2.0};
        const Scene scene = fields::scene_on(grid, Model::reduced, {U, 0.0});
        const State start = fields::run(scene, Predictor::incremental, at_rest(scene, paper_pattern), 12e4, 240);
        const double end = 15e4;
        const auto error = [&](Predictor predictor, int steps, const State& reference) {
            const State s = fields::run(scene, predictor, start, end, steps);
            double stress = 0.0;
            for (std::size_t k = 0; k < 4; ++k)
                stress =
                    std::max(stress, fields::distance(*fields::fields_of(s.cells)[k], *fields::fields_of(reference.cells)[k]));
            return std::array{stress, fields::distance(s.cells.internal[0], reference.cells.internal[0])};
        };
        const State reference = fields::run(scene, Predictor::incremental, start, end, 1200);
        for (const Predictor predictor : predictors) {
            std::array<double, 2> previous{};
            for (const int steps : {75, 150, 300}) {
                const auto e = error(predictor, steps, reference);
                if (previous[0] > 0.0) {
                    const double expected = predictor == Predictor::incremental ? 2.0 : 1.0;
                    CAPTURE(static_cast<int>(predictor));
                    CAPTURE(steps);
                    CHECK(order(previous[0], e[0]) == doctest::Approx(expected).epsilon(0.15).scale(0.0));
                    CHECK(order(previous[1], e[1]) == doctest::Approx(expected).epsilon(0.15).scale(0.0));
                }
                previous = e;
            }
            CHECK(previous[0] < (predictor == Predictor::incremental ? 1e-4 : 1e-2));
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread,
                      "temporal order in the full model: one with frozen spin and advection, two with extrapolated ones") {
        const Grid grid{16, 16, 2.0, 2.0};
        const Scene scene = fields::scene_on(grid, Model::full, {U, 0.0});
        const State start = fields::run(scene, Predictor::incremental, at_rest(scene, paper_pattern), 12e4, 240);
        const auto end_of = [&](Transport transport, int steps, const std::vector<int>& pattern) {
            fields::Stepping stepper = fields::stepper_for(scene, Predictor::incremental, start, 1e-7, transport);
            double sum = 0.0, time = start.time;
            for (int n = 0; n < steps; ++n)
                sum += pattern[static_cast<std::size_t>(n) % pattern.size()];
            for (int n = 0; n < steps; ++n) {
                const double dt = 3e4 * pattern[static_cast<std::size_t>(n) % pattern.size()] / sum;
                stepper.advance(dt, time + dt);
                time += dt;
            }
            return stepper.state();
        };
        // equal steps, and unequal ones, which the weights of the extrapolation must know
        for (const std::vector<int>& pattern : {std::vector<int>{1}, std::vector<int>{1, 2, 3, 1}})
            for (const auto& [transport, expected] :
                 {std::pair{Transport::frozen, 1.0}, std::pair{Transport::extrapolated, 2.0}}) {
                std::array<State, 4> ends;
                for (std::size_t k = 0; k < ends.size(); ++k)
                    ends[k] = end_of(transport, 120 << k, pattern);
                for (const std::size_t field : {2, 4}) { // tau, internal; in s, the smallest, the switches of ENO2 show
                    const auto change = [&](std::size_t k) {
                        return fields::distance(*fields::fields_of(ends[k])[field], *fields::fields_of(ends[k + 1])[field]);
                    };
                    CAPTURE(field);
                    CHECK(order(change(1), change(2)) == doctest::Approx(expected).epsilon(0.2).scale(0.0));
                }
            }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "temporal order through yield, reduced model: about two") {
        const Grid grid{32, 32, 2.0, 2.0};
        const Scene scene = fields::scene_on(grid, Model::reduced, {U, 0.0});
        const State start = at_rest(scene, paper_pattern);
        const State reference = fields::run(scene, Predictor::incremental, start, 15e4, 2400);
        double first[2] = {}, last[2] = {};
        for (const int steps : {150, 300, 600}) {
            const State s = fields::run(scene, Predictor::incremental, start, 15e4, steps);
            const double e[2] = {fields::distance(s.cells.stress.tau, reference.cells.stress.tau),
                                 fields::distance(s.cells.internal[0], reference.cells.internal[0])};
            for (int k = 0; k < 2; ++k) {
                if (steps == 150)
                    first[k] = e[k];
                last[k] = e[k];
            }
        }
        for (int k = 0; k < 2; ++k) // corrected for the finite reference, which is 4 times finer than the last
            CHECK(0.5 * order(first[k] * 16.0 / 15.9375, last[k] * 16.0 / 15.0) == doctest::Approx(2.0).epsilon(0.15).scale(0.0));
    }

    TEST_CASE_FIXTURE(fields::OneThread, "full model: the first-order schemes and the incremental one approach each other") {
        const Grid grid{14, 12, 2.0, 2.0};
        const Scene scene = fields::scene_on(grid, Model::full, {U, 0.0});
        const State start = at_rest(scene, rough);
        for (const Predictor predictor : {Predictor::euler, Predictor::substepped}) {
            double previous = 0.0;
            for (const int steps : {150, 300, 600}) {
                const double d =
                    fields::distance(fields::run(scene, predictor, start, 15e4, steps).cells.stress.tau,
                                     fields::run(scene, Predictor::incremental, start, 15e4, steps).cells.stress.tau);
                if (previous > 0.0)
                    CHECK(order(previous, d) == doctest::Approx(1.0).epsilon(0.25).scale(0.0));
                previous = d;
            }
            CHECK(previous < 0.01);
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "a step that ends in nonsense is reported with step, time and advice") {
        const Grid grid{8, 8, 2.0, 2.0};
        const Scene scene = fields::scene_on(grid, Model::full, {U, 0.0});
        State start = at_rest(scene, 0.03);
        start.cells.stress.tau(3, 3) = std::numeric_limits<double>::quiet_NaN();
        fields::wrap(start.cells.stress.tau);
        for (const Predictor predictor : predictors) {
            fields::Stepping stepper = fields::stepper_for(scene, predictor, start);
            const std::string message = message_of<RunError>([&] { stepper.advance(10.0, 10.0); });
            CHECK(contains(message, "step 1"));
            CHECK(contains(message, "--dt"));
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "the initial field of App. C") {
        const Grid fine{400, 400, 2.0, 2.0};
        const Field chi = initial_internal(fine, PaperPattern{}, kelvin);
        double low = 1e9, high = 0.0;
        for (int j = 0; j < 400; ++j)
            for (int i = 0; i < 400; ++i) {
                low = std::min(low, chi(i, j));
                high = std::max(high, chi(i, j));
            }
        CHECK(std::abs(low - 640.0) < 0.05);
        CHECK(std::abs(high - 844.4) < 0.05);
        // (C.3) with the squares that are missing in print, Table C.6
        const auto literal = [](double x, double y) {
            double sum = std::exp(-20.0 * std::pow(0.5 * std::sin(std::numbers::pi * x) - y, 2));
            const double X[] = {x - 0.6, x - 0.3, x + 0.2, x + 0.4, x + 0.7}, s[] = {0.65, 0.3, -0.4, 0.0, -0.6};
            for (int i = 0; i < 5; ++i) {
                double wrapped = X[i];
                if (wrapped < -1.0)
                    wrapped += 2.0;
                if (wrapped > 1.0)
                    wrapped -= 2.0;
                sum += std::exp(-20.0 * (wrapped * wrapped + std::pow(y + s[i], 2)));
            }
            return 640.0 + 180.0 * sum;
        };
        for (const auto& [i, j] : {std::pair{0, 0}, {399, 120}, {200, 200}, {320, 70}, {60, 320}, {113, 207}, {395, 60}})
            CHECK(chi(i, j) == doctest::Approx(literal(fine.x(i + 0.5), fine.y(j + 0.5))).epsilon(1e-12));
        const Field coarse =
            initial_internal({48, 30, 6.0, 4.0}, PaperPattern{600.0, 100.0}, kelvin); // stretched to any rectangle
        CHECK(coarse(7, 11) ==
              doctest::Approx(600.0 + (literal(-1.0 + 7.5 / 24.0, -1.0 + 11.5 / 15.0) - 640.0) / 1.8).epsilon(1e-12));
    }

    TEST_CASE_FIXTURE(fields::OneThread, "other initial fields: values, periodicity, bad parameters") {
        const Grid grid{40, 30, 2.0, 2.0};
        const Field inclusion = initial_internal(grid, GaussianInclusion{600.0, 90.0, 0.95, -0.3, 0.15}, kelvin);
        for (const auto& [i, j] : {std::pair{39, 10}, {0, 10}, {20, 3}, {1, 12}}) {
            double r2 = 1e9; // the nearest of all periodic images
            for (int image = -2; image <= 2; ++image)
                r2 = std::min(r2, std::pow(grid.x(i + 0.5) - 0.95 + 2.0 * image, 2) + std::pow(grid.y(j + 0.5) + 0.3, 2));
            CHECK(inclusion(i, j) == doctest::Approx(600.0 + 90.0 * std::exp(-r2 / (2.0 * 0.15 * 0.15))).epsilon(1e-12));
        }
        CHECK(inclusion(0, 10) > 640.0); // it reaches around the period
        fields::check_uniform(initial_internal(grid, Uniform{700.0}, kelvin), 700.0, 0.0);
        CHECK(initial_internal(grid, Uniform{700.0}, kelvin)(-1, 3) == 700.0);

        const auto rejects = [&](const InitialInternal& initial, const char* part) {
            CHECK(contains(message_of<InputError>([&] { (void)initial_internal(grid, initial, kelvin); }), part));
        };
        rejects(Uniform{0.5}, "initial effective temperature");
        rejects(Uniform{std::numeric_limits<double>::quiet_NaN()}, "initial effective temperature");
        rejects(Uniform{std::numeric_limits<double>::infinity()}, "initial effective temperature");
        rejects(PaperPattern{-640.0, 180.0}, "initial effective temperature");
        rejects(GaussianInclusion{600.0, -700.0, 0.0, 0.0, 0.2}, "initial effective temperature");
        for (const double radius : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
            rejects(GaussianInclusion{600.0, 1.0, 0.0, 0.0, radius}, "radius");
        const Field disc = initial_internal(grid, SoftDisc{600.0, 300.0, 0.9, 0.1, 0.4, 0.05}, kelvin);
        for (const auto& [i, j] : {std::pair{38, 16}, {1, 12}, {30, 16}, {20, 3}}) {
            double r = 1e9;
            for (int image = -1; image <= 1; ++image)
                r = std::min(r, std::hypot(grid.x(i + 0.5) - 0.9 + 2.0 * image, grid.y(j + 0.5) - 0.1));
            CHECK(disc(i, j) == doctest::Approx(600.0 + 150.0 * (1.0 - std::tanh((r - 0.4) / 0.05))).epsilon(1e-12));
        }
        const Field blocks = initial_internal(grid, RandomBlocks{640.0, 20.0, 0.5, 3}, kelvin);
        CHECK(blocks(3, 3) == blocks(9, 6)); // 4 x 4 of them, of 10 x 7 or 8 cells
        CHECK(blocks(9, 6) != blocks(10, 6));
        CHECK(blocks(9, 6) != blocks(9, 8));
        CHECK(initial_internal(grid, RandomBlocks{640.0, 20.0, 0.5, 4}, kelvin)(3, 3) != blocks(3, 3));
        for (const double length : {0.0, -1.0, 5.0, 1e-9, std::numeric_limits<double>::quiet_NaN()})
            rejects(RandomBlocks{640.0, 20.0, length, 1}, "blocks");
        rejects(SoftDisc{600.0, 300.0, 0.0, 0.0, 0.0, 0.1}, "radius");
        rejects(SoftDisc{600.0, 300.0, 0.0, 0.0, 0.3, 0.0}, "transition");
        rejects(RandomField{640.0, -1.0, 0.1, 1}, "deviation");
        for (const double length : {0.0, -1.0, 0.001, std::numeric_limits<double>::quiet_NaN()})
            rejects(RandomField{640.0, 20.0, length, 1}, "correlation length");
    }

    TEST_CASE_FIXTURE(fields::OneThread, "the random field is the same on every grid and has its nominal statistics") {
        const RandomField random{.mean = 640.0, .deviation = 20.0, .correlation_length = 0.15, .seed = 3};
        const Field coarse = initial_internal({30, 20, 2.0, 2.0}, random, kelvin),
                    fine = initial_internal({90, 60, 2.0, 2.0}, random, kelvin);
        double span = 0.0;
        for (int j = 0; j < 20; ++j)
            for (int i = 0; i < 30; ++i) { // a centre of the coarse grid is one of the three times finer
                CHECK(coarse(i, j) == doctest::Approx(fine(3 * i + 1, 3 * j + 1)).epsilon(1e-12));
                span = std::max(span, std::abs(coarse(i, j) - 640.0));
            }
        CHECK(span > 20.0);
        RandomField other = random;
        other.seed = 4;
        CHECK(fields::distance(coarse, initial_internal({30, 20, 2.0, 2.0}, other, kelvin)) > 10.0);

        // away from the walls ten samples of 33 x 23 correlation lengths hold some thousand independent values
        const Grid grid{100, 100, 2.0, 2.0};
        const double length = 0.06;
        double mean = 0.0, square = 0.0, along_x = 0.0, along_y = 0.0, far = 0.0;
        long long inner = 0, points = 0;
        for (std::uint64_t seed = 1; seed <= 10; ++seed) {
            const Field f = initial_internal(grid, RandomField{640.0, 20.0, length, seed}, kelvin);
            const auto value = [&](int i, int j) { return (f((i + 100) % 100, j) - 640.0) / 20.0; };
            for (int j = 15; j < 85; ++j)
                for (int i = 0; i < 100; ++i) {
                    mean += value(i, j);
                    square += value(i, j) * value(i, j);
                    along_x += value(i, j) * value(i + 3, j); // one correlation length apart
                    along_y += value(i, j) * value(i, j + 3);
                    far += value(i, j) * value(i + 30, j);
                    inner += std::abs(value(i, j)) < 1.0 ? 1 : 0;
                    ++points;
                }
        }
        const double n = static_cast<double>(points);
        CHECK(std::abs(mean / n) < 0.1);
        CHECK(square / n == doctest::Approx(1.0).epsilon(0.08).scale(0.0));
        CHECK(along_x / square == doctest::Approx(std::exp(-0.5)).epsilon(0.06).scale(0.0));
        CHECK(along_y / square == doctest::Approx(std::exp(-0.5)).epsilon(0.06).scale(0.0));
        CHECK(std::abs(far / n) < 0.1);
        CHECK(static_cast<double>(inner) / n == doctest::Approx(0.683).epsilon(0.06).scale(0.0)); // normal
    }
}

} // namespace quasistatic_suite
