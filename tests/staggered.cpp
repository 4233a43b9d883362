// SPDX-License-Identifier: GPL-3.0-or-later
#include "fields.hpp"
#include <doctest/doctest.h>
#include <ductile/base/threads.hpp>
#include <ductile/material/point_rates.hpp>
#include <ductile/space/staggered.hpp>

#include <random>

namespace staggered_suite {

using namespace ductile;

namespace {

struct Gradient {
    double ux, uy, vx, vy;
};

/// The library's gradient at cell (i, j), taken from the batch that holds it.
Gradient gradient_at(const Grid& grid, const VectorField& w, int i, int j) {
    const int start = i / pack_size * pack_size, lane = i - start;
    const Corners u(w.u.row(j) + start, w.u.row(j + 1) + start), v(w.v.row(j) + start, w.v.row(j + 1) + start);
    const VelocityGradient<Pack> g = velocity_gradient(u, v, 0.5 / grid.dx(), 0.5 / grid.dy());
    return {g.ux[lane], g.uy[lane], g.vx[lane], g.vy[lane]};
}

/// Eq. (2) and its analogue in y, as printed, with periodic indices.
Gradient literal_gradient(const Grid& grid, const VectorField& w, int i, int j) {
    const int right = (i + 1) % grid.cells_x;
    const auto along_x = [&](const Field& f) {
        return (f(right, j) + f(right, j + 1) - f(i, j) - f(i, j + 1)) / (2.0 * grid.dx());
    };
    const auto along_y = [&](const Field& f) {
        return (f(i, j + 1) + f(right, j + 1) - f(i, j) - f(right, j)) / (2.0 * grid.dy());
    };
    return {along_x(w.u), along_y(w.u), along_x(w.v), along_y(w.v)};
}

StressField random_stress(const Grid& grid, std::mt19937& engine) {
    CellState cells(grid, 1);
    for (Field* f : {&cells.stress.p, &cells.stress.s, &cells.stress.tau, &cells.stress.q})
        fields::fill_randomly(*f, engine, -1.0, 1.0);
    return cells.stress;
}

const std::vector<Grid> grids{Grid{4, 4, 1.0, 7.0},  Grid{5, 9, 3.0, 1.0},  Grid{16, 6, 2.0, 2.0},
                              Grid{17, 5, 0.3, 2.0}, Grid{31, 4, 1.0, 1.0}, Grid{37, 8, 5.0, 0.2}};

} // namespace

TEST_SUITE("staggered") {
    TEST_CASE_FIXTURE(fields::OneThread, "gradients of affine fields are exact") {
        for (const Grid& grid : grids) {
            VectorField w(grid);
            for (int j = 0; j <= grid.cells_y; ++j) // not periodic: the images are written too
                for (int i = -2; i < w.u.padded_columns() + 3; ++i) {
                    w.u.row(j)[i] = 0.3 + 0.7 * grid.x(i) - 1.9 * grid.y(j);
                    w.v.row(j)[i] = -1.3 + 2.2 * grid.x(i) + 0.4 * grid.y(j);
                }
            for (int j = 0; j < grid.cells_y; ++j)
                for (int i = 0; i < grid.cells_x; ++i) {
                    const Gradient g = gradient_at(grid, w, i, j);
                    CHECK(g.ux == doctest::Approx(0.7).epsilon(1e-12));
                    CHECK(g.uy == doctest::Approx(-1.9).epsilon(1e-12));
                    CHECK(g.vx == doctest::Approx(2.2).epsilon(1e-12));
                    CHECK(g.vy == doctest::Approx(0.4).epsilon(1e-12));
                    const int start = i / pack_size * pack_size;
                    const Corners u(w.u.row(j) + start, w.u.row(j + 1) + start);
                    const double centre = 0.3 + 0.7 * grid.x(i + 0.5) - 1.9 * grid.y(j + 0.5);
                    CHECK(u.mean()[i - start] == doctest::Approx(centre).epsilon(1e-12));
                }
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "gradients are Eq. (2), periodic in x") {
        std::mt19937 engine(1);
        for (const Grid& grid : grids) {
            VectorField w(grid);
            fields::fill_randomly(w.u, engine, -1.0, 1.0);
            fields::fill_randomly(w.v, engine, -1.0, 1.0);
            for (int j = 0; j < grid.cells_y; ++j)
                for (int i = 0; i < grid.cells_x; ++i) {
                    const Gradient g = gradient_at(grid, w, i, j), expected = literal_gradient(grid, w, i, j);
                    const double bound = 1e-13 / std::min(grid.dx(), grid.dy());
                    CHECK(std::abs(g.ux - expected.ux) < bound);
                    CHECK(std::abs(g.uy - expected.uy) < bound);
                    CHECK(std::abs(g.vx - expected.vx) < bound);
                    CHECK(std::abs(g.vy - expected.vy) < bound);
                }
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "elastic rates are C_ijkl D_kl in plane strain") {
        const IsotropicElasticity c{.bulk_modulus = 1.9, .shear_modulus = 0.8};
        const double lambda = c.bulk_modulus - 2.0 / 3.0 * c.shear_modulus, mu = c.shear_modulus;
        std::mt19937 engine(2);
        std::uniform_real_distribution<double> uniform(-1.0, 1.0);
        for (int repeat = 0; repeat < 100; ++repeat) {
            const double ux = uniform(engine), uy = uniform(engine), vx = uniform(engine), vy = uniform(engine);
            const double grad[3][3] = {{ux, uy, 0.0}, {vx, vy, 0.0}, {0.0, 0.0, 0.0}};
            double stress[3][3] = {};
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    for (int k = 0; k < 3; ++k)
                        for (int l = 0; l < 3; ++l) {
                            const auto delta = [](int a, int b) { return a == b ? 1.0 : 0.0; };
                            const double C =
                                lambda * delta(i, j) * delta(k, l) + mu * (delta(i, k) * delta(j, l) + delta(i, l) * delta(j, k));
                            stress[i][j] += C * 0.5 * (grad[k][l] + grad[l][k]);
                        }
            const StressComponents<Pack> r = elastic_rate(c, VelocityGradient<Pack>{Pack(ux), Pack(uy), Pack(vx), Pack(vy)});
            for (const int lane : {0, pack_size - 1}) {
                const double p = r.p[lane], s = r.s[lane], tau = r.tau[lane], q = r.q[lane];
                CHECK(std::abs(-p + s - q - stress[0][0]) < 1e-14);
                CHECK(std::abs(-p - s - q - stress[1][1]) < 1e-14);
                CHECK(std::abs(-p + 2.0 * q - stress[2][2]) < 1e-14);
                CHECK(std::abs(tau - stress[0][1]) < 1e-14);
            }
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "nodal forces are (S.14), (S.15)") {
        std::mt19937 engine(3);
        for (const Grid& grid : grids) {
            const StressField stress = random_stress(grid, engine);
            VectorField force(grid);
            for (Field* f : {&force.u, &force.v})
                fields::fill_randomly(*f, engine, 5.0, 6.0); // overwritten, walls included
            const double factor = -0.37, dx = grid.dx(), dy = grid.dy();
            divergence(grid, stress, factor, force);
            const int m = grid.cells_x;
            for (int j = 0; j <= grid.cells_y; ++j)
                for (int i = 0; i < m; ++i) {
                    if (j == 0 || j == grid.cells_y) {
                        CHECK(force.u(i, j) == 0.0);
                        CHECK(force.v(i, j) == 0.0);
                        continue;
                    }
                    // Table S.1: phi_1 is 1 at the lower right corner of its cell, so region I lies above left of the node,
                    // II above right, III below left, IV below right.
                    const int left = (i + m - 1) % m;
                    const auto xx = [&](int k, int l) { return -stress.p(k, l) + stress.s(k, l) - stress.q(k, l); };
                    const auto yy = [&](int k, int l) { return -stress.p(k, l) - stress.s(k, l) - stress.q(k, l); };
                    const auto xy = [&](int k, int l) { return stress.tau(k, l); };
                    const double x = dy / 2 * xx(left, j) - dx / 2 * xy(left, j) - dy / 2 * xx(i, j) - dx / 2 * xy(i, j) +
                                     dy / 2 * xx(left, j - 1) + dx / 2 * xy(left, j - 1) - dy / 2 * xx(i, j - 1) +
                                     dx / 2 * xy(i, j - 1);
                    const double y = dy / 2 * xy(left, j) - dx / 2 * yy(left, j) - dy / 2 * xy(i, j) - dx / 2 * yy(i, j) +
                                     dy / 2 * xy(left, j - 1) + dx / 2 * yy(left, j - 1) - dy / 2 * xy(i, j - 1) +
                                     dx / 2 * yy(i, j - 1);
                    CHECK(std::abs(force.u(i, j) - factor * x) < 1e-14 * (dx + dy));
                    CHECK(std::abs(force.v(i, j) - factor * y) < 1e-14 * (dx + dy));
                }
            VectorField row(grid);
            divergence_row(grid, stress, factor, 2, row);
            for (int i = 0; i < m; ++i) {
                CHECK(row.u(i, 2) == force.u(i, 2));
                CHECK(row.v(i, 2) == force.v(i, 2));
            }
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "the two operators are transposes of each other") {
        std::mt19937 engine(4);
        for (const Grid& grid : grids) {
            const StressField stress = random_stress(grid, engine);
            VectorField w(grid), force(grid);
            for (Field* f : {&w.u, &w.v}) {
                fields::fill_randomly(*f, engine, -1.0, 1.0);
                for (const int wall : {0, grid.cells_y}) { // B^T sigma is defined inside
                    std::fill_n(f->row(wall), grid.cells_x, 0.0);
                    f->wrap_row(wall);
                }
            }
            divergence(grid, stress, 1.0, force);
            double work_of_forces = 0.0, work_of_stress = 0.0, size = 0.0;
            for (int j = 0; j <= grid.cells_y; ++j)
                for (int i = 0; i < grid.cells_x; ++i)
                    work_of_forces += force.u(i, j) * w.u(i, j) + force.v(i, j) * w.v(i, j);
            for (int j = 0; j < grid.cells_y; ++j)
                for (int i = 0; i < grid.cells_x; ++i) {
                    const Gradient g = gradient_at(grid, w, i, j);
                    const double p = stress.p(i, j), s = stress.s(i, j), tau = stress.tau(i, j), q = stress.q(i, j);
                    const double power = (-p + s - q) * g.ux + (-p - s - q) * g.vy + tau * (g.uy + g.vx);
                    work_of_stress += grid.cell_area() * power;
                    size += grid.cell_area() * std::abs(power);
                }
            CHECK(std::abs(work_of_forces - work_of_stress) < 1e-14 * size);
            CHECK(size > 0.0);
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "nodal forces do not depend on the number of threads") {
        std::mt19937 engine(5);
        const Grid grid{37, 11, 5.0, 0.2};
        const StressField stress = random_stress(grid, engine);
        VectorField expected(grid);
        set_thread_count(1);
        divergence(grid, stress, 1.0, expected);
        for (const int threads : {2, 3, 8}) {
            set_thread_count(threads, 0);
            VectorField force(grid);
            divergence(grid, stress, 1.0, force);
            CHECK(fields::same_bits(force.u, expected.u));
            CHECK(fields::same_bits(force.v, expected.v));
        }
    }
}

} // namespace staggered_suite
