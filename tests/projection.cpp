// SPDX-License-Identifier: GPL-3.0-or-later
#include "fields.hpp"
#include <ductile/base/error.hpp>
#include <ductile/quasistatic/projection.hpp>
#include <ductile/space/staggered.hpp>

#include <array>
#include <cmath>
#include <doctest/doctest.h>
#include <limits>
#include <random>

namespace projection_suite {

using namespace ductile;
using namespace ductile::quasistatic;

namespace {

const Grid grids[] = {Grid{4, 4, 1.0, 1.0}, Grid{13, 7, 2.0, 1.0}, Grid{16, 9, 1.0, 3.0}, Grid{21, 16, 2.0, 2.0},
                      Grid{35, 6, 7.0, 0.5}};

CellState random_cells(const Grid& grid, unsigned seed) {
    std::mt19937 engine(seed);
    CellState cells(grid, 1);
    for (Field* f : fields::fields_of(cells))
        fields::fill_randomly(*f, engine, -1.0, 1.0);
    return cells;
}

/// Projects `cells`, the force being formed as the sweeps form it. Returns Q*.
double project(const Scene& scene, Space& space, double dt, CellState& cells, VectorField* correction = nullptr) {
    Projection projection(scene, space);
    VectorField force(scene.grid);
    divergence(scene.grid, cells.stress, -1.0 / dt, force);
    const double measure = projection.apply(force, {}, dt, cells);
    if (correction != nullptr)
        *correction = force;
    CHECK(projection.solves() == 1);
    return measure;
}

/// Stress as the vector xx, yy, zz, xy, yz, zx.
using Voigt = std::array<double, 6>;

Voigt voigt(const StressField& f, int i, int j) {
    const double p = f.p(i, j), s = f.s(i, j), q = f.q(i, j);
    return {-p + s - q, -p - s - q, -p + 2.0 * q, f.tau(i, j), 0.0, 0.0};
}

/// The compliance S = C^-1 as a matrix, by Gauss and Jordan on C_ijkl: sigma = C eps with eps = (.., 2 eps_xy, ..).
std::array<Voigt, 6> compliance(const IsotropicElasticity& c) {
    const double lambda = c.bulk_modulus - 2.0 / 3.0 * c.shear_modulus, mu = c.shear_modulus;
    std::array<std::array<double, 12>, 6> a{};
    for (std::size_t r = 0; r < 6; ++r) {
        for (std::size_t k = 0; k < 3; ++k)
            a[r][k] = r < 3 ? lambda + (r == k ? 2.0 * mu : 0.0) : 0.0;
        if (r >= 3)
            a[r][r] = mu;
        a[r][6 + r] = 1.0;
    }
    for (std::size_t r = 0; r < 6; ++r) {
        const double pivot = a[r][r];
        for (double& x : a[r])
            x /= pivot;
        for (std::size_t other = 0; other < 6; ++other)
            if (other != r) {
                const double factor = a[other][r];
                for (std::size_t k = 0; k < 12; ++k)
                    a[other][k] -= factor * a[r][k];
            }
    }
    std::array<Voigt, 6> s;
    for (std::size_t r = 0; r < 6; ++r)
        std::copy_n(a[r].begin() + 6, 6, s[r].begin());
    return s;
}

/// <a, b> of Eq. (19), the integral of a : S : b.
double inner_product(const Scene& scene, const StressField& a, const StressField& b) {
    const std::array<Voigt, 6> s = compliance(scene.law->elasticity());
    double sum = 0.0;
    for (int j = 0; j < scene.grid.cells_y; ++j)
        for (int i = 0; i < scene.grid.cells_x; ++i) {
            const Voigt x = voigt(a, i, j), y = voigt(b, i, j);
            for (std::size_t r = 0; r < 6; ++r)
                for (std::size_t k = 0; k < 6; ++k)
                    sum += x[r] * s[r][k] * y[k] * scene.grid.cell_area();
        }
    return sum;
}

StressField difference(const Grid& grid, const StressField& a, const StressField& b) {
    CellState d(grid, 1);
    for (const auto& [x, y, z] : {std::tuple{&a.p, &b.p, &d.stress.p}, std::tuple{&a.s, &b.s, &d.stress.s},
                                  std::tuple{&a.tau, &b.tau, &d.stress.tau}, std::tuple{&a.q, &b.q, &d.stress.q}}) {
        for (int j = 0; j < grid.cells_y; ++j)
            for (int i = 0; i < grid.cells_x; ++i)
                (*z)(i, j) = (*x)(i, j) - (*y)(i, j);
        fields::wrap(*z);
    }
    return d.stress;
}

/// The residual of discrete equilibrium from the literal definition, not the library's.
double literal_residual(const Scene& scene, const StressField& stress) {
    const Grid& grid = scene.grid;
    double force = 0.0, size = 0.0;
    for (int j = 1; j < grid.cells_y; ++j)
        for (int i = 0; i < grid.cells_x; ++i) {
            const int left = (i + grid.cells_x - 1) % grid.cells_x;
            const Voigt upper_left = voigt(stress, left, j), upper_right = voigt(stress, i, j),
                        lower_left = voigt(stress, left, j - 1), lower_right = voigt(stress, i, j - 1);
            const auto resultant = [&](std::size_t x, std::size_t y) {
                return 0.5 * grid.dy() * (upper_left[x] + lower_left[x] - upper_right[x] - lower_right[x]) +
                       0.5 * grid.dx() * (lower_left[y] + lower_right[y] - upper_left[y] - upper_right[y]);
            };
            force = std::max({force, std::abs(resultant(0, 3)), std::abs(resultant(3, 1))});
        }
    for (int j = 0; j < grid.cells_y; ++j)
        for (int i = 0; i < grid.cells_x; ++i) {
            const Voigt v = voigt(stress, i, j);
            size = std::max({size, std::abs(v[0]), std::abs(v[1]), std::abs(v[3])});
        }
    return force / (size * std::max(grid.dx(), grid.dy()));
}

} // namespace

TEST_SUITE("projection") {
    TEST_CASE_FIXTURE(fields::OneThread, "the exact operator leaves no residual, the fully integrated one does") {
        for (const Grid& grid : grids)
            for (const double dt : {1.0, 0.01, 300.0}) {
                const Scene scene = fields::scene_on(grid, Model::full, {1e-7, 0.0});
                const CellState start = random_cells(grid, 1);
                VectorField force(grid);
                CHECK(fields::equilibrium_residual(scene, start, force) ==
                      doctest::Approx(literal_residual(scene, start.stress)).epsilon(1e-12));
                CHECK(literal_residual(scene, start.stress) > 0.1);
                for (const SolverKind kind : {SolverKind::fourier, SolverKind::cholesky}) {
                    CellState exact = start, full = start;
                    project(scene, *make_space(scene, {.solver = kind}), dt, exact);
                    CHECK(fields::equilibrium_residual(scene, exact, force) < 1e-12);
                    CHECK(literal_residual(scene, exact.stress) < 1e-12);
                    project(scene, *make_space(scene, {.solver = kind, .stiffness = Stiffness::full}), dt, full);
                    CHECK(literal_residual(scene, full.stress) > 1e-3);
                    for (std::size_t k = 0; k < 5; ++k) { // images of the result are wrapped
                        const Field& f = *fields::fields_of(exact)[k];
                        CHECK(f(-1, 1) == f(grid.cells_x - 1, 1));
                        CHECK(f(grid.cells_x, 2) == f(0, 2));
                    }
                    CHECK(fields::same_bits(exact.internal[0], start.internal[0]));
                }
            }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "the correction is C : D of a velocity that vanishes at the walls") {
        for (const Grid& grid : grids) {
            const Scene scene = fields::scene_on(grid, Model::full, {1e-7, 0.0});
            const double dt = 0.3, K = scene.law->elasticity().bulk_modulus, mu = scene.law->elasticity().shear_modulus;
            const CellState start = random_cells(grid, 2);
            CellState cells = start;
            VectorField phi;
            project(scene, *fields::space_for(scene), dt, cells, &phi);
            const StressField change = difference(grid, cells.stress, start.stress);
            for (int i = 0; i < grid.cells_x; ++i)
                CHECK(std::abs(phi.u(i, 0)) + std::abs(phi.v(i, 0)) + std::abs(phi.u(i, grid.cells_y)) +
                          std::abs(phi.v(i, grid.cells_y)) ==
                      0.0);
            for (int j = 0; j < grid.cells_y; ++j)
                for (int i = 0; i < grid.cells_x; ++i) {
                    const int right = (i + 1) % grid.cells_x;
                    const auto dx = [&](const Field& f) {
                        return (f(right, j) + f(right, j + 1) - f(i, j) - f(i, j + 1)) / (2.0 * grid.dx());
                    };
                    const auto dy = [&](const Field& f) {
                        return (f(i, j + 1) + f(right, j + 1) - f(i, j) - f(right, j)) / (2.0 * grid.dy());
                    };
                    const double trace = dx(phi.u) + dy(phi.v);
                    const Voigt v = voigt(change, i, j);
                    const double lambda = K - 2.0 / 3.0 * mu, bound = 1e-12;
                    CHECK(std::abs(v[0] - dt * (lambda * trace + 2.0 * mu * dx(phi.u))) < bound);
                    CHECK(std::abs(v[1] - dt * (lambda * trace + 2.0 * mu * dy(phi.v))) < bound);
                    CHECK(std::abs(v[2] - dt * lambda * trace) < bound);
                    CHECK(std::abs(v[3] - dt * mu * (dy(phi.u) + dx(phi.v))) < bound);
                }
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "projecting twice is projecting once") {
        for (const Grid& grid : grids) {
            const Scene scene = fields::scene_on(grid, Model::full, {1e-7, 0.0});
            const auto space = fields::space_for(scene);
            CellState once = random_cells(grid, 3);
            const double first = project(scene, *space, 0.5, once);
            CellState twice = once;
            const double second = project(scene, *space, 0.5, twice);
            CHECK(second < 1e-13 * first);
            for (std::size_t k = 0; k < 4; ++k)
                CHECK(fields::distance(*fields::fields_of(once)[k], *fields::fields_of(twice)[k]) < 1e-12);
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "the projection is orthogonal in the elastic energy, Eq. (19)") {
        for (const Grid& grid : grids) {
            const Scene scene = fields::scene_on(grid, Model::full, {1e-7, 0.0});
            const auto space = fields::space_for(scene);
            CellState equilibrated = random_cells(grid, 4), cells = random_cells(grid, 5);
            project(scene, *space, 1.0, equilibrated);
            const StressField predicted = cells.stress;
            project(scene, *space, 0.2, cells);
            const StressField step = difference(grid, cells.stress, predicted),
                              chord = difference(grid, cells.stress, equilibrated.stress);
            const double scale = std::sqrt(inner_product(scene, step, step) * inner_product(scene, chord, chord));
            CHECK(scale > 0.0);
            CHECK(std::abs(inner_product(scene, chord, step)) < 1e-13 * scale);
            // Pythagoras: no equilibrated stress is closer
            const StressField away = difference(grid, equilibrated.stress, predicted);
            CHECK(inner_product(scene, away, away) ==
                  doctest::Approx(inner_product(scene, step, step) + inner_product(scene, chord, chord)).epsilon(1e-12));
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread,
                      "Q* is the energy of the correction, and the paper's measure but for a constant factor") {
        for (const Grid& grid : grids) {
            const Scene scene = fields::scene_on(grid, Model::full, {1e-7, 0.0});
            const CellState start = random_cells(grid, 6);
            CellState cells = start;
            const double dt = 0.7, mu = scene.law->elasticity().shear_modulus, K = scene.law->elasticity().bulk_modulus,
                         area = grid.area();
            const double measure = project(scene, *fields::space_for(scene), dt, cells);
            const StressField step = difference(grid, cells.stress, start.stress);
            CHECK(measure == doctest::Approx(std::sqrt(inner_product(scene, step, step) / (area * mu))).epsilon(1e-12));

            // (53)-(55) as printed
            double integral = 0.0;
            for (int j = 0; j < grid.cells_y; ++j)
                for (int i = 0; i < grid.cells_x; ++i) {
                    const double p = step.p(i, j), s = step.s(i, j), tau = step.tau(i, j), q = step.q(i, j);
                    integral += (K * (s * s + tau * tau + 3.0 * q * q) + mu * p * p) * grid.cell_area();
                }
            const double Q = std::sqrt(6.0 / (dt * dt) * integral), Q_hat = Q / (area * mu), Q_star = Q_hat * dt;
            CHECK(Q_star == doctest::Approx(std::sqrt(6.0 * K / area) * measure).epsilon(1e-12));
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "moving walls add a uniform stress rate to first-order schemes") {
        const Grid grid{13, 7, 2.0, 1.0};
        const Scene scene = fields::scene_on(grid, Model::full, {1e-7, 0.0});
        const auto space = fields::space_for(scene);
        const CellState start = random_cells(grid, 7);
        CellState still = start, moved = start;
        const double dt = 0.4, g = 0.03, e = -0.02, mu = scene.law->elasticity().shear_modulus,
                     K = scene.law->elasticity().bulk_modulus;
        Projection projection(scene, *space);
        VectorField force(grid);
        divergence(grid, start.stress, -1.0 / dt, force);
        VectorField same = force;
        const double measure = projection.apply(force, {}, dt, still),
                     other = projection.apply(same, {0.5 * g, 0.5 * e}, dt, moved);
        CHECK(measure == other); // it measures the projection, not the loading
        CHECK(projection.solves() == 2);
        const double lambda = K - 2.0 / 3.0 * mu;
        for (int j = 0; j < grid.cells_y; ++j)
            for (int i = 0; i < grid.cells_x; ++i) {
                const Voigt a = voigt(moved.stress, i, j), b = voigt(still.stress, i, j);
                CHECK(a[0] - b[0] == doctest::Approx(dt * lambda * e).epsilon(1e-10)); // du/dy = g, dv/dy = e
                CHECK(a[1] - b[1] == doctest::Approx(dt * (lambda + 2.0 * mu) * e).epsilon(1e-10));
                CHECK(a[2] - b[2] == doctest::Approx(dt * lambda * e).epsilon(1e-10));
                CHECK(a[3] - b[3] == doctest::Approx(dt * mu * g).epsilon(1e-10));
            }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "patch test: an affine velocity field gives a uniform stress through whole steps") {
        for (const Grid& grid : grids)
            for (const Model model : {Model::reduced, Model::full})
                for (const Predictor predictor : {Predictor::euler, Predictor::substepped, Predictor::incremental}) {
                    const WallVelocity walls{3e-5, -2e-5};
                    const Scene scene = fields::scene_on(grid, model, walls);
                    Field internal(grid.cells_y, grid.cells_x);
                    for (int j = 0; j < grid.cells_y; ++j)
                        std::fill_n(internal.row(j), grid.cells_x, 0.03);
                    const State start = fields::initial_state(scene, internal);
                    const double dt = 2.0, mu = scene.law->elasticity().shear_modulus, K = scene.law->elasticity().bulk_modulus;
                    const double g = walls.u / (0.5 * grid.height), e = walls.v / (0.5 * grid.height);
                    const State end = fields::run(scene, predictor, start, dt, 1);
                    fields::check_uniform(end.cells.stress.p, -K * e * dt, 1e-14);
                    fields::check_uniform(end.cells.stress.s, -mu * e * dt, 1e-14);
                    fields::check_uniform(end.cells.stress.tau, mu * g * dt, 1e-14);
                    fields::check_uniform(end.cells.stress.q, -mu / 3.0 * e * dt, 1e-14);
                    for (int j = 0; j <= grid.cells_y; ++j)
                        for (int i = 0; i < grid.cells_x; ++i) {
                            const double y = grid.y(j) / (0.5 * grid.height);
                            CHECK(std::abs(end.velocity.u(i, j) - walls.u * y) < 1e-13 * walls.u);
                            CHECK(std::abs(end.velocity.v(i, j) - walls.v * y) < 1e-13 * walls.u);
                        }
                }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "an elastic step finds the affine field whatever velocity it starts from") {
        // sigma = 0 and elastic: with C : D(q) of a wild q the projection must take back what q put in.
        for (const Grid& grid : grids) {
            const WallVelocity walls{3e-5, 1e-5};
            const Scene scene = fields::scene_on(grid, Model::reduced, walls);
            Field internal(grid.cells_y, grid.cells_x);
            for (int j = 0; j < grid.cells_y; ++j)
                std::fill_n(internal.row(j), grid.cells_x, 0.03);
            State start = fields::initial_state(scene, internal);
            std::mt19937 engine(8);
            std::uniform_real_distribution<double> uniform(-1e-5, 1e-5);
            for (int j = 1; j < grid.cells_y; ++j)
                for (int i = 0; i < grid.cells_x; ++i) {
                    start.velocity.u(i, j) += uniform(engine);
                    start.velocity.v(i, j) += uniform(engine);
                }
            fields::wrap(start.velocity.u);
            fields::wrap(start.velocity.v);
            const State end = fields::run(scene, Predictor::incremental, start, 2.0, 1);
            for (int j = 0; j <= grid.cells_y; ++j)
                for (int i = 0; i < grid.cells_x; ++i) {
                    const double y = grid.y(j) / (0.5 * grid.height);
                    CHECK(std::abs(end.velocity.u(i, j) - walls.u * y) < 1e-12 * walls.u);
                    CHECK(std::abs(end.velocity.v(i, j) - walls.v * y) < 1e-12 * walls.u);
                }
            const double mu = scene.law->elasticity().shear_modulus;
            fields::check_uniform(end.cells.stress.tau, mu * walls.u / (0.5 * grid.height) * 2.0, 1e-13);
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "a stress that is not finite is refused") {
        const Grid grid{13, 7, 2.0, 1.0};
        const Scene scene = fields::scene_on(grid, Model::full, {1e-7, 0.0});
        CellState cells = random_cells(grid, 9);
        cells.stress.s(4, 3) = std::numeric_limits<double>::quiet_NaN();
        const auto space = fields::space_for(scene);
        Projection projection(scene, *space);
        VectorField force(grid);
        divergence(grid, cells.stress, -1.0, force);
        CHECK_THROWS_AS(projection.apply(force, {}, 1.0, cells), RunError);
    }
}

} // namespace projection_suite
