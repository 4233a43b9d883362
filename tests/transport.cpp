// SPDX-License-Identifier: GPL-3.0-or-later
#include "fields.hpp"
#include <doctest/doctest.h>
#include <ductile/space/transport.hpp>

#include <cmath>
#include <random>
#include <vector>

namespace transport_suite {

using namespace ductile;

namespace {

/// Eq. (4) as printed, times 2h; f[0 .. 4] are f_{i-2} ... f_{i+2}.
double literal_eno(double u, const std::array<double, 5>& f) {
    const double second_left = f[0] - 2.0 * f[1] + f[2], second_here = f[1] - 2.0 * f[2] + f[3],
                 second_right = f[2] - 2.0 * f[3] + f[4]; // Eq. (3) times h^2
    if (u < 0.0 && std::abs(second_here) > std::abs(second_right))
        return -f[4] + 4.0 * f[3] - 3.0 * f[2];
    if (u > 0.0 && std::abs(second_here) > std::abs(second_left))
        return 3.0 * f[2] - 4.0 * f[1] + f[0];
    return f[3] - f[1];
}

double eno(double u, const std::array<double, 5>& f) {
    const double one = eno2_difference(u, f[0], f[1], f[2], f[3], f[4]);
    const Pack batch = eno2_difference(Pack(u), Pack(f[0]), Pack(f[1]), Pack(f[2]), Pack(f[3]), Pack(f[4]));
    CHECK(std::abs(batch[0] - one) < 1e-14 * (1.0 + std::abs(one)));
    return one;
}

constexpr double bend = 1e-6; // the e of weno3

/// Jiang & Peng's weighted difference as they print it, in first differences D_m = f_{m+1} - f_m, times 2h.
double literal_weno(double u, std::array<double, 5> f) {
    if (u == 0.0)
        return f[3] - f[1];
    if (u < 0.0) // the mirror image
        std::reverse(f.begin(), f.end());
    const double d0 = f[1] - f[0], d1 = f[2] - f[1], d2 = f[3] - f[2];
    const double r = (bend + (d1 - d0) * (d1 - d0)) / (bend + (d2 - d1) * (d2 - d1));
    const double w = 1.0 / (1.0 + 2.0 * r * r);
    const double difference = (d1 + d2) - w * (d0 - 2.0 * d1 + d2);
    return u > 0.0 ? difference : -difference;
}

double weno(double u, const std::array<double, 5>& f) {
    const Weno3Difference<double> one(u, f[0], f[1], f[2], f[3], f[4], bend);
    return one.centred + one.bend * one.numerator / one.denominator;
}

/// -(v . grad) f of a whole field, as the sweeps call it.
template <Advection advection = Advection::eno2> Field rates(const Grid& grid, Field& f, const Field& u, const Field& v) {
    extrapolate_to_ghost_rows(f);
    Field result(grid.cells_y, grid.cells_x);
    for (int j = 0; j < grid.cells_y; ++j)
        for (int i = 0; i < grid.cells_x; i += pack_size)
            store(advection_rate<advection>(f.row(j) + i, f.stride(), load(u.row(j) + i), load(v.row(j) + i), 0.5 / grid.dx(),
                                            0.5 / grid.dy(), bend),
                  result.row(j) + i);
    return result;
}

Field cell_field(const Grid& grid) { return Field(grid.cells_y, grid.cells_x, 2); }
Field constant(const Grid& grid, double value) {
    Field f(grid.cells_y, grid.cells_x);
    for (int j = 0; j < f.rows(); ++j)
        std::fill_n(f.row(j), f.columns(), value);
    fields::wrap(f);
    return f;
}

constexpr double pi = std::numbers::pi;

} // namespace

TEST_SUITE("transport") {
    TEST_CASE_FIXTURE(fields::OneThread, "the difference is Eq. (4), case by case") {
        std::mt19937 engine(1);
        std::uniform_real_distribution<double> uniform(-1.0, 1.0);
        int upwind = 0, centred = 0;
        for (int repeat = 0; repeat < 4000; ++repeat) {
            std::array<double, 5> f;
            for (double& value : f)
                value = uniform(engine);
            for (const double u : {0.7, -0.3, 1e-300, -1e-300, 0.0}) {
                const double expected = literal_eno(u, f);
                CHECK(std::abs(eno(u, f) - expected) < 1e-14);
                (std::abs(expected - (f[3] - f[1])) < 1e-13 ? centred : upwind) += 1;
            }
        }
        CHECK(upwind > 4000);
        CHECK(centred > 4000);
    }

    TEST_CASE_FIXTURE(fields::OneThread, "lanes choose their stencils one by one") {
        std::mt19937 engine(2);
        std::uniform_real_distribution<double> uniform(-1.0, 1.0);
        for (int repeat = 0; repeat < 200; ++repeat) {
            std::array<std::array<double, static_cast<std::size_t>(pack_size)>, 6> data;
            for (auto& values : data)
                for (double& value : values)
                    value = uniform(engine);
            const Pack result = eno2_difference(load(data[5].data()), load(data[0].data()), load(data[1].data()),
                                                load(data[2].data()), load(data[3].data()), load(data[4].data()));
            for (int k = 0; k < pack_size; ++k) {
                const auto lane = static_cast<std::size_t>(k);
                CHECK(std::abs(result[k] - literal_eno(data[5][lane], {data[0][lane], data[1][lane], data[2][lane], data[3][lane],
                                                                       data[4][lane]})) < 1e-14);
            }
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "ties and velocity zero take the centred difference") {
        // |f_xx| is 2 here, on the left and on the right, with all combinations of sign
        for (const double left : {2.0, -2.0})
            for (const double right : {2.0, -2.0})
                for (const double u : {1.0, -1.0, 0.0}) {
                    std::array<double, 5> f{0.0, 1.0, 3.0, 7.0, 0.0}; // second difference 2 in the middle
                    f[0] = left - f[2] + 2.0 * f[1];
                    f[4] = right - f[2] + 2.0 * f[3];
                    CHECK(eno(u, f) == f[3] - f[1]);
                }
        CHECK(eno(0.0, {9.0, 1.0, -4.0, 2.0, 8.0}) == 1.0);
        CHECK(eno(-0.0, {9.0, 1.0, -4.0, 2.0, 8.0}) == 1.0);
        // positive velocity must not look to the right, nor negative to the left
        CHECK(eno(1.0, {0.0, 1.0, 4.0, 3.0, 5.0}) == eno(1.0, {0.0, 1.0, 4.0, 3.0, -77.0}));
        CHECK(eno(-1.0, {0.0, 1.0, 4.0, 3.0, 5.0}) == eno(-1.0, {99.0, 1.0, 4.0, 3.0, 5.0}));
    }

    TEST_CASE_FIXTURE(fields::OneThread, "a kink: the derivative is that of the side the wind comes from") {
        for (const double left : {-1.0, 0.3})
            for (const double right : {2.0, -0.7})
                for (int kink = -3; kink <= 3; ++kink) { // at the grid point `kink` away
                    std::array<double, 5> f;
                    for (int k = -2; k <= 2; ++k)
                        f[static_cast<std::size_t>(k + 2)] = (k - kink) * (k < kink ? left : right);
                    CHECK(eno(1.0, f) == doctest::Approx(2.0 * (kink >= 0 ? left : right)));
                    CHECK(eno(-1.0, f) == doctest::Approx(2.0 * (kink > 0 ? left : right)));
                }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "weno3 is Jiang and Peng's mean, lane by lane, in x and in y") {
        std::mt19937 engine(5);
        std::uniform_real_distribution<double> uniform(-1.0, 1.0);
        for (int repeat = 0; repeat < 400; ++repeat) {
            const double size = std::pow(10.0, -2.0 * (repeat % 4)); // beyond, near and below the smallest bend
            const Grid grid{5, 5, 5.0, 2.5};
            Field f = cell_field(grid), u(5, 5), v(5, 5);
            fields::fill_randomly(f, engine, -size, size);
            fields::fill_randomly(u, engine, -1.0, 1.0);
            fields::fill_randomly(v, engine, -1.0, 1.0);
            u(2, 2) = repeat % 7 == 0 ? 0.0 : u(2, 2);
            const Field rate = rates<Advection::weno3>(grid, f, u, v);
            const std::array row{f(0, 2), f(1, 2), f(2, 2), f(3, 2), f(4, 2)};
            const std::array column{f(2, 0), f(2, 1), f(2, 2), f(2, 3), f(2, 4)};
            CHECK(std::abs(weno(u(2, 2), row) - literal_weno(u(2, 2), row)) < 1e-14 * size);
            const double expected = -(u(2, 2) * literal_weno(u(2, 2), row) / 2.0 + v(2, 2) * literal_weno(v(2, 2), column));
            CHECK(std::abs(rate(2, 2) - expected) < 1e-14 * size);
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "weno3's rate follows small changes smoothly, eno2's jumps") {
        // through the tie of the second differences, where ENO changes its stencil
        const auto jump = [](auto difference) {
            double largest = 0.0;
            constexpr double step = 1e-6;
            for (int k = -1000; k < 1000; ++k) {
                const auto at = [&](double s) { return difference(1.0, std::array{0.0, 0.3, 0.8, 1.5 + s, 0.0}); };
                largest = std::max(largest, std::abs(at((k + 1) * step) - at(k * step)) / step);
            }
            return largest;
        };
        CHECK(jump(weno) < 10.0);
        CHECK(jump([](double u, const std::array<double, 5>& f) { return eno(u, f); }) < 10.0); // the same value on both sides
        const auto signs = [](auto difference) { // second differences of opposite sign: both formulas differ where they tie
            const auto at = [&](double s) { return difference(1.0, std::array{0.0, 0.4, 0.6, 1.0 + s, 0.0}); };
            return std::abs(at(1e-9) - at(-1e-9));
        };
        CHECK(signs([](double u, const std::array<double, 5>& f) { return eno(u, f); }) > 0.3);
        CHECK(signs(weno) < 1e-8);
    }

    TEST_CASE_FIXTURE(fields::OneThread, "weno3 keeps to the wind's side of a kink") {
        for (const double left : {-1.0, 0.3})
            for (const double right : {2.0, -0.7})
                for (int kink = -3; kink <= 3; ++kink) {
                    std::array<double, 5> f;
                    for (int k = -2; k <= 2; ++k)
                        f[static_cast<std::size_t>(k + 2)] = (k - kink) * (k < kink ? left : right);
                    CHECK(weno(1.0, f) == doctest::Approx(2.0 * (kink >= 0 ? left : right)).epsilon(1e-5));
                    CHECK(weno(-1.0, f) == doctest::Approx(2.0 * (kink > 0 ? left : right)).epsilon(1e-5));
                }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "weno3 is of third order on smooth data, for both winds in both directions") {
        for (const double u : {0.8, -0.8})
            for (const double v : {0.6, -0.6}) {
                double previous = 0.0;
                for (const int n : {80, 160, 320}) {
                    const Grid grid{n + 1, n, 2.0, 2.0};
                    Field f = cell_field(grid);
                    const auto value = [](double x, double y) { return std::sin(pi * x) * std::cos(1.7 * y + 0.4); };
                    for (int j = 0; j < grid.cells_y; ++j)
                        for (int i = 0; i < grid.cells_x; ++i)
                            f(i, j) = value(grid.x(i + 0.5), grid.y(j + 0.5));
                    fields::wrap(f);
                    const Field rate = rates<Advection::weno3>(grid, f, constant(grid, u), constant(grid, v));
                    double mean = 0.0;
                    for (int j = 2; j < grid.cells_y - 2; ++j)
                        for (int i = 0; i < grid.cells_x; ++i) {
                            const double x = grid.x(i + 0.5), y = grid.y(j + 0.5);
                            const double exact = -u * pi * std::cos(pi * x) * std::cos(1.7 * y + 0.4) +
                                                 v * 1.7 * std::sin(pi * x) * std::sin(1.7 * y + 0.4);
                            mean += std::abs(rate(i, j) - exact) / (grid.cells_x * grid.cells_y);
                        }
                    if (previous > 0.0)
                        CHECK(std::log2(previous / mean) > 2.8);
                    previous = mean;
                }
                CHECK(previous < 3e-6);
            }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "a hat carried once around the domain keeps its bounds") {
        for (const bool smooth : {false, true}) {
            const Grid grid{64, 4, 2.0, 2.0};
            for (const double speed : {1.0, -1.0}) {
                Field f = cell_field(grid);
                for (int j = 0; j < 4; ++j)
                    for (int i = 0; i < 64; ++i)
                        f(i, j) = std::max(0.0, 1.0 - 2.5 * std::abs(grid.x(i + 0.5)));
                fields::wrap(f);
                const Field initial = f, u = constant(grid, speed), v = constant(grid, 0.0);
                const int steps = 256; // Courant number 1/4
                const double dt = 2.0 / steps;
                const auto rate_of = [&](Field& field) {
                    return smooth ? rates<Advection::weno3>(grid, field, u, v) : rates(grid, field, u, v);
                };
                double low = 0.0, high = 0.0;
                for (int n = 0; n < steps; ++n) { // Heun's method
                    const auto advance = [&](const Field& from, const Field& rate, Field& to) {
                        for (int j = 0; j < 4; ++j)
                            for (int i = 0; i < 64; ++i)
                                to(i, j) = from(i, j) + dt * rate(i, j);
                        fields::wrap(to);
                    };
                    Field trial = f;
                    advance(f, rate_of(f), trial);
                    Field end = trial;
                    advance(trial, rate_of(trial), end);
                    for (int j = 0; j < 4; ++j)
                        for (int i = 0; i < 64; ++i)
                            f(i, j) = 0.5 * (f(i, j) + end(i, j));
                    fields::wrap(f);
                    for (int i = 0; i < 64; ++i) {
                        low = std::min(low, f(i, 1));
                        high = std::max(high, f(i, 1));
                    }
                }
                CHECK(low > -0.01);
                CHECK(high < 1.0);
                CHECK(high > 0.85);
                double mean_error = 0.0;
                for (int i = 0; i < 64; ++i)
                    mean_error += std::abs(f(i, 1) - initial(i, 1)) / 64.0;
                CHECK(mean_error < 0.04); // it came back: half a cell away would cost as much again
            }
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "second order on smooth data, in both directions and for both winds") {
        for (const double u : {0.8, -0.8})
            for (const double v : {0.0, 0.6, -0.6}) {
                double previous = 0.0;
                for (const int n : {40, 80, 160}) {
                    const Grid grid{n + 1, n, 2.0, 2.0};
                    Field f = cell_field(grid);
                    const auto value = [](double x, double y) { return std::exp(std::sin(pi * x)) * std::cos(1.7 * y + 0.4); };
                    for (int j = 0; j < grid.cells_y; ++j)
                        for (int i = 0; i < grid.cells_x; ++i)
                            f(i, j) = value(grid.x(i + 0.5), grid.y(j + 0.5));
                    fields::wrap(f);
                    const Field rate = rates(grid, f, constant(grid, u), constant(grid, v));
                    double worst = 0.0;
                    for (int j = 2; j < grid.cells_y - 2; ++j) // walls: below
                        for (int i = 0; i < grid.cells_x; ++i) {
                            const double x = grid.x(i + 0.5), y = grid.y(j + 0.5);
                            const double exact = -u * pi * std::cos(pi * x) * value(x, y) +
                                                 v * 1.7 * std::exp(std::sin(pi * x)) * std::sin(1.7 * y + 0.4);
                            worst = std::max(worst, std::abs(rate(i, j) - exact));
                        }
                    if (previous > 0.0)
                        CHECK(std::log2(previous / worst) == doctest::Approx(2.0).epsilon(0.08).scale(0.0));
                    previous = worst;
                }
                CHECK(previous < 0.02);
            }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "walls: exact for linear data, first order for quadratic data") {
        for (const double v : {0.5, -0.5})
            for (const int n : {5, 12, 37}) {
                const Grid grid{6, n, 1.0, 3.0};
                const double dy = grid.dy();
                Field linear = cell_field(grid), quadratic = cell_field(grid);
                for (int j = 0; j < n; ++j)
                    for (int i = 0; i < 6; ++i) {
                        linear(i, j) = 2.0 - 0.7 * grid.y(j + 0.5);
                        quadratic(i, j) = std::pow(grid.y(j + 0.5), 2);
                    }
                fields::wrap(linear);
                fields::wrap(quadratic);
                const Field none = constant(grid, 0.0), wind = constant(grid, v);
                const Field a = rates(grid, linear, none, wind), b = rates(grid, quadratic, none, wind);
                for (int j = 0; j < n; ++j)
                    for (int i = 0; i < 6; ++i) {
                        CHECK(a(i, j) == doctest::Approx(0.7 * v).epsilon(1e-12));
                        // The first ghost row continues the wall's slope, with second difference 0: the row at the wall sees the
                        // slope half a cell inside, and so does the next one if the wind comes from the wall.
                        double error = 0.0;
                        if (j == 0 || (j == 1 && v > 0.0))
                            error = j == 0 ? dy : -dy;
                        if (j == n - 1 || (j == n - 2 && v < 0.0))
                            error = j == n - 1 ? -dy : dy;
                        CHECK(b(i, j) == doctest::Approx(-v * (2.0 * grid.y(j + 0.5) + error)).epsilon(1e-11));
                    }
                for (int distance = 1; distance <= 2; ++distance)
                    for (int i = -2; i < 8; ++i) {
                        CHECK(linear(i, -distance) == doctest::Approx(2.0 - 0.7 * grid.y(0.5 - distance)).epsilon(1e-13));
                        CHECK(linear(i, n - 1 + distance) ==
                              doctest::Approx(2.0 - 0.7 * grid.y(n - 0.5 + distance)).epsilon(1e-13));
                    }
            }
    }

    TEST_CASE_FIXTURE(fields::OneThread,
                      "whole fields of any shape: periodic in x, spacings not mixed up, both components summed") {
        std::mt19937 engine(3);
        for (const Grid& grid : {Grid{4, 4, 1.0, 7.0}, Grid{5, 9, 3.0, 1.0}, Grid{16, 6, 2.0, 2.0}, Grid{17, 5, 0.3, 2.0},
                                 Grid{31, 4, 1.0, 1.0}, Grid{37, 8, 5.0, 0.2}}) {
            const int m = grid.cells_x, n = grid.cells_y;
            Field f = cell_field(grid), u(n, m), v(n, m);
            fields::fill_randomly(f, engine, -1.0, 1.0);
            fields::fill_randomly(u, engine, -1.0, 1.0);
            fields::fill_randomly(v, engine, -1.0, 1.0);
            const Field before = f;
            const Field rate = rates(grid, f, u, v);
            const auto at = [&](int i, int j) { // walls closed by linear extrapolation
                const int column = (i % m + m) % m;
                if (j < 0)
                    return before(column, 0) + j * (before(column, 1) - before(column, 0));
                if (j >= n)
                    return before(column, n - 1) + (j - n + 1) * (before(column, n - 1) - before(column, n - 2));
                return before(column, j);
            };
            for (int j = 0; j < n; ++j)
                for (int i = 0; i < m; ++i) {
                    const double x = literal_eno(u(i, j), {at(i - 2, j), at(i - 1, j), at(i, j), at(i + 1, j), at(i + 2, j)}) /
                                     (2.0 * grid.dx());
                    const double y = literal_eno(v(i, j), {at(i, j - 2), at(i, j - 1), at(i, j), at(i, j + 1), at(i, j + 2)}) /
                                     (2.0 * grid.dy());
                    CHECK(rate(i, j) == doctest::Approx(-(u(i, j) * x + v(i, j) * y)).epsilon(1e-11));
                    CHECK(f(i, j) == before(i, j));
                }
        }
    }
}

} // namespace transport_suite
