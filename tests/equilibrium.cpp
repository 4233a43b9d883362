// SPDX-License-Identifier: GPL-3.0-or-later
#include "messages.hpp"
#include <ductile/base/threads.hpp>
#include <ductile/space/cholesky.hpp>
#include <ductile/space/equilibrium_solver.hpp>
#include <ductile/space/stencil.hpp>

#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <limits>
#include <numbers>
#include <random>
#include <string>

namespace equilibrium_suite {

using namespace ductile;

namespace {

constexpr IsotropicElasticity metallic_glass{.bulk_modulus = 122.0, .shear_modulus = 37.4};

void wrap(VectorField& w) {
    for (int j = 0; j < w.u.rows(); ++j) {
        w.u.wrap_row(j);
        w.v.wrap_row(j);
    }
}

VectorField random_field(VectorField w, unsigned seed) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (int j = 0; j < w.u.rows(); ++j)
        for (int i = 0; i < w.u.columns(); ++i) {
            w.u(i, j) = uniform(engine);
            w.v(i, j) = uniform(engine);
        }
    wrap(w);
    return w;
}

double largest(const VectorField& w) {
    double m = 0.0;
    for (int j = 0; j < w.u.rows(); ++j)
        for (int i = 0; i < w.u.columns(); ++i)
            m = std::max({m, std::abs(w.u(i, j)), std::abs(w.v(i, j))});
    return m;
}

/// Largest difference over all rows and the images that wrap_row() fills.
double distance(const VectorField& a, const VectorField& b) {
    double m = 0.0;
    for (int j = 0; j < a.u.rows(); ++j)
        for (int i = -2; i < a.u.padded_columns() + 3; ++i)
            m = std::max({m, std::abs(a.u(i, j) - b.u(i, j)), std::abs(a.v(i, j) - b.v(i, j))});
    return m;
}

bool same_bits(const VectorField& a, const VectorField& b) {
    return a.u.storage() == b.u.storage() && a.v.storage() == b.v.storage();
}

/// K w = -B^T sigma written out from the paper: the gradients of Eq. (2) at cell centres, stress by Eqs. (1) and (42), and the
/// nodal forces B of (S.14) and (S.15) from the four cells around a node. Interior rows only.
VectorField one_point_reference(const Grid& grid, const IsotropicElasticity& elasticity, const VectorField& w) {
    const double dx = grid.dx(), dy = grid.dy(), alpha = elasticity.alpha(), beta = elasticity.beta(),
                 mu = elasticity.shear_modulus;
    const int m = grid.cells_x, n = grid.cells_y;
    Field xx(n, m), yy(n, m), xy(n, m);
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < m; ++i) {
            const int right = (i + 1) % m;
            const auto along_x = [&](const Field& f) {
                return (f(right, j) + f(right, j + 1) - f(i, j) - f(i, j + 1)) / (2.0 * dx);
            };
            const auto along_y = [&](const Field& f) {
                return (f(i, j + 1) + f(right, j + 1) - f(i, j) - f(right, j)) / (2.0 * dy);
            };
            xx(i, j) = alpha * along_x(w.u) + beta * along_y(w.v);
            yy(i, j) = beta * along_x(w.u) + alpha * along_y(w.v);
            xy(i, j) = mu * (along_x(w.v) + along_y(w.u));
        }
    VectorField f(grid);
    for (int j = 1; j < n; ++j)
        for (int i = 0; i < m; ++i) {
            // Regions of Fig. S.1(d): I above left... of P_cc carry phi_1 ... phi_4; the signs are those of its gradients.
            const int left = (i + m - 1) % m;
            const auto force = [&](const Field& normal_x, const Field& normal_y) {
                return 0.5 * dy * (normal_x(left, j) - normal_x(i, j) + normal_x(left, j - 1) - normal_x(i, j - 1)) +
                       0.5 * dx * (normal_y(left, j - 1) + normal_y(i, j - 1) - normal_y(left, j) - normal_y(i, j));
            };
            f.u(i, j) = force(xx, xy);
            f.v(i, j) = force(xy, yy);
        }
    return f;
}

/// The element matrix of bilinear functions on a dx x dy cell, integrated with `points` x `points` Gauss points (1 or 2).
CellStiffness integrated(const Grid& grid, const IsotropicElasticity& elasticity, int points) {
    const double dx = grid.dx(), dy = grid.dy(), alpha = elasticity.alpha(), beta = elasticity.beta(),
                 mu = elasticity.shear_modulus;
    const double g = points == 1 ? 0.0 : 1.0 / std::sqrt(3.0), weight = dx * dy / (points * points);
    CellStiffness k{};
    for (int q = 0; q < points * points; ++q) {
        const double x = q % 2 == 0 ? -g : g, y = q / 2 == 0 ? -g : g;
        std::array<std::array<double, 8>, 3> strain{}; // xx, yy, 2 xy
        for (std::size_t n = 0; n < 4; ++n) {
            const double sx = n % 2 == 0 ? -1.0 : 1.0, sy = n / 2 == 0 ? -1.0 : 1.0;
            const double gx = sx * (1.0 + sy * y) / (2.0 * dx), gy = sy * (1.0 + sx * x) / (2.0 * dy);
            strain[0][2 * n] = strain[2][2 * n + 1] = gx;
            strain[1][2 * n + 1] = strain[2][2 * n] = gy;
        }
        for (std::size_t r = 0; r < 8; ++r)
            for (std::size_t c = 0; c < 8; ++c)
                k[r][c] +=
                    weight * (strain[0][r] * (alpha * strain[0][c] + beta * strain[1][c]) +
                              strain[1][r] * (beta * strain[0][c] + alpha * strain[1][c]) + mu * strain[2][r] * strain[2][c]);
    }
    return k;
}

/// K w on the distinct nodes of any rectangle, cell by cell from the Gauss-integrated element.
VectorField assembled_reference(const BoundaryValueProblem& problem, const VectorField& w) {
    const CellStiffness k = integrated(problem.grid, problem.elasticity, problem.stiffness == Stiffness::exact ? 1 : 2);
    VectorField f(w.u.rows(), w.u.columns());
    for (int j = 0; j < problem.grid.cells_y; ++j)
        for (int i = 0; i < problem.grid.cells_x; ++i)
            for (std::size_t r = 0; r < 8; ++r)
                for (std::size_t c = 0; c < 8; ++c) {
                    const auto value = [&](auto& field, std::size_t d) -> auto& {
                        const int column = (i + static_cast<int>(d / 2 % 2)) % w.u.columns();
                        const int row = (j + static_cast<int>(d / 4)) % w.u.rows();
                        return *((d % 2 == 0 ? field.u : field.v).row(row) + column);
                    };
                    value(f, r) += k[r][c] * value(w, c);
                }
    wrap(f);
    return f;
}

bool prescribed(const BoundaryValueProblem& p, int i, int j, Condition SideConditions::*component) {
    const auto holds = [&](const SideConditions& side) { return side.*component == Condition::prescribed; };
    return (i == 0 && holds(p.boundary.left)) || (i == p.grid.cells_x && holds(p.boundary.right)) ||
           (j == 0 && holds(p.boundary.bottom)) || (j == p.grid.cells_y && holds(p.boundary.top));
}

constexpr SideConditions fixed{Condition::prescribed, Condition::prescribed}, free_side{},
    around{Condition::periodic, Condition::periodic}, slip_x{Condition::traction, Condition::prescribed},
    slip_y{Condition::prescribed, Condition::traction};

} // namespace

TEST_SUITE("equilibrium") {
    TEST_CASE("the full stencil is (S.20) as printed") {
        const Grid grid{.cells_x = 8, .cells_y = 6, .width = 2.0, .height = 1.1};
        const Stencil stencil(grid, metallic_glass, Stiffness::full);
        const double dx = grid.dx(), dy = grid.dy(), K = metallic_glass.bulk_modulus, mu = metallic_glass.shear_modulus;
        const double alpha = K + 4.0 / 3.0 * mu;
        const auto check_block = [&](int a, int b, double xx, double xy, double yy) {
            const StiffnessBlock& block = stencil.block(a, b);
            CHECK(block.xx == doctest::Approx(xx).epsilon(1e-14));
            CHECK(block.xy == doctest::Approx(xy).epsilon(1e-14));
            CHECK(block.yx == doctest::Approx(xy).epsilon(1e-14));
            CHECK(block.yy == doctest::Approx(yy).epsilon(1e-14));
        };
        const double corner_xx = -mu * dx / (6 * dy) - alpha * dy / (6 * dx),
                     corner_yy = -alpha * dx / (6 * dy) - mu * dy / (6 * dx);
        check_block(-1, 1, corner_xx, K / 4 + mu / 12, corner_yy);
        check_block(1, -1, corner_xx, K / 4 + mu / 12, corner_yy);
        check_block(1, 1, corner_xx, -K / 4 - mu / 12, corner_yy);
        check_block(-1, -1, corner_xx, -K / 4 - mu / 12, corner_yy);
        for (const int s : {-1, 1}) {
            check_block(0, s, -2 * mu * dx / (3 * dy) + alpha * dy / (3 * dx), 0.0,
                        -2 * alpha * dx / (3 * dy) + mu * dy / (3 * dx));
            check_block(s, 0, mu * dx / (3 * dy) - 2 * alpha * dy / (3 * dx), 0.0,
                        alpha * dx / (3 * dy) - 2 * mu * dy / (3 * dx));
        }
        check_block(0, 0, 4 * mu * dx / (3 * dy) + 4 * alpha * dy / (3 * dx), 0.0,
                    4 * alpha * dx / (3 * dy) + 4 * mu * dy / (3 * dx));
    }

    TEST_CASE("cell stiffness and stencil are the Gauss-integrated element") {
        const Grid grid{.cells_x = 7, .cells_y = 5, .width = 1.3, .height = 2.2};
        for (const auto& [stiffness, points] : {std::pair{Stiffness::exact, 1}, std::pair{Stiffness::full, 2}}) {
            const CellStiffness k = cell_stiffness(grid, metallic_glass, stiffness),
                                expected = integrated(grid, metallic_glass, points);
            const Stencil stencil(grid, metallic_glass, stiffness);
            for (std::size_t r = 0; r < 8; ++r)
                for (std::size_t c = 0; c < 8; ++c)
                    CHECK(std::abs(k[r][c] - expected[r][c]) < 1e-13 * expected[0][0]);
            for (int b = -1; b <= 1; ++b)
                for (int a = -1; a <= 1; ++a) {
                    StiffnessBlock sum;
                    for (std::size_t own = 0; own < 4; ++own) {
                        const int x = static_cast<int>(own % 2) + a, y = static_cast<int>(own / 2) + b;
                        if (x < 0 || x > 1 || y < 0 || y > 1)
                            continue;
                        const auto other = static_cast<std::size_t>(2 * y + x);
                        sum.xx += expected[2 * own][2 * other];
                        sum.xy += expected[2 * own][2 * other + 1];
                        sum.yx += expected[2 * own + 1][2 * other];
                        sum.yy += expected[2 * own + 1][2 * other + 1];
                    }
                    const StiffnessBlock& block = stencil.block(a, b);
                    CHECK(std::abs(block.xx - sum.xx) < 1e-13 * expected[0][0]);
                    CHECK(std::abs(block.xy - sum.xy) < 1e-13 * expected[0][0]);
                    CHECK(std::abs(block.yx - sum.yx) < 1e-13 * expected[0][0]);
                    CHECK(std::abs(block.yy - sum.yy) < 1e-13 * expected[0][0]);
                }
        }
    }

    TEST_CASE("the exact stencil is gradient (2), elasticity (42), force (S.14), (S.15) in sequence") {
        for (const Grid& grid : {Grid{8, 8, 2.0, 2.0}, Grid{7, 5, 2.0, 0.9}, Grid{4, 9, 0.3, 2.0}}) {
            const VectorField w = random_field(VectorField(grid), 1);
            const VectorField expected = one_point_reference(grid, metallic_glass, w);
            VectorField f(grid);
            apply(Stencil(grid, metallic_glass, Stiffness::exact), w, f);
            for (int j = 1; j < grid.cells_y; ++j)
                for (int i = 0; i < grid.cells_x; ++i) {
                    CHECK(std::abs(f.u(i, j) - expected.u(i, j)) < 1e-14 * largest(expected));
                    CHECK(std::abs(f.v(i, j) - expected.v(i, j)) < 1e-14 * largest(expected));
                }
            for (const int j : {0, grid.cells_y})
                CHECK(f.u(1, j) == w.u(1, j));
        }
    }

    TEST_CASE("solving takes K w back to w") {
        for (const Grid& grid :
             {Grid{4, 4}, Grid{5, 4}, Grid{4, 5}, Grid{6, 7}, Grid{16, 16}, Grid{17, 13, 2.0, 1.0}, Grid{31, 64},
              Grid{64, 12, 2.0, 5.0}, Grid{101, 40}, Grid{250, 33, 1.0, 3.0}, Grid{96, 200, 3.0, 1.0}})
            for (const Stiffness stiffness : {Stiffness::exact, Stiffness::full}) {
                CAPTURE(grid.cells_x);
                CAPTURE(grid.cells_y);
                const VectorField w = random_field(VectorField(grid), 2);
                VectorField f(grid);
                apply(Stencil(grid, metallic_glass, stiffness), w, f);
                const auto solver = make_equilibrium_solver({grid, metallic_glass, stiffness}, SolverKind::fastest);
                solver->solve(f, WallData::given);
                CHECK(distance(f, w) < 3e-12);
                CHECK(std::equal(f.u.row(0), f.u.row(0) + grid.cells_x, w.u.row(0)));
                CHECK(std::equal(f.v.row(grid.cells_y), f.v.row(grid.cells_y) + grid.cells_x, w.v.row(grid.cells_y)));
            }
    }

    TEST_CASE("Fourier and Cholesky agree, whichever walls carry data") {
        enum Walls { none, lower, upper, both };
        for (const Grid& grid :
             {Grid{12, 12}, Grid{13, 9, 2.0, 1.0}, Grid{23, 30}, Grid{40, 7, 5.0, 1.0}, Grid{30, 41, 1.0, 2.0}})
            for (const Stiffness stiffness : {Stiffness::exact, Stiffness::full}) {
                const EquilibriumProblem problem{grid, metallic_glass, stiffness};
                const auto fourier = make_equilibrium_solver(problem, SolverKind::fourier);
                const auto cholesky = make_equilibrium_solver(problem, SolverKind::cholesky);
                CHECK(fourier->name() == "fourier");
                CHECK(cholesky->name() == "cholesky");
                CHECK(fourier->memory_bytes() > 0);
                CHECK(cholesky->memory_bytes() > 0);
                for (const Walls walls : {none, lower, upper, both}) {
                    VectorField f = random_field(VectorField(grid), 3);
                    for (Field* component : {&f.u, &f.v}) {
                        if (walls == upper)
                            std::fill_n(component->row(0), grid.cells_x, 0.0);
                        if (walls == lower)
                            std::fill_n(component->row(grid.cells_y), grid.cells_x, 0.0);
                    }
                    const WallData data = walls == none ? WallData::zero : WallData::given;
                    VectorField by_fourier = f, by_cholesky = f;
                    fourier->solve(by_fourier, data);
                    cholesky->solve(by_cholesky, data);
                    CHECK(distance(by_fourier, by_cholesky) < 1e-12 * largest(by_cholesky));
                    if (walls == none) // the rows of the walls were not zero on entry
                        CHECK(by_fourier.u(2, 0) == 0.0);
                    else
                        CHECK(largest(by_fourier) > 0.5);
                }
            }
    }

    TEST_CASE("the number of threads changes no bit") {
        const int threads_before = thread_count();
        for (const Grid& grid : {Grid{4, 4}, Grid{50, 37}, Grid{64, 64}, Grid{129, 20}}) {
            const auto solver = make_equilibrium_solver({grid, metallic_glass}, SolverKind::fourier);
            const VectorField f = random_field(VectorField(grid), 4);
            set_thread_count(1);
            VectorField expected = f;
            solver->solve(expected, WallData::given);
            for (const int threads : {1, 2, 3, 4, 8}) {
                set_thread_count(threads, 0);
                VectorField w = f;
                solver->solve(w, WallData::given);
                CHECK(same_bits(w, expected));
            }
        }
        set_thread_count(threads_before);
    }

    TEST_CASE("walls that move as an affine map move everything so") {
        const Grid grid{24, 15, 2.0, 1.0};
        for (const Stiffness stiffness : {Stiffness::exact, Stiffness::full})
            for (const SolverKind kind : {SolverKind::fourier, SolverKind::cholesky}) {
                VectorField expected(grid), w(grid);
                for (int j = 0; j <= grid.cells_y; ++j)
                    for (int i = 0; i < grid.cells_x; ++i) {
                        expected.u(i, j) = 0.3 + 0.7 * grid.y(j);
                        expected.v(i, j) = -0.2 + 1.1 * grid.y(j);
                        if (j == 0 || j == grid.cells_y) {
                            w.u(i, j) = expected.u(i, j);
                            w.v(i, j) = expected.v(i, j);
                        }
                    }
                wrap(expected);
                make_equilibrium_solver({grid, metallic_glass, stiffness}, kind)->solve(w, WallData::given);
                CHECK(distance(w, expected) < 1e-13);
            }
    }

    TEST_CASE("a smooth solution is met with second order") {
        using std::numbers::pi;
        const double alpha = metallic_glass.alpha(), beta = metallic_glass.beta(), mu = metallic_glass.shear_modulus;
        for (const Stiffness stiffness : {Stiffness::exact, Stiffness::full}) {
            double previous = 0.0;
            for (const int cells : {16, 32, 64, 128}) {
                const Grid grid{cells, cells + cells / 2, 2.0, 2.0};
                VectorField w(grid);
                double error = 0.0;
                const auto u = [](double x, double y) { return std::sin(pi * x) * std::exp(y); };
                const auto v = [](double x, double y) { return std::cos(pi * x) * y * y; };
                for (int j = 0; j <= grid.cells_y; ++j)
                    for (int i = 0; i < grid.cells_x; ++i) {
                        const double x = grid.x(i), y = grid.y(j);
                        const double uxx = -pi * pi * u(x, y), uyy = u(x, y), uxy = pi * std::cos(pi * x) * std::exp(y);
                        const double vxx = -pi * pi * v(x, y), vyy = 2.0 * std::cos(pi * x),
                                     vxy = -pi * std::sin(pi * x) * 2.0 * y;
                        const bool wall = j == 0 || j == grid.cells_y;
                        w.u(i, j) = wall ? u(x, y) : -grid.cell_area() * (alpha * uxx + mu * uyy + (beta + mu) * vxy);
                        w.v(i, j) = wall ? v(x, y) : -grid.cell_area() * (mu * vxx + alpha * vyy + (beta + mu) * uxy);
                    }
                make_equilibrium_solver({grid, metallic_glass, stiffness}, SolverKind::fastest)->solve(w, WallData::given);
                for (int j = 0; j <= grid.cells_y; ++j)
                    for (int i = 0; i < grid.cells_x; ++i)
                        error = std::max({error, std::abs(w.u(i, j) - u(grid.x(i), grid.y(j))),
                                          std::abs(w.v(i, j) - v(grid.x(i), grid.y(j)))});
                if (previous > 0.0) {
                    CHECK(previous / error > 3.8);
                    CHECK(previous / error < 4.2);
                }
                previous = error;
            }
            CHECK(previous < 2e-3);
        }
    }

    TEST_CASE("values that are not finite are reported") {
        const Grid grid{10, 9};
        for (const SolverKind kind : {SolverKind::fourier, SolverKind::cholesky}) {
            const auto solver = make_equilibrium_solver({grid, metallic_glass}, kind);
            for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
                for (const int row : {0, 1, 4, 8, 9})
                    for (Field VectorField::*component : {&VectorField::u, &VectorField::v}) {
                        VectorField f(grid);
                        (f.*component)(3, row) = bad;
                        CHECK_THROWS_AS(solver->solve(f, WallData::given), RunError);
                    }
            // A failure leaves nothing behind.
            VectorField f = random_field(VectorField(grid), 6), w(grid);
            apply(Stencil(grid, metallic_glass, Stiffness::exact), f, w);
            solver->solve(w, WallData::given);
            CHECK(distance(f, w) < 1e-12);
        }
    }

    TEST_CASE("impossible input is refused with a reason") {
        CHECK(contains(message_of([] {
                           (void)make_equilibrium_solver({{3, 8}, metallic_glass}, SolverKind::fourier);
                       }),
                       "4 cells"));
        CHECK(contains(message_of([] {
                           (void)make_equilibrium_solver({{8, 8}, {0.0, 1.0}}, SolverKind::cholesky);
                       }),
                       "bulk modulus"));
        CHECK(contains(message_of([] {
                           (void)make_equilibrium_solver({{8, 8}, {1.0, -1.0}}, SolverKind::fastest);
                       }),
                       "shear modulus"));
        for (const SolverKind kind : {SolverKind::fourier, SolverKind::cholesky}) {
            const auto solver = make_equilibrium_solver({{8, 8}, metallic_glass}, kind);
            VectorField wrong(9, 9);
            CHECK(contains(message_of([&] { solver->solve(wrong, WallData::zero); }), "9 rows and 9 columns"));
        }
        const BoundaryConditions lone{.left = around, .right = fixed};
        CHECK(contains(message_of([&] { CholeskyEquilibrium({{8, 8}, metallic_glass, lone}); }), "left and right"));
        const BoundaryConditions half{.bottom = {Condition::periodic, Condition::traction}, .top = around};
        CHECK(contains(message_of([&] { CholeskyEquilibrium({{8, 8}, metallic_glass, half}); }), "bottom and top"));
    }

    TEST_CASE("Cholesky solves every combination of sides, singular ones with the least norm") {
        const SideConditions kinds[] = {fixed, free_side, slip_x, slip_y};
        std::vector<BoundaryConditions> combinations;
        for (const SideConditions& left : kinds)
            for (const SideConditions& right : kinds) {
                combinations.push_back({left, right, around, around});
                combinations.push_back({around, around, left, right});
                for (const SideConditions& bottom : kinds)
                    for (const SideConditions& top : kinds)
                        combinations.push_back({left, right, bottom, top});
            }
        combinations.push_back({around, around, around, around});
        REQUIRE(combinations.size() == 289);
        int singular = 0;
        for (const Grid& grid : {Grid{6, 8, 2.0, 1.5}, Grid{7, 5, 1.0, 1.0}})
            for (const Stiffness stiffness : {Stiffness::exact, Stiffness::full})
                for (const BoundaryConditions& boundary : combinations) {
                    const BoundaryValueProblem problem{grid, metallic_glass, boundary, stiffness};
                    CholeskyEquilibrium equilibrium(problem);
                    const VectorField any = random_field(VectorField(equilibrium.node_rows(), equilibrium.node_columns()), 7);
                    const VectorField load = assembled_reference(problem, any); // balanced, being the image of something
                    VectorField w = load;
                    const auto for_each_prescribed = [&](const auto& visit) {
                        for (int j = 0; j < w.u.rows(); ++j)
                            for (int i = 0; i < w.u.columns(); ++i) {
                                visit(prescribed(problem, i, j, &SideConditions::u), w.u(i, j), any.u(i, j), i, j,
                                      &VectorField::u);
                                visit(prescribed(problem, i, j, &SideConditions::v), w.v(i, j), any.v(i, j), i, j,
                                      &VectorField::v);
                            }
                    };
                    for_each_prescribed([](bool holds, double& value, double given, auto...) { value = holds ? given : value; });
                    equilibrium.solve(w);
                    const VectorField f = assembled_reference(problem, w);
                    double residual = 0.0, norm = 0.0, norm_any = 0.0, difference = 0.0, along = 0.0;
                    for_each_prescribed([&](bool holds, double value, double given, int i, int j, auto component) {
                        if (holds) {
                            residual = std::max(residual, std::abs(value - given));
                            return;
                        }
                        residual = std::max(residual, std::abs((f.*component)(i, j) - (load.*component)(i, j)) / largest(load));
                        norm += value * value;
                        norm_any += given * given;
                        difference += (value - given) * (value - given);
                        along += value * (given - value);
                    });
                    CAPTURE(grid.cells_x);
                    CHECK(residual < 1e-12);
                    if (equilibrium.free_motions() == 0)
                        CHECK(difference < 1e-20 * norm_any);
                    else {
                        // any - w is a free motion: the answer must have no part along it.
                        ++singular;
                        CHECK(std::abs(along) < 1e-11 * norm_any);
                        CHECK(norm < norm_any);
                        CHECK(difference > 1e-6 * norm_any);
                    }
                }
        CHECK(singular > 100);
    }

    TEST_CASE("the free motions are counted") {
        const auto count = [](const Grid& grid, const BoundaryConditions& boundary, Stiffness stiffness) {
            return CholeskyEquilibrium({grid, metallic_glass, boundary, stiffness}).free_motions();
        };
        const Grid even{8, 6, 2.0, 1.0}, odd{7, 5, 2.0, 1.0};
        const BoundaryConditions all_free{}, all_around{around, around, around, around}, clamped{.bottom = fixed},
            walls{around, around, fixed, fixed}, sliding{around, around, slip_x, slip_x}, rollers{.bottom = slip_x};
        CHECK(count(even, all_free, Stiffness::exact) == 6);
        CHECK(count(even, all_free, Stiffness::full) == 3);
        CHECK(count(even, all_around, Stiffness::exact) == 4);
        CHECK(count(odd, all_around, Stiffness::exact) == 2);
        CHECK(count(even, all_around, Stiffness::full) == 2);
        CHECK(count(even, clamped, Stiffness::exact) == 0);
        CHECK(count(even, clamped, Stiffness::full) == 0);
        CHECK(count(even, walls, Stiffness::exact) == 0);
        CHECK(count(even, sliding, Stiffness::exact) == 2);
        CHECK(count(odd, sliding, Stiffness::exact) == 1);
        CHECK(count(even, sliding, Stiffness::full) == 1);
        CHECK(count(even, rollers, Stiffness::exact) == 3);
        CHECK(count(even, rollers, Stiffness::full) == 1);
        // Energies of held motions fall with the size of the grid and must not be mistaken for free ones.
        CHECK(count({300, 4, 75.0, 1.0}, {.left = fixed}, Stiffness::exact) == 0);
        CHECK(count({4, 300, 1.0, 75.0}, {.left = slip_x, .bottom = slip_y}, Stiffness::full) == 1);
    }

    TEST_CASE("a load that drives a free motion is refused by name") {
        const Grid grid{6, 6, 2.0, 2.0};
        const auto refusal = [&](const BoundaryConditions& boundary, const auto& force) {
            CholeskyEquilibrium equilibrium({grid, metallic_glass, boundary, Stiffness::full});
            VectorField f(equilibrium.node_rows(), equilibrium.node_columns());
            for (int j = 0; j < f.u.rows(); ++j)
                for (int i = 0; i < f.u.columns(); ++i)
                    force(grid.x(i), grid.y(j), f.u(i, j), f.v(i, j));
            return message_of([&] { equilibrium.solve(f); });
        };
        const auto push = [](double, double, double& fx, double&) { fx = 1.0; };
        const auto lift = [](double, double, double&, double& fy) { fy = 1.0; };
        const auto turn = [](double x, double y, double& fx, double& fy) { fx = -y, fy = x; };
        const auto squeeze = [](double x, double, double& fx, double&) { fx = std::abs(x) > 0.99 ? -x : 0.0; };
        CHECK(contains(refusal({}, push), "translation in x"));
        CHECK(contains(refusal({}, lift), "translation in y"));
        CHECK(contains(refusal({}, turn), "rotation"));
        CHECK(refusal({}, squeeze) == "nothing was thrown");
        CHECK(contains(refusal({.bottom = slip_x}, push), "translation in x"));
        CHECK(refusal({.bottom = slip_x}, lift) == "nothing was thrown");
        CHECK(contains(refusal({around, around, around, around}, lift), "translation in y"));
        CHECK(refusal({around, around, fixed, free_side}, push) == "nothing was thrown");
    }

    TEST_CASE("a bar under uniaxial traction stretches as plane strain says") {
        const Grid grid{10, 4, 2.0, 0.5};
        const double traction = 0.01;
        const BoundaryConditions boundary{.left = slip_y, .right = free_side, .bottom = slip_x, .top = free_side};
        // sigma_yy = 0 in plane strain: eps_yy = -beta/alpha eps_xx, sigma_xx = (alpha - beta^2/alpha) eps_xx.
        const double alpha = metallic_glass.alpha(), beta = metallic_glass.beta();
        const double strain = traction / (alpha - beta * beta / alpha);
        for (const Stiffness stiffness : {Stiffness::exact, Stiffness::full}) {
            CholeskyEquilibrium equilibrium({grid, metallic_glass, boundary, stiffness});
            VectorField w(equilibrium.node_rows(), equilibrium.node_columns());
            for (int j = 0; j <= grid.cells_y; ++j)
                w.u(grid.cells_x, j) = traction * grid.dy() * (j == 0 || j == grid.cells_y ? 0.5 : 1.0);
            equilibrium.solve(w);
            // The strain, since the one-point stiffness leaves an alternating stretch free.
            CHECK(equilibrium.free_motions() == (stiffness == Stiffness::exact ? 1 : 0));
            for (int j = 0; j < grid.cells_y; ++j)
                for (int i = 0; i < grid.cells_x; ++i) {
                    const double xx = (w.u(i + 1, j) + w.u(i + 1, j + 1) - w.u(i, j) - w.u(i, j + 1)) / (2.0 * grid.dx());
                    const double yy = (w.v(i, j + 1) + w.v(i + 1, j + 1) - w.v(i, j) - w.v(i + 1, j)) / (2.0 * grid.dy());
                    CHECK(std::abs(xx - strain) < 1e-12 * strain);
                    CHECK(std::abs(yy + beta / alpha * strain) < 1e-12 * strain);
                }
        }
    }
}

} // namespace equilibrium_suite
