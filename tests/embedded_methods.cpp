// SPDX-License-Identifier: GPL-3.0-or-later
// The embedded Runge-Kutta methods one by one: tables, estimates and limits of their steps against those of the test, the norm
// that estimates are measured in, and the scheme that changes between two of them.
#include "fields.hpp"
#include <ductile/base/error.hpp>
#include <ductile/quasistatic/initial.hpp>
#include <ductile/quasistatic/options.hpp>
#include <ductile/space/space.hpp>

#include <cmath>
#include <doctest/doctest.h>
#include <vector>

namespace embedded_methods_suite {

using namespace ductile;
using namespace ductile::quasistatic;

namespace {

constexpr double mu = 37.4 / 0.85, U = 2e-7;

/// The pairs as their authors print them: b and the embedded b-hat on their own.
struct Pair {
    std::string scheme;
    int order, embedded_order;
    double stability; ///< on the negative real axis
    std::vector<std::vector<double>> a;
    std::vector<double> b, b_hat;

    [[nodiscard]] double c(std::size_t i) const {
        double sum = 0.0;
        for (const double x : a[i])
            sum += x;
        return sum;
    }
};

const std::vector<Pair>& pairs() {
    static const std::vector<Pair> all{
        {"ralston", 2, 1, 2.0, {{}, {2. / 3}, {1. / 4, 3. / 4}}, {1. / 4, 3. / 4, 0.}, {1. / 3, 1. / 3, 1. / 3}},
        {"bogacki-shampine",
         3,
         2,
         2.5,
         {{}, {1. / 2}, {0., 3. / 4}, {2. / 9, 1. / 3, 4. / 9}},
         {2. / 9, 1. / 3, 4. / 9, 0.},
         {7. / 24, 1. / 4, 1. / 3, 1. / 8}},
        {"dormand-prince",
         5,
         4,
         3.3,
         {{},
          {1. / 5},
          {3. / 40, 9. / 40},
          {44. / 45, -56. / 15, 32. / 9},
          {19372. / 6561, -25360. / 2187, 64448. / 6561, -212. / 729},
          {9017. / 3168, -355. / 33, 46732. / 5247, 49. / 176, -5103. / 18656},
          {35. / 384, 0., 500. / 1113, 125. / 192, -2187. / 6784, 11. / 84}},
         {35. / 384, 0., 500. / 1113, 125. / 192, -2187. / 6784, 11. / 84, 0.},
         {5179. / 57600, 0., 7571. / 16695, 393. / 640, -92097. / 339200, 187. / 2100, 1. / 40}}};
    return all;
}

/// sum_i w_i c_i^k, which is 1/(k + 1) for k below the order.
double quadrature(const Pair& pair, const std::vector<double>& weights, int k) {
    double sum = 0.0;
    for (std::size_t i = 0; i < weights.size(); ++i)
        sum += weights[i] * (k == 0 ? 1.0 : std::pow(pair.c(i), k));
    return sum;
}

/// sum_ij w_i a_ij c_j, which is 1/6 from order three.
double tall_tree(const Pair& pair, const std::vector<double>& weights) {
    double sum = 0.0;
    for (std::size_t i = 0; i < weights.size(); ++i)
        for (std::size_t j = 0; j < pair.a[i].size(); ++j)
            sum += weights[i] * pair.a[i][j] * pair.c(j);
    return sum;
}

fields::Stepping stepper_for(const std::string& scheme, const Scene& scene, const State& start, const PassOptions& passes = {},
                             double tolerance = 1e-4) {
    return {make_stepper(scheme, scene, fields::space_for(scene), {.passes = passes, .tolerance = tolerance}), start};
}

Law elastic() { return perzyna_law(fields::metallic_glass, {.yield_stress = 1e30}, Units{}); }

State uniform(const Scene& scene, double internal) {
    return fields::initial_state(scene, initial_internal(scene.grid, Uniform{internal}, scene.law->variables()[0]));
}

void fill(Field& field, double value) {
    for (int j = 0; j < field.rows(); ++j)
        for (int i = 0; i < field.columns(); ++i)
            field(i, j) = value;
    fields::wrap(field);
}

/// Adaptive steps to `end`; returns the number of attempts.
int integrate(fields::Stepping& stepper, StepControl& control, double end) {
    int attempts = 0;
    while (stepper.state().time < end) {
        REQUIRE(++attempts < 20000);
        const double now = stepper.state().time;
        const auto planned = control.next(now, end);
        const auto step = StepControl::shortened(planned, now, stepper.limit_step(planned.dt));
        try {
            (void)stepper.attempt(step.dt, step.end, [&](const StepAttempt& made) { return control.judge(step, made); });
        } catch (const RunError&) {
            REQUIRE(control.retry_shorter(step));
        }
    }
    return attempts;
}

} // namespace

TEST_SUITE("embedded_methods") {
    TEST_CASE("the pairs of this test have the orders their authors claim") {
        for (const Pair& pair : pairs()) {
            for (int k = 0; k < pair.order; ++k)
                CHECK(quadrature(pair, pair.b, k) == doctest::Approx(1.0 / (k + 1)).epsilon(1e-13));
            for (int k = 0; k < pair.embedded_order; ++k)
                CHECK(quadrature(pair, pair.b_hat, k) == doctest::Approx(1.0 / (k + 1)).epsilon(1e-13));
            CHECK(std::abs(quadrature(pair, pair.b_hat, pair.embedded_order) - 1.0 / (pair.embedded_order + 1)) > 1e-4);
            if (pair.order >= 3)
                CHECK(tall_tree(pair, pair.b) == doctest::Approx(1.0 / 6.0).epsilon(1e-13));
            if (pair.embedded_order >= 3)
                CHECK(tall_tree(pair, pair.b_hat) == doctest::Approx(1.0 / 6.0).epsilon(1e-13));
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "steps and their estimated errors are those of the pairs") {
        // elastic simple shear with the Jaumann rate: ds/dt = g tau, dtau/dt = g (mu - s) at every point
        const double g = 0.5, dt = 0.8;
        const Scene scene = fields::scene_on({9, 6, 2.0, 2.0}, Model::full, {g, 0.0}, elastic());
        for (const Pair& pair : pairs()) {
            const auto rate = [&](const std::array<double, 2>& y) { return std::array{g * y[1], g * (mu - y[0])}; };
            std::vector<std::array<double, 2>> k;
            for (const auto& row : pair.a) {
                std::array<double, 2> y{};
                for (std::size_t j = 0; j < row.size(); ++j)
                    for (std::size_t m = 0; m < 2; ++m)
                        y[m] += dt * row[j] * k[j][m];
                k.push_back(rate(y));
            }
            std::array<double, 2> end{}, error{};
            for (std::size_t i = 0; i < k.size(); ++i)
                for (std::size_t m = 0; m < 2; ++m) {
                    end[m] += dt * pair.b[i] * k[i][m];
                    error[m] += dt * (pair.b[i] - pair.b_hat[i]) * k[i][m];
                }
            auto stepper = stepper_for(pair.scheme, scene, uniform(scene, 0.0));
            const StepAttempt attempt = stepper.advance(dt, dt);
            CAPTURE(pair.scheme);
            CHECK(attempt.measure == doctest::Approx(std::sqrt(2.0) * std::hypot(error[0], error[1])).epsilon(1e-9));
            CHECK(attempt.measure > 1e-4);
            CHECK(attempt.error == attempt.measure);
            fields::check_uniform(stepper.state().cells.stress.s, end[0], 1e-12);
            fields::check_uniform(stepper.state().cells.stress.tau, end[1], 1e-12);
        }
        // Sommeijer, Shampine & Verwer: 0.8 (y_n - y_{n+1}) + 0.4 dt (f_n + f_{n+1})
        auto stepper = stepper_for("chebyshev", scene, uniform(scene, 0.0));
        const StepAttempt attempt = stepper.advance(dt, dt);
        const double s = stepper.state().cells.stress.s(3, 3), tau = stepper.state().cells.stress.tau(3, 3);
        CHECK(std::abs(tau - mu * std::sin(g * dt)) < 0.03 * mu * g * dt);
        const double error_s = -0.8 * s + 0.4 * dt * (0.0 + g * tau), error_tau = -0.8 * tau + 0.4 * dt * (g * mu + g * (mu - s));
        CHECK(attempt.measure == doctest::Approx(std::sqrt(2.0) * std::hypot(error_s, error_tau)).epsilon(1e-9));
    }

    TEST_CASE_FIXTURE(fields::OneThread, "the norm of an error is that of the 3 x 3 stress, and the root mean square") {
        const Grid grid{13, 5, 2.0, 2.0};
        const Scene scene = fields::scene_on(grid, Model::full, {U, 0.0});
        std::mt19937 engine(11);
        CellState a(grid, 1), b(grid, 1);
        for (CellState* cells : {&a, &b})
            for (Field* f : fields::fields_of(*cells))
                fields::fill_randomly(*f, engine, -1.0, 1.0);
        double stress = 0.0, internal = 0.0;
        for (int j = 0; j < 5; ++j)
            for (int i = 0; i < 13; ++i) {
                const auto at = [&](std::size_t k) {
                    return 0.7 * (*fields::fields_of(a)[k])(i, j) - 1.9 * (*fields::fields_of(b)[k])(i, j);
                };
                const double p = at(0), s = at(1), tau = at(2), q = at(3);
                const double xx = -p + s - q, yy = -p - s - q, zz = -p + 2.0 * q;
                stress += xx * xx + yy * yy + zz * zz + 2.0 * tau * tau;
                internal += at(4) * at(4);
            }
        const CombinationNorm n = fields::norm(scene, std::array{Space::Term{&a, 0.7}, Space::Term{&b, -1.9}});
        CHECK(n.stress == doctest::Approx(std::sqrt(stress / 65.0)).epsilon(1e-13));
        CHECK(n.internal * fields::stz.variables()[0].natural_scale() ==
              doctest::Approx(std::sqrt(internal / 65.0)).epsilon(1e-13));
    }

    TEST_CASE_FIXTURE(fields::OneThread, "the longest stable steps: of relaxation by the stability polynomials, of advection") {
        // 1 + z + z^2/2 + ..., with the sixth power of Dormand and Prince
        const auto growth = [](const std::string& scheme, double z) {
            if (scheme == "ralston")
                return 1.0 + z + z * z / 2.0;
            const double three = 1.0 + z + z * z / 2.0 + z * z * z / 6.0;
            return scheme == "bogacki-shampine" ? three
                                                : three + std::pow(z, 4) / 24.0 + std::pow(z, 5) / 120.0 + std::pow(z, 6) / 600.0;
        };
        const Grid grid{7, 5, 2.0, 3.0};
        const double chi = 700.0 / 21000.0, wall_u = 3e-7, wall_v = -1e-7;
        const Scene scene = fields::scene_on(grid, Model::full, {wall_u, wall_v});
        State start = uniform(scene, chi);
        fill(start.cells.stress.tau, 1.1);
        for (const Pair& pair : pairs()) {
            auto stepper = stepper_for(pair.scheme, scene, start);
            const StepAttempt attempt = stepper.advance(1.0, 1.0);
            const CellState& cells = stepper.state().cells;
            const double s = cells.stress.s(1, 1), tau = cells.stress.tau(1, 1), q = cells.stress.q(1, 1);
            const double sbar = std::sqrt(s * s + tau * tau + 3.0 * q * q), h = 1e-6;
            const auto flow = [&](double stress) {
                return stress * fields::stz.rates(stress, std::array{cells.internal[0](1, 1)}).fluidity;
            };
            const double relaxation = 2.0 * mu * (flow(sbar + h) - flow(sbar - h)) / (2.0 * h);
            const double reach = attempt.relaxation_step * relaxation;
            CAPTURE(pair.scheme);
            CHECK(reach == doctest::Approx(pair.stability).epsilon(1e-5));
            CHECK(std::abs(growth(pair.scheme, -reach)) <= 1.0 + 1e-5);
            CHECK(std::abs(growth(pair.scheme, -1.01 * reach)) > 1.0);
            // the shortest wave decays at four times the Courant rate, largest at the walls
            const double courant = wall_u / grid.dx() + std::abs(wall_v) / grid.dy();
            CHECK(attempt.advection_step * 4.0 * courant == doctest::Approx(pair.stability).epsilon(1e-6));
        }
        auto stepper = stepper_for("chebyshev", scene, start);
        const StepAttempt attempt = stepper.advance(1.0, 1.0);
        CHECK(attempt.advection_step * (wall_u / grid.dx() + std::abs(wall_v) / grid.dy()) == doctest::Approx(0.5).epsilon(1e-6));
    }

    TEST_CASE_FIXTURE(fields::OneThread, "the line through two velocities is so good a guess that one pass suffices") {
        const Scene scene = fields::scene_on({12, 10, 2.0, 2.0}, Model::full, {U, 0.0});
        State start = fields::initial_state(
            scene,
            initial_internal(scene.grid, RandomField{.mean = 0.033, .deviation = 0.0015, .correlation_length = 0.25, .seed = 5},
                             scene.law->variables()[0]));
        fill(start.cells.stress.tau, 1.1);
        auto stepper = stepper_for("bogacki-shampine", scene, start, {.largest = 4, .tolerance = 1e-5});
        for (int n = 1; n <= 20; ++n)
            stepper.advance(100.0, n * 100.0);
        CHECK(stepper.counts().elliptic_solves < 1.2 * static_cast<double>(stepper.counts().evaluations));
    }

    TEST_CASE_FIXTURE(fields::OneThread, "the program stops the velocity passes at a tenth of the tolerance") {
        Options options;
        options.cells = {16, 12};
        options.tolerance = "1e-6";
        options.scheme = "bogacki-shampine";
        const Scene scene = make_scene(options);
        State start = uniform(scene, 0.033);
        std::mt19937 engine(2);
        fields::fill_smoothly(start.cells.internal[0], engine, 0.033, 0.0006);
        fill(start.cells.stress.tau, 1.1);
        const auto solves = [&](fields::Stepping stepper) {
            for (int n = 1; n <= 12; ++n)
                stepper.advance(500.0, 500.0 * n);
            return stepper.counts().elliptic_solves;
        };
        const auto with = [&](double tolerance) {
            return solves(stepper_for("bogacki-shampine", scene, start, {.largest = 4, .tolerance = tolerance}));
        };
        const long long program = solves({make_time_stepper(options, scene, fields::space_for(scene)), start});
        CHECK(program == with(1e-7));
        CHECK(program < with(1e-9));
        CHECK(program > with(1e-5));
    }

    TEST_CASE_FIXTURE(fields::OneThread, "auto is bogacki-shampine to the last bit where nothing is stiff") {
        for (const Model model : {Model::reduced, Model::full}) {
            const Scene scene = fields::scene_on({20, 16, 2.0, 2.0}, model, {U, 0.0});
            const State start = fields::initial_state(
                scene, initial_internal(scene.grid, PaperPattern{640. / 21000, 180. / 21000}, scene.law->variables()[0]));
            std::array<State, 2> ends;
            for (std::size_t k = 0; k < 2; ++k) {
                auto stepper = stepper_for(k == 0 ? "auto" : "bogacki-shampine", scene, start);
                StepControl control(scene.grid, ErrorSteps{.tolerance = 1e-4, .order = 3});
                control.start(stepper.time_scale());
                (void)integrate(stepper, control, 35e4);
                ends[k] = stepper.state();
                if (k == 0) {
                    CHECK(stepper.steps_by_method()[0] == std::pair{std::string("bogacki-shampine"), stepper.state().step});
                    CHECK(stepper.steps_by_method()[1].second == 0);
                }
            }
            CHECK(fields::same_bits(ends[0], ends[1]));
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread,
                      "auto hands over where flow is stiff, gives back where it no longer is, and loses nothing") {
        Scene scene = fields::scene_on({8, 6, 2.0, 2.0}, Model::full, {U, 0.0});
        const double stop = 30e4;
        scene.walls = moving(WallHistory({{0.0, {U, 0.0}}, {stop, {U, 0.0}}, {stop, {-U, 0.0}}})); // elastic again from there
        const State start = fields::initial_state(
            scene, initial_internal(scene.grid, PaperPattern{1100. / 21000, 100. / 21000}, scene.law->variables()[0]));
        const auto run_with = [&](const std::string& scheme, double tolerance, double end, long long& evaluations) {
            auto stepper = stepper_for(scheme, scene, start, {.largest = 4, .tolerance = 0.1 * tolerance}, tolerance);
            StepControl control(scene.grid, ErrorSteps{.tolerance = tolerance, .order = 3});
            control.start(stepper.time_scale());
            (void)integrate(stepper, control, std::min(end, stop));
            evaluations = stepper.counts().evaluations;
            const auto at_stop = stepper.steps_by_method();
            if (end > stop)
                for (int n = 1; n <= 60; ++n)
                    stepper.advance((end - stop) / 60.0, stop + n * (end - stop) / 60.0);
            if (scheme == "auto") {
                CHECK(at_stop[0].second >= 20);
                CHECK(at_stop[1].second > 20);
                if (end > stop)
                    CHECK(stepper.steps_by_method()[0].second > at_stop[0].second); // back
            }
            return stepper.state();
        };
        long long automatic = 0, tight = 0;
        const State end = run_with("auto", 1e-4, stop, automatic);
        const State exact = run_with("chebyshev", 1e-7, stop, tight);
        double stress = 0.0;
        for (std::size_t k = 0; k < 4; ++k)
            stress = std::max(stress, fields::distance(*fields::fields_of(end.cells)[k], *fields::fields_of(exact.cells)[k]));
        CHECK(stress < 1e-3);
        CHECK(fields::distance(end.cells.internal[0], exact.cells.internal[0]) / fields::stz.variables()[0].natural_scale() <
              1e-3);
        CHECK(automatic < 6000);
        (void)run_with("auto", 1e-4, stop + 4e4, automatic);
    }
}

} // namespace embedded_methods_suite
