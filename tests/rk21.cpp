// SPDX-License-Identifier: GPL-3.0-or-later
#include "rk21_reference.hpp"
#include <ductile/material/stz.hpp>
#include <ductile/ode/rk21.hpp>
#include <ductile/point/integrate.hpp>
#include <ductile/sundials/erk.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <doctest/doctest.h>
#include <limits>
#include <random>
#include <utility>
#include <vector>

namespace rk21_suite {

using namespace ductile;

namespace {

constexpr Rk21Options no_control{.absolute_tolerance = 1e30, .relative_tolerance = 0.0};
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// y' = -y^2, z' = 2 y z, w' = w z/(1 + w^2): from (1, 1, w0) y = 1/(1 + t), z = (1 + t)^2, and w^2/2 + ln w = ((1 + t)^3 - 1)/3
/// + c.
template <class V> std::array<V, 3> nonlinear(const std::array<V, 3>& y) {
    return {-(y[0] * y[0]), V(2.0) * y[0] * y[1], y[2] * y[1] / (V(1.0) + y[2] * y[2])};
}

/// The largest error of the system above at t = 1 after `steps` equal steps.
double error_after(int steps) {
    std::array<double, 3> y{1.0, 1.0, 0.5};
    Rk21Counts counts;
    for (int n = 0; n < steps; ++n)
        integrate_rk21([](const std::array<double, 3>& x) { return nonlinear(x); }, y, true, 1.0 / steps, no_control, counts);
    CHECK(counts.accepted == steps);
    CHECK(counts.rejected == 0);
    double w = 1.0; // w^2/2 + ln w = its value at t = 0 plus 7/3, by Newton
    for (int n = 0; n < 50; ++n)
        w -= (0.5 * w * w + std::log(w) - (0.125 + std::log(0.5) + 7.0 / 3.0)) / (w + 1.0 / w);
    return std::max({std::abs(y[0] - 0.5), std::abs(y[1] - 4.0), std::abs(y[2] - w)});
}

/// A stiff, kinked right-hand side with a parameter of each point in its last component: the model of a plastic cell.
template <class V> std::array<V, 4> relaxing(const std::array<V, 4>& y) {
    const V size = square_root(y[0] * y[0] + y[1] * y[1]);
    const V flow = select(size >= V(1.0), exponential(V(6.0) * size - V(7.0)) * (V(1.0) - V(1.0) / size), V(0.0));
    return {y[3] - flow * y[0], V(0.7) - flow * y[1], flow * (V(1.0) - y[2]), V(0.0)};
}

std::array<double, 4> random_point(std::mt19937& engine) {
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    return {2.0 * uniform(engine) - 0.5, 1.6 * uniform(engine) - 0.8, 0.2 * uniform(engine), 5.0 * uniform(engine) - 1.0};
}

struct Result {
    std::array<double, 4> y{};
    Rk21Counts counts;
};

Result integrate_alone(const std::array<double, 4>& start, double duration, const Rk21Options& options) {
    Result r{.y = start, .counts = {}};
    integrate_rk21([](const std::array<double, 4>& y) { return relaxing(y); }, r.y, true, duration, options, r.counts);
    return r;
}

using Batch = std::array<std::array<double, 4>, static_cast<std::size_t>(pack_size)>;

Rk21Counts integrate_batch(Batch& points, const Pack::Mask& active, double duration, const Rk21Options& options) {
    std::array<Pack, 4> y;
    for (std::size_t i = 0; i < 4; ++i) {
        std::array<double, static_cast<std::size_t>(pack_size)> lanes;
        for (std::size_t k = 0; k < lanes.size(); ++k)
            lanes[k] = points[k][i];
        y[i] = load(lanes.data());
    }
    Rk21Counts counts;
    integrate_rk21([](const std::array<Pack, 4>& x) { return relaxing(x); }, y, active, duration, options, counts);
    for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t k = 0; k < points.size(); ++k)
            points[k][i] = y[i][static_cast<int>(k)];
    return counts;
}

Pack::Mask only(int lane) {
    const Pack numbers = Pack::counting_from(0.0);
    return (numbers >= Pack(lane)) && (numbers < Pack(lane + 1.0));
}

template <std::size_t n> bool same_bits(const std::array<double, n>& a, const std::array<double, n>& b) {
    return std::bit_cast<std::array<std::uint64_t, n>>(a) == std::bit_cast<std::array<std::uint64_t, n>>(b);
}

double distance(const auto& a, const auto& b) {
    double d = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i)
        d = std::max(d, std::abs(a[i] - b[i]));
    return d;
}

} // namespace

TEST_SUITE("rk21") {
    TEST_CASE("second order") {
        double previous = error_after(20);
        for (const int steps : {40, 80, 160, 320}) {
            const double error = error_after(steps);
            CHECK(std::log2(previous / error) == doctest::Approx(2.0).epsilon(0.05).scale(0.0));
            previous = error;
        }
        CHECK(previous < 1e-4);
    }

    TEST_CASE("the estimate is that of a first-order solution") {
        // The step is accepted where A exceeds the estimate: bisection measures it.
        const auto estimate = [](double h) {
            double low = 1e-16, high = 1.0;
            for (int n = 0; n < 60; ++n) {
                const double middle = std::sqrt(low * high);
                std::array<double, 1> y{1.0};
                Rk21Counts counts;
                integrate_rk21([](const std::array<double, 1>& x) { return std::array{x[0] * x[0]}; }, y, true, h,
                               {.absolute_tolerance = middle, .relative_tolerance = 0.0}, counts);
                (counts.rejected == 0 ? high : low) = middle;
            }
            return high;
        };
        for (const double h : {0.1, 0.03}) {
            const double k1 = 1.0, k2 = std::pow(1.0 + 2.0 / 3.0 * h * k1, 2),
                         k3 = std::pow(1.0 + h * (0.25 * k1 + 0.75 * k2), 2);
            const double literal = h * ((k1 + k2 + k3) / 3.0 - (0.25 * k1 + 0.75 * k2)); // y_1 - yhat_1 of Table A.4
            CHECK(estimate(h) == doctest::Approx(std::abs(literal)).epsilon(1e-9).scale(0.0));
        }
        CHECK(std::log2(estimate(2e-3) / estimate(1e-3)) == doctest::Approx(2.0).epsilon(0.01).scale(0.0));
    }

    TEST_CASE("first same as last: two evaluations a substep and one to begin with") {
        std::mt19937 engine(1);
        for (int repeat = 0; repeat < 50; ++repeat)
            for (const double tolerance : {1e-2, 1e-5}) {
                std::array<double, 4> y = random_point(engine);
                Rk21Counts counts;
                long long evaluations = 0;
                integrate_rk21(
                    [&](const std::array<double, 4>& x) {
                        ++evaluations;
                        return relaxing(x);
                    },
                    y, true, 2.0, {.absolute_tolerance = tolerance, .relative_tolerance = tolerance}, counts);
                CHECK(evaluations == 1 + 2 * (counts.accepted + counts.rejected));
            }
    }

    TEST_CASE("error control follows (B.1)-(B.4)") {
        std::mt19937 engine(2);
        long long accepted = 0, rejected = 0;
        for (int repeat = 0; repeat < 200; ++repeat) {
            const std::array<double, 4> start = random_point(engine);
            for (const Rk21Options& options :
                 {Rk21Options{.absolute_tolerance = 1e-2, .relative_tolerance = 1e-2},
                  Rk21Options{.absolute_tolerance = 1e-6, .relative_tolerance = 3e-5, .exact_components = 1},
                  Rk21Options{.absolute_tolerance = 1e-4,
                  .relative_tolerance = 1e-4,
                  .safety = 0.7,
                  .largest_growth = 1.5,
                  .smallest_shrink = 0.6}}) {
                const double duration = 1.0 + 0.01 * repeat;
                const auto expected =
                    reference_rk21([](const std::array<double, 4>& y) { return relaxing(y); }, start, duration, options);
                const Result result = integrate_alone(start, duration, options);
                CHECK(result.counts.accepted == expected.accepted);
                CHECK(result.counts.rejected == expected.rejected);
                CHECK(!result.counts.failed);
                CHECK(distance(result.y, expected.y) < 1e-11);
                accepted += result.counts.accepted;
                rejected += result.counts.rejected;
            }
        }
        CHECK(accepted > 3000); // both branches are in use
        CHECK(rejected > 500);
    }

    TEST_CASE("a point's result does not depend on its place in a batch or on its neighbours") {
        std::mt19937 engine(3);
        const Rk21Options options{.absolute_tolerance = 1e-5, .relative_tolerance = 1e-5, .exact_components = 1};
        for (int repeat = 0; repeat < 25; ++repeat) {
            Batch points;
            for (auto& point : points)
                point = random_point(engine);
            Batch together = points;
            const Rk21Counts sum = integrate_batch(together, Pack::Mask(true), 1.7, options);
            Rk21Counts total;
            for (std::size_t k = 0; k < points.size(); ++k) {
                Rk21Counts first;
                for (int position = 0; position < pack_size; ++position) {
                    Batch alone;
                    for (std::size_t other = 0; other < alone.size(); ++other)
                        alone[other] = points[(other + k + 1) % points.size()];
                    alone[static_cast<std::size_t>(position)] = points[k];
                    const Batch before = alone;
                    const Rk21Counts counts = integrate_batch(alone, only(position), 1.7, options);
                    CHECK(same_bits(alone[static_cast<std::size_t>(position)], together[k]));
                    for (int other = 0; other < pack_size; ++other) // inactive lanes are left alone
                        if (other != position)
                            CHECK(same_bits(alone[static_cast<std::size_t>(other)], before[static_cast<std::size_t>(other)]));
                    if (position == 0)
                        first = counts;
                    CHECK(counts.accepted == first.accepted);
                    CHECK(counts.rejected == first.rejected);
                }
                total.accepted += first.accepted;
                total.rejected += first.rejected;
                const Result scalar = integrate_alone(points[k], 1.7, options);
                CHECK(scalar.counts.accepted == first.accepted);
                CHECK(distance(scalar.y, together[k]) < 1e-12);
            }
            CHECK(sum.accepted == total.accepted);
            CHECK(sum.rejected == total.rejected);

            Batch reversed;
            for (std::size_t k = 0; k < points.size(); ++k)
                reversed[k] = points[points.size() - 1 - k];
            (void)integrate_batch(reversed, Pack::Mask(true), 1.7, options);
            for (std::size_t k = 0; k < points.size(); ++k)
                CHECK(same_bits(reversed[points.size() - 1 - k], together[k]));
        }
    }

    TEST_CASE("an inactive neighbour that is not a number disturbs nothing") {
        std::mt19937 engine(4);
        const Rk21Options options{.absolute_tolerance = 1e-6, .relative_tolerance = 1e-6};
        const std::array<double, 4> point = random_point(engine);
        Batch expected, batch;
        expected.fill(point);
        (void)integrate_batch(expected, Pack::Mask(true), 1.0, options);
        for (int lane = 0; lane < pack_size; ++lane) {
            batch.fill(point);
            for (std::size_t other = 0; other < batch.size(); ++other)
                if (other != static_cast<std::size_t>(lane))
                    batch[other].fill(not_a_number);
            const Rk21Counts counts = integrate_batch(batch, only(lane), 1.0, options);
            CHECK(!counts.failed);
            CHECK(same_bits(batch[static_cast<std::size_t>(lane)], expected[static_cast<std::size_t>(lane)]));
        }
        batch.fill(point);
        const Rk21Counts none = integrate_batch(batch, Pack::Mask(false), 1.0, options);
        CHECK(none.accepted + none.rejected == 0);
        CHECK(same_bits(batch[0], point));
    }

    TEST_CASE("the last substep lands on the end") {
        // A clock as second component: it shows the time reached.
        for (const double duration : {1e-3, 0.7, 1.0, 313.0})
            for (const double tolerance : {1e-2, 1e-4, 1e-6, 1e-9}) {
                std::array<double, 2> y{2.0, 0.0};
                Rk21Counts counts;
                integrate_rk21(
                    [&](const std::array<double, 2>& x) {
                        return std::array{-20.0 / duration * x[0] * x[0], 1.0};
                    },
                    y, true, duration, {.absolute_tolerance = tolerance, .relative_tolerance = tolerance}, counts);
                CHECK(std::abs(y[1] - duration) <= 1e-15 * static_cast<double>(counts.accepted) * duration);
            }
    }

    TEST_CASE("a right-hand side that becomes NaN, infinite or hopeless is reported, not followed") {
        const auto run = [](auto&& f, std::array<double, 2> y) {
            Rk21Counts counts;
            integrate_rk21(f, y, true, 1.0, {}, counts);
            return counts.failed;
        };
        using Point = std::array<double, 2>;
        CHECK(run([](const Point&) { return Point{not_a_number, 0.0}; }, {1.0, 1.0}));
        CHECK(run([](const Point& y) { return Point{1.0, y[0] > 1.5 ? not_a_number : 0.0}; }, {1.0, 1.0}));
        CHECK(run([](const Point& y) { return Point{1.0, std::sqrt(1.5 - y[0])}; }, {1.0, 1.0}));
        CHECK(run([](const Point& y) { return Point{y[0] * y[0], 0.0}; }, {2.0, 1.0})); // infinite at t = 1/2
        // bad only at the very end of the interval, where what is left is itself below 1e-12 of it
        for (const double margin : {1e-15, 1e-13, 1e-11})
            CHECK(run([=](const Point& y) { return Point{1.0, y[0] >= 2.0 - margin ? not_a_number : 0.0}; }, {1.0, 1.0}));
        // The second attempt ends 5e-13 before the end of the interval, and beyond that nothing is finite: it must not try for
        // ever.
        std::array<double, 1> clock{0.0};
        Rk21Counts last;
        integrate_rk21([](const std::array<double, 1>& y) { return std::array{y[0] > 1.0 - 4e-13 ? not_a_number : 1.0}; }, clock,
                       true, 1.0, {.smallest_shrink = 1.0 - 5e-13}, last);
        CHECK(last.failed);
        // one bad point in a batch
        std::array<Pack, 2> y{select(only(pack_size - 1), Pack(2.0), Pack(0.1)), Pack(0.0)};
        Rk21Counts counts;
        integrate_rk21(
            [](const std::array<Pack, 2>& x) {
                return std::array{x[0] * x[0], Pack(0.0)};
            },
            y, Pack::Mask(true), 1.0, {}, counts);
        CHECK(counts.failed);
    }

    TEST_CASE("large numbers cannot pass for small errors") {
        // Four components of 1e90: the product of their scales is beyond the largest double.
        std::array<double, 4> y{1e90, 1e90, 1e90, 1e90};
        Rk21Counts counts;
        integrate_rk21(
            [](const std::array<double, 4>& x) {
                return std::array{-50.0 * x[0], -60.0 * x[1], -70.0 * x[2], -80.0 * x[3]};
            },
            y, true, 1.0, {.absolute_tolerance = 1e-8, .relative_tolerance = 1e-2}, counts);
        CHECK((counts.failed || (y[0] < 1e71 && y[3] < 1e71)));
    }

    TEST_CASE("the STZ point problem agrees with SUNDIALS at tight tolerances") {
        // Shear at the paper's rate with a little normal strain, from rest through yield into steady flow: s, tau, q, chi.
        const StzModel model{StzParameters{}, Units{}};
        const double mu = 37.4 / 0.85, rate = 2e-7;
        const auto f = [&](const std::array<double, 4>& y) {
            const double sbar = std::max(std::sqrt(y[0] * y[0] + y[1] * y[1] + 3.0 * y[2] * y[2]), 1e-150);
            const auto plastic = model.rates(sbar, std::array{y[3]});
            const double relaxation = 2.0 * mu * plastic.fluidity;
            return std::array{0.3 * mu * rate - relaxation * y[0], mu * rate - relaxation * y[1],
                              -0.1 * mu * rate - relaxation * y[2], plastic.internal[0]};
        };
        const std::array<double, 4> start{0.0, 0.0, 0.0, 660.0 / 21000.0};
        std::vector<double> reference(start.begin(), start.end());
        sundials::ErkIntegrator integrator(
            [&](double, std::span<const double> y, std::span<double> slope) {
                const auto k = f({y[0], y[1], y[2], y[3]});
                std::copy(k.begin(), k.end(), slope.begin());
            },
            4, {.relative_tolerance = 1e-12, .absolute_tolerance = 1e-14, .largest_step = 500.0});
        const double duration = 35e4;
        integrator.integrate(reference, 0.0, duration);
        CHECK(reference[1] > 1.0);             // it yields,
        CHECK(reference[3] > 1.04 * start[3]); // and disorders
        CHECK(integrator.counts().steps > 50);

        double previous = 1.0;
        for (const double tolerance : {1e-5, 1e-7, 1e-9}) {
            std::array<double, 4> y = start;
            Rk21Counts counts;
            integrate_rk21(f, y, true, duration, {.absolute_tolerance = tolerance, .relative_tolerance = tolerance}, counts);
            const double error = distance(y, reference);
            CHECK(!counts.failed);
            CHECK(error < 100.0 * tolerance);
            CHECK(error < 0.2 * previous);
            previous = error;
        }
    }

    TEST_CASE("SUNDIALS with the table of the paper takes the same steps") {
        const std::array<double, 4> start{1.1, 0.4, 0.1, 1.3};
        for (const int steps : {1, 2, 25}) {
            std::vector<double> twin(start.begin(), start.end());
            sundials::ErkIntegrator integrator(
                [](double, std::span<const double> y, std::span<double> rate) {
                    const auto k = relaxing(std::array{y[0], y[1], y[2], y[3]});
                    std::copy(k.begin(), k.end(), rate.begin());
                },
                4, {.table = sundials::paper_rk21(), .fixed_step = 0.5 / steps});
            integrator.integrate(twin, 0.0, 0.5);
            CHECK(integrator.counts().steps == steps);
            CHECK(integrator.counts().rejected == 0);

            std::array<double, 4> y = start;
            Rk21Counts counts;
            for (int n = 0; n < steps; ++n)
                integrate_rk21([](const std::array<double, 4>& x) { return relaxing(x); }, y, true, 0.5 / steps, no_control,
                               counts);
            for (std::size_t i = 0; i < 4; ++i)
                CHECK(std::abs(y[i] / twin[i] - 1.0) < 1e-15 * steps);
        }
    }

    TEST_CASE("SUNDIALS with the step control of the paper takes the same adaptive steps") {
        // A metallic glass sheared to and fro through yield, with a little normal strain: p, s, tau, q, chi.
        const Law glass = stz_law({.bulk_modulus = 122.0 / 0.85, .shear_modulus = 37.4 / 0.85}, StzParameters{}, Units{});
        using State = std::array<double, 5>;
        const double duration = 20e4;
        for (const double tolerance : {1e-4, 1e-5, 1e-6, 1e-7, 1e-8}) {
            CAPTURE(tolerance);
            const Rk21Options options{.absolute_tolerance = tolerance, .relative_tolerance = tolerance};
            State y{0.0, 0.0, 0.0, 0.0, 660.0 / 21000.0}, twin = y;
            Rk21Counts counts;
            sundials::Counts counts_of_twin;
            std::vector<double> steps, steps_of_twin;
            for (const double shear : {2e-7, -3e-7, 5e-7, -2e-7}) {
                const VelocityGradient<double> gradient{.ux = 0.3 * shear, .uy = shear, .vx = 0.0, .vy = -0.1 * shear};
                const auto f = [&](const State& x) {
                    State slope;
                    point::rate(glass, gradient, x, slope);
                    return slope;
                };
                integrate_rk21<Rk21Scale::start>(f, y, true, duration, options, counts,
                                                 [&](bool accepted, double h, const State&) {
                                                     if (accepted)
                                                         steps.push_back(h);
                                                 });

                sundials::ErkIntegrator integrator(
                    [&](double, std::span<const double> x, std::span<double> slope) { point::rate(glass, gradient, x, slope); },
                    y.size(),
                    {.relative_tolerance = tolerance,
                     .absolute_tolerance = tolerance,
                     .table = sundials::paper_rk21(),
                     .step_control = sundials::StepControl::lu_rycroft});
                double start = 0.0;
                integrator.integrate(twin, 0.0, duration, [&](double time, std::span<const double>) {
                    steps_of_twin.push_back(time - std::exchange(start, time));
                });
                counts_of_twin.steps += integrator.counts().steps;
                counts_of_twin.rejected += integrator.counts().rejected;
                counts_of_twin.evaluations += integrator.counts().evaluations;
            }
            CHECK(!counts.failed);
            CHECK(counts.accepted == counts_of_twin.steps);
            CHECK(counts.rejected == counts_of_twin.rejected);
            CHECK(4 + 2 * (counts.accepted + counts.rejected) == counts_of_twin.evaluations);
            CHECK(counts.rejected > 10);
            REQUIRE(steps.size() == steps_of_twin.size());
            // The estimate is a small difference of rates, whose rounding moves the next step; where stability limits the steps
            // the control amplifies it, and the last step of an interval makes up for all before it.
            std::vector<double> differences;
            for (std::size_t n = 0; n < steps.size(); ++n) {
                CHECK(std::abs(steps[n] - steps_of_twin[n]) < 1e-9 * duration);
                differences.push_back(std::abs(steps[n] - steps_of_twin[n]) / steps[n]);
            }
            std::ranges::nth_element(differences, differences.begin() + std::ssize(differences) / 2);
            CHECK(differences[differences.size() / 2] < 1e-11);
            for (std::size_t i = 0; i < y.size(); ++i)
                CHECK(std::abs(y[i] - twin[i]) < 1e-12);
        }
    }
}

} // namespace rk21_suite
