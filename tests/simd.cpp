// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/simd.hpp>

#include <array>
#include <cmath>
#include <doctest/doctest.h>
#include <limits>
#include <random>

namespace simd_suite {

using namespace ductile;

namespace {

using Lanes = std::array<double, static_cast<std::size_t>(pack_size)>;

Lanes random_lanes(std::mt19937& engine, double low, double high) {
    std::uniform_real_distribution<double> uniform(low, high);
    Lanes x;
    for (double& value : x)
        value = uniform(engine);
    return x;
}

Lanes lanes(const Pack& x) {
    Lanes values;
    store(x, values.data());
    return values;
}

/// Lanes of a mask as 0 and 1.
Lanes lanes(const Pack::Mask& m) { return lanes(select(m, Pack(1.0), Pack(0.0))); }

void check_lanes(const Lanes& result, auto&& expected) {
    for (std::size_t k = 0; k < result.size(); ++k)
        CHECK(result[k] == expected(k));
}

double relative_error_of_exponential(double x, double result) {
    const long double exact = std::exp(static_cast<long double>(x));
    return static_cast<double>(std::abs((static_cast<long double>(result) - exact) / exact));
}

constexpr double infinity = std::numeric_limits<double>::infinity();

} // namespace

TEST_SUITE("simd") {
    TEST_CASE("the exponential is std::exp to 1e-15") {
        std::mt19937 engine(1);
        double worst = 0.0, worst_in_pack = 0.0;
        for (int repeat = 0; repeat < 5000; ++repeat) {
            const Lanes x = random_lanes(engine, -700.0, 700.0), small = random_lanes(engine, -1.0, 1.0);
            for (const Lanes& argument : {x, small}) {
                const Lanes e = lanes(exponential(load(argument.data())));
                for (std::size_t k = 0; k < e.size(); ++k) {
                    worst_in_pack = std::max(worst_in_pack, relative_error_of_exponential(argument[k], e[k]));
                    worst = std::max(worst, relative_error_of_exponential(argument[k], exponential(argument[k])));
                }
            }
        }
        // where the argument changes from one power of two to the next, and on both sides of it
        for (int n = -2019; n <= 2019; ++n)
            for (const double side : {-1.0, 0.0, 1.0}) {
                const double x = 0.5 * n * 0.69314718055994530942 * (1.0 + side * 1e-15);
                if (std::abs(x) <= 700.0)
                    worst = std::max(worst, relative_error_of_exponential(x, exponential(x)));
            }
        CHECK(worst < 1e-15);
        CHECK(worst_in_pack < 1e-15);
        CHECK(exponential(0.0) == 1.0);
    }

    TEST_CASE("the exponential clamps its argument and keeps NaN") {
        const double largest = exponential(709.0), smallest = exponential(-708.0);
        CHECK(largest == doctest::Approx(std::exp(709.0)).epsilon(1e-14));
        CHECK(smallest == doctest::Approx(std::exp(-708.0)).epsilon(1e-14));
        for (const double x : {709.5, 1000.0, 1e300, infinity}) {
            CHECK(exponential(x) == largest);
            CHECK(exponential(-x) == smallest);
            CHECK(exponential(Pack(x))[pack_size - 1] == exponential(Pack(709.0))[0]);
            CHECK(exponential(Pack(-x))[pack_size - 1] == exponential(Pack(-708.0))[0]);
        }
        CHECK(std::isnan(exponential(std::numeric_limits<double>::quiet_NaN())));
        // one lane that is not a number stays so and leaves the others alone
        for (std::size_t k = 0; k < static_cast<std::size_t>(pack_size); ++k) {
            Lanes x;
            x.fill(0.3);
            x[k] = std::numeric_limits<double>::quiet_NaN();
            const Lanes e = lanes(exponential(load(x.data())));
            for (std::size_t other = 0; other < x.size(); ++other)
                CHECK((other == k ? std::isnan(e[other]) : e[other] == exponential(Pack(0.3))[0]));
        }
    }

    TEST_CASE("a result does not depend on the lane it is computed in") {
        std::mt19937 engine(2);
        for (int repeat = 0; repeat < 200; ++repeat) {
            const Lanes x = random_lanes(engine, -50.0, 50.0), y = random_lanes(engine, 0.1, 3.0);
            const auto formula = [](const Pack& a, const Pack& b) {
                return exponential(a) / (b * b + Pack(0.1)) - square_root(b) * a;
            };
            const Lanes all = lanes(formula(load(x.data()), load(y.data())));
            for (std::size_t k = 0; k < x.size(); ++k)
                for (std::size_t position = 0; position < x.size(); ++position) {
                    Lanes a = y, b = y;
                    a[position] = x[k];
                    b[position] = y[k];
                    CHECK(lanes(formula(load(a.data()), load(b.data())))[position] == all[k]);
                }
        }
    }

    TEST_CASE("loads and stores work at any address") {
        std::array<double, static_cast<std::size_t>(3 * pack_size)> source, target{};
        for (std::size_t k = 0; k < source.size(); ++k)
            source[k] = static_cast<double>(k);
        for (std::size_t start = 0; start <= static_cast<std::size_t>(pack_size); ++start) {
            target.fill(-1.0);
            store(load(source.data() + start), target.data() + start);
            for (std::size_t k = 0; k < target.size(); ++k)
                CHECK(target[k] == (k >= start && k < start + static_cast<std::size_t>(pack_size) ? source[k] : -1.0));
        }
        check_lanes(lanes(Pack::counting_from(7.0)), [](std::size_t k) { return 7.0 + static_cast<double>(k); });
        check_lanes(lanes(Pack(2.5)), [](std::size_t) { return 2.5; });
        for (int k = 0; k < pack_size; ++k)
            CHECK(Pack::counting_from(3.0)[k] == 3.0 + k);
    }

    TEST_CASE("every word of the vocabulary acts lane by lane, as it does on one double") {
        std::mt19937 engine(3);
        for (int repeat = 0; repeat < 50; ++repeat) {
            Lanes a = random_lanes(engine, -2.0, 2.0), b = random_lanes(engine, -2.0, 2.0);
            b[static_cast<std::size_t>(repeat % pack_size)] = a[static_cast<std::size_t>(repeat % pack_size)]; // a tie
            const Pack x = load(a.data()), y = load(b.data());
            check_lanes(lanes(x + y), [&](std::size_t k) { return a[k] + b[k]; });
            check_lanes(lanes(x - y), [&](std::size_t k) { return a[k] - b[k]; });
            check_lanes(lanes(x * y), [&](std::size_t k) { return a[k] * b[k]; });
            check_lanes(lanes(x / y), [&](std::size_t k) { return a[k] / b[k]; });
            check_lanes(lanes(-x), [&](std::size_t k) { return -a[k]; });
            check_lanes(lanes(x < y), [&](std::size_t k) { return a[k] < b[k]; });
            check_lanes(lanes(x > y), [&](std::size_t k) { return a[k] > b[k]; });
            check_lanes(lanes(x >= y), [&](std::size_t k) { return a[k] >= b[k]; });
            check_lanes(lanes(!(x >= y)), [&](std::size_t k) { return a[k] < b[k]; });
            check_lanes(lanes((x > y) && (x > Pack(0.0))), [&](std::size_t k) { return a[k] > b[k] && a[k] > 0.0; });
            check_lanes(lanes(select(x < y, x, y)), [&](std::size_t k) { return select(a[k] < b[k], a[k], b[k]); });
            check_lanes(lanes(magnitude(x)), [&](std::size_t k) { return magnitude(a[k]); });
            check_lanes(lanes(maximum(x, y)), [&](std::size_t k) { return maximum(a[k], b[k]); });
            check_lanes(lanes(minimum(x, y)), [&](std::size_t k) { return minimum(a[k], b[k]); });
            check_lanes(lanes(square_root(magnitude(x))), [&](std::size_t k) { return square_root(std::abs(a[k])); });

            double sum = 0.0, largest = -infinity, smallest = infinity;
            int positive = 0;
            for (const double value : a) {
                sum += value;
                largest = std::max(largest, value);
                smallest = std::min(smallest, value);
                positive += value > 0.0 ? 1 : 0;
            }
            CHECK(sum_of(x) == doctest::Approx(sum).epsilon(1e-14));
            CHECK(largest_of(x) == largest);
            CHECK(smallest_of(x) == smallest);
            CHECK(count_of(x > Pack(0.0)) == positive);
        }
    }

    TEST_CASE("masks: one lane is enough for any_of") {
        CHECK(!any_of(Pack::Mask(false)));
        CHECK(any_of(Pack::Mask(true)));
        CHECK(count_of(Pack::Mask(true)) == pack_size);
        CHECK(!any_of(!Pack::Mask(true)));
        for (int k = 0; k < pack_size; ++k) {
            const Pack numbers = Pack::counting_from(0.0);
            const Pack::Mask one = (numbers >= Pack(k)) && (numbers < Pack(k + 1.0));
            CHECK(any_of(one));
            CHECK(count_of(one) == 1);
            CHECK(count_of(!one) == pack_size - 1);
            CHECK(lanes(one)[static_cast<std::size_t>(k)] == 1.0);
        }
        CHECK(any_of(true));
        CHECK(!any_of(false));
        CHECK(count_of(true) == 1);
        CHECK(count_of(false) == 0);
    }

    TEST_CASE("powers of two from the low bits of a shifted number") {
        for (int n = -1022; n <= 1023; ++n) {
            const double shifted = 0x1.8p52 + n;
            CHECK(power_of_two_from_bits(shifted) == std::ldexp(1.0, n));
            CHECK(power_of_two_from_bits(Pack(shifted))[n & (pack_size - 1)] == std::ldexp(1.0, n));
        }
    }

    TEST_CASE("comparisons with NaN are false, so that a broken value is never accepted") {
        const double nan = std::numeric_limits<double>::quiet_NaN();
        CHECK(!any_of(Pack(nan) < Pack(1.0)));
        CHECK(!any_of(Pack(nan) > Pack(1.0)));
        CHECK(!any_of(Pack(nan) >= Pack(1.0)));
    }
}

} // namespace simd_suite
