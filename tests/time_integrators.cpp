// SPDX-License-Identifier: GPL-3.0-or-later
// The time integrators on a system of the test's own, which has no space: orders of convergence and estimates of the error
// against the tight solution of ARKODE, ARKODE through the same seam, and what a method remembers.
#include <ductile/sundials/erk.hpp>
#include <ductile/time/arkode.hpp>
#include <ductile/time/chebyshev.hpp>
#include <ductile/time/runge_kutta.hpp>
#include <ductile/time/switching.hpp>

#include <array>
#include <cmath>
#include <doctest/doctest.h>
#include <functional>
#include <limits>
#include <memory>
#include <string>

namespace time_integrators_suite {

using namespace ductile;

namespace {

using Point = std::array<double, 2>; ///< angle and its rate

/// A damped pendulum that is driven: x'' = -sin x - x'/2 + cos(2 t)/2. Its damping is what evaluate() leaves open.
class Pendulum final : public time::System<Point> {
public:
    [[nodiscard]] static Point rate(double t, const Point& y) {
        return {y[1], -std::sin(y[0]) - 0.5 * y[1] + 0.5 * std::cos(2.0 * t)};
    }

    [[nodiscard]] Point make() const override { return {}; }
    time::OpenRate<Point> evaluate(Point& y, double fraction, Point& rate) override {
        rate = {y[1], -std::sin(y[0]) + 0.5 * std::cos(2.0 * stage_time(fraction))};
        damping_ = -0.5 * y[1];
        return {&rate};
    }
    void close(time::OpenRate<Point> rate) override { (*rate.vector)[1] += damping_; }
    void combine(std::span<const time::Term<Point>> terms, Point& out) override { out = sum(terms); }
    void combine(std::span<const time::Term<Point>> terms, time::OpenRate<Point> rate, double factor, time::Completed completed,
                 Point& out) override {
        Point closed = *rate.vector, total = sum(terms);
        closed[1] += damping_;
        for (std::size_t k = 0; k < 2; ++k)
            total[k] += factor * closed[k];
        if (completed == time::Completed::kept)
            *rate.vector = closed;
        out = total;
    }
    [[nodiscard]] double norm(std::span<const time::Term<Point>> terms) override {
        const Point p = sum(terms);
        return std::hypot(p[0], p[1]);
    }

    [[nodiscard]] std::size_t components() const override { return 2; }
    [[nodiscard]] double norm_of_components() const override { return std::sqrt(2.0); }
    void pack(const Point& y, std::span<double> values) const override { std::ranges::copy(y, values.begin()); }
    void unpack(std::span<const double> values, Point& y) const override { std::ranges::copy(values, y.begin()); }

private:
    [[nodiscard]] static Point sum(std::span<const time::Term<Point>> terms) {
        Point total{};
        for (const auto& term : terms)
            for (std::size_t k = 0; k < 2; ++k)
                total[k] += term.factor * (*term.vector)[k];
        return total;
    }

    double damping_ = 0.0;
};

constexpr Point start{2.0, -0.3};
constexpr double begin = 0.25, end = 3.25;

struct Result {
    Point y{};
    double estimate = 0.0; ///< of the last step
};

/// Equal steps from `start`.
Result integrate(time::Method<Point>& method, time::System<Point>& system, int steps, double last = end) {
    Result result{start};
    Point rate{}, next{}, next_rate{};
    std::vector<double> memory(method.memory().size(), 0.0);
    const double dt = (last - begin) / steps;
    for (int n = 0; n < steps; ++n) {
        system.begin_step(begin + n * dt, dt, n + 1 == steps ? last : begin + (n + 1) * dt);
        if (n == 0)
            system.close(system.evaluate(result.y, 0.0, rate));
        result.estimate = method.advance({.start = result.y,
                                          .start_rate = rate,
                                          .next = next,
                                          .next_rate = next_rate,
                                          .dt = dt,
                                          .relaxation = 0.5,
                                          .memory = memory});
        result.y = next;
        rate = next_rate;
        method.accept(dt, result.estimate, 0.5, memory);
    }
    return result;
}

double distance(const Point& a, const Point& b) { return std::hypot(a[0] - b[0], a[1] - b[1]); }

const Point& exact() {
    static const Point end_of_it = [] {
        const auto f = [](double t, std::span<const double> y, std::span<double> rate) {
            std::ranges::copy(Pendulum::rate(t, {y[0], y[1]}), rate.begin());
        };
        Point y = start;
        sundials::ErkIntegrator(f, 2, {.relative_tolerance = 1e-13, .absolute_tolerance = 1e-14}).integrate(y, begin, end);
        return y;
    }();
    return end_of_it;
}

/// Where the solution is at a time, tightly.
Point exact_at(double time) {
    const auto f = [](double t, std::span<const double> y, std::span<double> rate) {
        std::ranges::copy(Pendulum::rate(t, {y[0], y[1]}), rate.begin());
    };
    Point y = start;
    sundials::ErkIntegrator(f, 2, {.relative_tolerance = 1e-13, .absolute_tolerance = 1e-14}).integrate(y, begin, time);
    return y;
}

/// Errors of the first step of length dt: within it, at 0.3 of the way, and at its end.
std::array<double, 2> errors_of_step(time::Method<Point>& method, time::System<Point>& system, double dt) {
    Point y = start, rate{}, next{}, next_rate{}, within{};
    std::vector<double> memory(method.memory().size(), 0.0);
    system.begin_step(begin, dt, begin + dt);
    system.close(system.evaluate(y, 0.0, rate));
    const time::Step<Point> step{
        .start = y, .start_rate = rate, .next = next, .next_rate = next_rate, .dt = dt, .relaxation = 0.5, .memory = memory};
    (void)method.advance(step);
    method.interpolate(step, 0.3, within);
    const std::array errors{distance(within, exact_at(begin + 0.3 * dt)), distance(next, exact_at(begin + dt))};
    method.interpolate(step, 0.0, within);
    CHECK(within == y);
    method.interpolate(step, 1.0, within);
    CHECK(within == next);
    return errors;
}

/// A method by the name that users give it.
std::unique_ptr<time::Method<Point>> method_of(const std::string& name, time::System<Point>& system) {
    if (name == "chebyshev")
        return std::make_unique<time::Chebyshev<Point>>(system);
    return std::make_unique<time::RungeKutta<Point>>(system, time::butcher_table(name));
}

} // namespace

TEST_SUITE("time_integrators") {
    TEST_CASE("what a method says of times within a step has the order of its end, four at least and five at most") {
        for (const std::string name : {"chebyshev", "ralston", "bogacki-shampine", "dormand-prince"}) {
            CAPTURE(name);
            Pendulum pendulum;
            const auto method = method_of(name, pendulum);
            REQUIRE(method->interpolates());
            const double dt = name == "dormand-prince" ? 0.2 : 0.05;
            const auto [within, at_end] = errors_of_step(*method, pendulum, dt);
            const auto [half_within, half_at_end] = errors_of_step(*method, pendulum, 0.5 * dt);
            const int order = name == "dormand-prince" ? 5 : name == "bogacki-shampine" ? 4 : 3; // of one step
            CHECK(std::log2(within / half_within) > order - 0.3);
            CHECK(within < (name == "dormand-prince" ? 20.0 : 1.5) * at_end); // whose end has one order more
            CHECK(half_at_end < at_end);
        }
    }

    TEST_CASE("every explicit method converges with its order, and its estimate falls with the order it claims") {
        struct Claim {
            std::string name;
            int order, estimate_order;
        };
        std::vector<Claim> claims{{"chebyshev", 2, 3}};
        for (const time::ButcherTable& table : time::butcher_tables())
            claims.push_back({std::string(table.name), table.order, table.estimate_order});
        CHECK(claims.size() >= 4);
        for (const Claim& claim : claims) {
            Pendulum pendulum;
            const auto method = method_of(claim.name, pendulum);
            const int steps = claim.order > 3 ? 40 : 160;
            const double coarse = distance(integrate(*method, pendulum, steps).y, exact());
            const double fine = distance(integrate(*method, pendulum, 2 * steps).y, exact());
            CAPTURE(claim.name);
            CHECK(std::log2(coarse / fine) == doctest::Approx(claim.order).epsilon(0.08));
            const double dt = claim.order > 3 ? 0.1 : 0.02;
            const double estimate = integrate(*method, pendulum, 1, begin + dt).estimate;
            const double of_half = integrate(*method, pendulum, 1, begin + 0.5 * dt).estimate;
            CHECK(std::log2(estimate / of_half) == doctest::Approx(claim.estimate_order).epsilon(0.08));
        }
    }

    TEST_CASE("a table of a user's own is a method") {
        // Heun's third-order method with b as its last stage; the embedded one has the weights 0, 1/2, 1/2
        const time::ButcherTable heun{.name = "heun",
                                      .meaning = {},
                                      .order = 3,
                                      .estimate_order = 3,
                                      .c = {0, 1. / 3, 2. / 3, 1},
                                      .a = {{}, {1. / 3}, {0, 2. / 3}, {1. / 4, 0, 3. / 4}},
                                      .error = {1. / 4, -1. / 2, 1. / 4, 0},
                                      .real_stability = 2.5};
        Pendulum pendulum;
        time::RungeKutta<Point> method(pendulum, heun);
        const double coarse = distance(integrate(method, pendulum, 100).y, exact());
        const double fine = distance(integrate(method, pendulum, 200).y, exact());
        CHECK(std::log2(coarse / fine) == doctest::Approx(3.0).epsilon(0.08));
    }

    TEST_CASE("ARKODE takes the same steps through the same seam, and reaches its own tolerance") {
        const std::pair<const char*, sundials::ErkOptions> pairs[] = {
            {"ralston", {.table = sundials::paper_rk21()}},
            {"bogacki-shampine", {.method = sundials::ErkMethod::bogacki_shampine}},
            {"dormand-prince", {.method = sundials::ErkMethod::dormand_prince}}};
        for (const auto& [name, options] : pairs) {
            const std::string scheme = name;
            CAPTURE(scheme);
            Pendulum ours, theirs;
            time::Arkode<Point> arkode(theirs, {.fixed = true}, options);
            const Result result = integrate(arkode, theirs, 25);
            CHECK(distance(result.y, integrate(*method_of(name, ours), ours, 25).y) < 1e-14);
            CHECK(arkode.inner_counts().steps == 25);
            CHECK(result.estimate > 1e-6);

            double coarse = 0.0;
            for (const double tolerance : {1e-5, 1e-8}) {
                time::Arkode<Point> adaptive(theirs, {.tolerance = tolerance}, options);
                const Result reached = integrate(adaptive, theirs, 2);
                const double error = distance(reached.y, exact());
                CHECK(error < 50.0 * tolerance);
                CHECK(reached.estimate == tolerance);
                if (coarse > 0.0)
                    CHECK(error < 0.05 * coarse);
                coarse = error;
            }
        }
    }

    TEST_CASE("a step of SUNDIALS can be given up from within") {
        Pendulum pendulum;
        int calls = 0;
        time::Arkode<Point> arkode(pendulum, {.tolerance = 1e-10, .poll = [&] {
                                                  if (++calls > 20)
                                                      throw RunError("enough");
                                              }});
        CHECK_THROWS_WITH_AS((void)integrate(arkode, pendulum, 1), doctest::Contains("enough"), RunError);
        CHECK(calls == 21);
    }

    TEST_CASE("what a switching method remembers is the caller's: one method serves two runs in turn") {
        Pendulum pendulum;
        using Switching = time::Switching<Point>;
        const Switching method(Switching::Named{"bogacki-shampine", method_of("bogacki-shampine", pendulum)},
                               Switching::Named{"chebyshev", method_of("chebyshev", pendulum)}, 1e-4);
        CHECK(method.memory() ==
              std::vector<std::string>{"chebyshev_in_use", "steps_for_a_change", "steps_bogacki-shampine", "steps_chebyshev"});
        std::vector<double> stiff(4, 0.0), mild(4, 0.0);
        for (int n = 0; n < 25; ++n) {
            // errors would allow a hundred times the step that stability of the common method does
            method.accept(n < 20 ? 1e-3 : 0.05, 1e-13, 2500.0, stiff);
            method.accept(1e-3, 1e-5, 0.5, mild);
        }
        CHECK(stiff == std::vector<double>{1.0, 0.0, 20.0, 5.0});
        CHECK(mild == std::vector<double>{0.0, 0.0, 25.0, 0.0});
        CHECK(method.relaxation_step(1.0, mild) == 2.5);
        CHECK(method.relaxation_step(1.0, stiff) > 1e4);
        for (int n = 0; n < 20; ++n)
            method.accept(1e-3, 1e-5, 1.0, stiff); // no longer stiff
        CHECK(stiff[0] == 0.0);
        CHECK(method.steps_by_method(stiff)[1] == std::pair{std::string("chebyshev"), 25LL});
        for (const double count : {1e308, -1.0, std::numeric_limits<double>::quiet_NaN()})
            CHECK(method.steps_by_method(std::array{0.0, 0.0, count, count})[0].second == 0);
    }
}

} // namespace time_integrators_suite
