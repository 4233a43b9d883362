// SPDX-License-Identifier: GPL-3.0-or-later
#include "matrix.hpp"
#include "messages.hpp"
#include <ductile/base/error.hpp>
#include <ductile/point/comparison.hpp>
#include <ductile/point/options.hpp>

#include <cmath>
#include <doctest/doctest.h>
#include <limits>
#include <random>
#include <string>

namespace point_suite {

using namespace ductile;
using namespace ductile::point;

namespace {

constexpr IsotropicElasticity glass{.bulk_modulus = 122.0 / 0.85, .shear_modulus = 37.4 / 0.85};
constexpr double K = glass.bulk_modulus, mu = glass.shear_modulus;
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

Law elastic() { return perzyna_law(glass, {.yield_stress = 1e30}, Units{}); }
Law metallic_glass() { return stz_law(glass, StzParameters{}, Units{}); }
const State at_rest{0.0, 0.0, 0.0, 0.0, 640.0 / 21000.0};

double distance(const State& a, const State& b) {
    double d = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i)
        d = std::max(d, std::abs(a[i] - b[i]));
    return d;
}

/// The state at the end by every method, compared with what it must be.
void expect_end(const GradientHistory& history, const State& start, const State& expected, double bound) {
    for (const Method method : all_methods) {
        CAPTURE(name(method));
        const Trajectory trajectory = integrate(elastic(), history, start, method, 1e-9);
        CHECK(distance(trajectory.state.back(), expected) < bound);
    }
}

using tensors::Matrix;
using tensors::product;

Matrix stress_matrix(const State& y) {
    const double p = y[0], s = y[1], tau = y[2], q = y[3];
    return {{{-p + s - q, tau, 0.0}, {tau, -p - s - q, 0.0}, {0.0, 0.0, -p + 2.0 * q}}};
}

} // namespace

TEST_SUITE("point") {
    TEST_CASE("the rate is that of the tensors") {
        // d sigma/dt = W sigma - sigma W + C : (D - D^pl), W the skew part of grad v, all 3 x 3.
        std::mt19937 engine(1);
        std::uniform_real_distribution<double> uniform(-1.0, 1.0);
        const Law law = perzyna_law(glass, {.yield_stress = 0.5 * 0.85e9, .reference_rate = 1e5}, Units{});
        for (int repeat = 0; repeat < 50; ++repeat) {
            const VelocityGradient<double> g{uniform(engine), uniform(engine), uniform(engine), uniform(engine)};
            const State y{uniform(engine), uniform(engine), uniform(engine), uniform(engine), 0.0};
            const Matrix gradient{{{g.ux, g.uy, 0.0}, {g.vx, g.vy, 0.0}, {0.0, 0.0, 0.0}}};
            const Matrix stress = stress_matrix(y);
            const double sbar = std::sqrt(y[1] * y[1] + y[2] * y[2] + 3.0 * y[3] * y[3]);
            const double flow = sbar < 0.5 ? 0.0 : 1e5 * 4.05e-6 * (sbar / 0.5 - 1.0);
            Matrix spin{}, elastic_strain{};
            for (std::size_t i = 0; i < 3; ++i)
                for (std::size_t j = 0; j < 3; ++j) {
                    spin[i][j] = 0.5 * (gradient[i][j] - gradient[j][i]);
                    const double deviatoric = stress[i][j] + (i == j ? y[0] : 0.0);
                    elastic_strain[i][j] = 0.5 * (gradient[i][j] + gradient[j][i]) - flow / sbar * deviatoric;
                }
            const double trace = elastic_strain[0][0] + elastic_strain[1][1] + elastic_strain[2][2];
            const Matrix turned = product(spin, stress), turned_back = product(stress, spin);
            State slope(5);
            rate(law, g, y, slope);
            const Matrix slope_matrix = stress_matrix(slope);
            for (std::size_t i = 0; i < 3; ++i)
                for (std::size_t j = 0; j < 3; ++j) {
                    const double expected = turned[i][j] - turned_back[i][j] + 2.0 * mu * elastic_strain[i][j] +
                                            (i == j ? (K - 2.0 / 3.0 * mu) * trace : 0.0);
                    CHECK(std::abs(slope_matrix[i][j] - expected) < 1e-12 * K);
                }
            CHECK(slope[4] == doctest::Approx(flow));
        }
    }

    TEST_CASE("elastic loading follows its closed forms") {
        const State none(5);
        const double strain = 0.8; // large: the spin turns the stress by 46 degrees
        const double sine = std::sin(strain), cosine = std::cos(strain);
        expect_end(load_along(Path::simple_shear, 1.0, strain), none, {0.0, mu * (1.0 - cosine), mu * sine, 0.0, 0.0}, 1e-5);
        expect_end(load_along(Path::simple_shear, -0.5, 2.0 * strain), none, {0.0, mu * (1.0 - cosine), -mu * sine, 0.0, 0.0},
                   1e-5);
        const double exact = 1e-12 * K; // constant rates
        expect_end(load_along(Path::shear_without_spin, 1.0, strain), none, {0.0, 0.0, mu * strain, 0.0, 0.0}, exact);
        expect_end(load_along(Path::pure_shear, 1.0, strain), none, {0.0, mu * strain, 0.0, 0.0, 0.0}, exact);
        expect_end(load_along(Path::compression, 1.0, strain), none, {K * strain, mu * strain, 0.0, mu / 3.0 * strain, 0.0},
                   exact);
        expect_end({{strain, {.ux = -1.0, .uy = 0.0, .vx = 0.0, .vy = -1.0}}}, none,
                   {2.0 * K * strain, 0.0, 0.0, 2.0 / 3.0 * mu * strain, 0.0}, exact);
        // A rigid rotation by `strain` turns the deviator by twice the angle; to and fro leaves nothing behind.
        const VelocityGradient<double> rotation{.ux = 0.0, .uy = -1.0, .vx = 1.0, .vy = 0.0};
        const VelocityGradient<double> back{.ux = 0.0, .uy = 1.0, .vx = -1.0, .vy = 0.0};
        const State stressed{0.7, 0.5, 0.0, 0.2, 0.0};
        expect_end({{strain, rotation}}, stressed, {0.7, 0.5 * std::cos(2.0 * strain), 0.5 * std::sin(2.0 * strain), 0.2, 0.0},
                   1e-7);
        expect_end({{strain, rotation}, {strain, back}}, stressed, stressed, 1e-7);
    }

    TEST_CASE("pure shear is shear without spin turned by 45 degrees, step by step") {
        for (const Method method : {Method::rk21, Method::dormand_prince, Method::bdf}) {
            CAPTURE(name(method));
            const double rate = 2e-7, duration = 35e4, tolerance = 1e-6; // the step control amplifies rounding
            const Trajectory along =
                integrate(metallic_glass(), load_along(Path::pure_shear, rate, duration), at_rest, method, tolerance);
            const Trajectory across =
                integrate(metallic_glass(), load_along(Path::shear_without_spin, rate, duration), at_rest, method, tolerance);
            REQUIRE(along.time.size() == across.time.size());
            for (std::size_t i = 0; i < along.time.size(); ++i) {
                const State& y = along.state[i];
                CHECK(distance(across.state[i], {y[0], y[2], y[1], y[3], y[4]}) < 0.01 * tolerance);
            }
        }
    }

    TEST_CASE("yield, overshoot, softening: all methods agree at tight tolerances") {
        for (const Path path : {Path::simple_shear, Path::shear_without_spin, Path::pure_shear, Path::compression}) {
            const GradientHistory history = load_along(path, 2e-7, 35e4);
            const auto agrees = [&](Method method, double tolerance) {
                CAPTURE(name(method));
                CAPTURE(tolerance);
                const Trajectory trajectory = integrate(metallic_glass(), history, at_rest, method, tolerance);
                double peak = 0.0, last = 0.0;
                for (const State& y : trajectory.state) {
                    last = std::sqrt(y[1] * y[1] + y[2] * y[2] + 3.0 * y[3] * y[3]);
                    peak = std::max(peak, last);
                }
                CHECK(peak > 1.4);
                CHECK(last < 0.95 * peak);
                CHECK(trajectory.state.back()[4] > 1.04 * at_rest[4]);
                // At most the sum of what the error test lets pass: the tolerance a step, in the root mean square of five
                // components, each divided by 1 + |y| (p is exact, and |y| < 1.6 for the others).
                const double error = largest_error(metallic_glass(), history, trajectory);
                CHECK(error < std::sqrt(5.0) * 2.6 * tolerance * static_cast<double>(trajectory.counts.steps));
            };
            for (const Method method : all_methods)
                for (const double tolerance : {1e-7, 1e-8, 1e-9})
                    agrees(method, tolerance);
        }
    }

    TEST_CASE("errors fall with the tolerance; the trajectory covers every segment") {
        const GradientHistory history{{15e4, {.ux = 0.0, .uy = 2e-7, .vx = 0.0, .vy = 0.0}},
                                      {20e4, {.ux = 0.0, .uy = -2e-7, .vx = 0.0, .vy = 1e-8}},
                                      {5e4, {.ux = 1e-7, .uy = 0.0, .vx = 0.0, .vy = 0.0}}};
        for (const Method method : all_methods) {
            CAPTURE(name(method));
            double previous = 1.0;
            for (const double tolerance : {1e-4, 1e-6, 1e-8}) {
                const Run run = measure(metallic_glass(), history, at_rest, method, tolerance);
                CHECK(run.largest_error < 0.2 * previous);
                previous = run.largest_error;
                const Trajectory& t = run.trajectory;
                REQUIRE(t.segment_end.size() == 3);
                CHECK(t.time[t.segment_end[0]] == doctest::Approx(15e4).epsilon(1e-14));
                CHECK(t.time[t.segment_end[1]] == doctest::Approx(35e4).epsilon(1e-14));
                CHECK(t.time[t.segment_end[2]] == doctest::Approx(40e4).epsilon(1e-14));
                CHECK(t.segment_end[2] + 1 == t.time.size());
                CHECK(t.time.size() == t.state.size());
                CHECK(t.counts.steps + 1 == static_cast<long long>(t.time.size()));
            }
        }
    }

    TEST_CASE("histories are read, and wrong ones refused") {
        const GradientHistory history = parse_gradient_history("0.7:0:5e-2:0:-0.1, 1:1:2:3:4");
        REQUIRE(history.size() == 2);
        CHECK(history[0].duration == 0.7);
        CHECK(history[0].gradient.uy == 5e-2);
        CHECK(history[0].gradient.vy == -0.1);
        CHECK(history[1].gradient.ux == 1.0);
        CHECK(history[1].gradient.vx == 3.0);
        CHECK(shear_rate(load_along(Path::simple_shear, 3.0, 1.0)[0].gradient) == doctest::Approx(3.0));
        CHECK(shear_rate(load_along(Path::shear_without_spin, -3.0, 1.0)[0].gradient) == doctest::Approx(3.0));
        CHECK(shear_rate(load_along(Path::pure_shear, 3.0, 1.0)[0].gradient) == doctest::Approx(3.0));
        CHECK(shear_rate(load_along(Path::compression, 3.0, 1.0)[0].gradient) == doctest::Approx(2.0 * std::sqrt(3.0)));
        const auto refused = [](const std::string& text) {
            return message_of<InputError>([&] { (void)parse_gradient_history(text); });
        };
        CHECK(contains(refused("1:0:1:0:0,2:0:1"), "--gradient-history: '2:0:1' in '1:0:1:0:0,2:0:1': it has 3 numbers"));
        for (const char* text : {"", "1:0:1:0:0,", "1:0:1:0:0:0", "1:0:x:0:0", "1::1:0:0", "1:0:1:0:nan", "a"})
            CHECK(contains(refused(text), "give segments duration:du/dx:du/dy:dv/dx:dv/dy"));
        CHECK(contains(refused("1:0:1:0:0,-1:0:1:0:0"), "segment 2: its duration is -1"));
        CHECK(contains(refused("0:0:1:0:0"), "segment 1: its duration is 0"));
        CHECK(contains(message_of<InputError>([] { check(GradientHistory{}); }), "empty"));
        CHECK(contains(message_of<InputError>([] { (void)load_along(Path::pure_shear, not_a_number, 1.0); }),
                       "segment 1: a component"));
        Options options;
        options.tolerances.clear();
        CHECK(contains(message_of<InputError>([&] { check(options); }), "--tolerance: give at least one"));
    }

    TEST_CASE("a method that gives up says which, where and what to change") {
        const Law stiff = perzyna_law(glass, {.yield_stress = 0.85e9, .reference_rate = 1e30}, Units{});
        const std::string message = message_of<RunError>(
            [&] { (void)integrate(stiff, load_along(Path::simple_shear, 1.0, 1.0), State(5), Method::rk21, 1e-6); });
        for (const char* part : {"rk21, tolerance 1e-06, segment 1 of the loading: ", "the step shrank to nothing", "change the"})
            CHECK(contains(message, part));
    }
}

} // namespace point_suite
