// SPDX-License-Identifier: GPL-3.0-or-later
#include "fields.hpp"
#include "matrix.hpp"
#include "rk21_reference.hpp"
#include <ductile/base/threads.hpp>
#include <ductile/space/space.hpp>

#include <cmath>
#include <doctest/doctest.h>
#include <random>

namespace predictor_suite {

using namespace ductile;
using namespace ductile::quasistatic;

namespace {

constexpr double mu = 37.4 / 0.85, K = 122.0 / 0.85;

/// A plasticity model beside a plain function for D^pl and the rate of the internal variable, written from the paper.
struct Checked {
    Law law;
    std::array<double, 2> (*rates)(double sbar, double internal);
};

/// (A.1)-(A.3), (21) with Table A.3 in units of s_Y, t_s and e_Z/k_B.
std::array<double, 2> stz_rates(double sbar, double chi) {
    if (sbar < 1.0)
        return {0.0, 0.0};
    const double bias = 300e-30 * 0.3 * 0.85e9 / (1.3806488e-23 * 400.0);
    const double flow =
        4.05e-6 / 1e-13 * std::exp(-1.0 / chi) * std::exp(-8000.0 / 400.0) * std::cosh(bias * sbar) * (1.0 - 1.0 / sbar);
    return {flow, 2.0 * sbar * flow * (900.0 / 21000.0 - chi) / 0.4};
}

constexpr PerzynaParameters hardening_metal{
    .yield_stress = 0.9 * 0.85e9, .hardening_modulus = 3.0 * 0.85e9, .reference_rate = 200.0, .overstress_exponent = 2};
std::array<double, 2> perzyna_rates(double sbar, double kappa) {
    const double yield = 0.9 + 3.0 * kappa;
    const double flow = sbar < yield ? 0.0 : 200.0 * 4.05e-6 * std::pow(sbar / yield - 1.0, 2);
    return {flow, flow};
}

const Checked stz{fields::glass_law, stz_rates},
    perzyna{perzyna_law({.bulk_modulus = K, .shear_modulus = mu}, hardening_metal, Units{}), perzyna_rates};

/// Everything the predictor does, cell by cell, from Eqs. (16), (27), (28) and App. B: sigma*, chi* and -B^T sigma*/dt.
struct Reference {
    CellState next;
    VectorField force;
    Rk21Counts counts;
    int elastic = 0, plastic = 0; ///< cells
};

using tensors::Matrix;
using tensors::product;

/// Eq. (4) as printed, times 2h, around f(0).
double literal_eno(double u, auto&& f) {
    const auto second = [&](int k) { return std::abs(f(k + 1) - 2.0 * f(k) + f(k - 1)); };
    if (u < 0.0 && second(0) > second(1))
        return -f(2) + 4.0 * f(1) - 3.0 * f(0);
    if (u > 0.0 && second(0) > second(-1))
        return 3.0 * f(0) - 4.0 * f(-1) + f(-2);
    return f(1) - f(-1);
}

Reference reference(const Scene& scene, const Checked& law, Predictor predictor, const CellState& now, const VectorField& w,
                    double dt, const Rk21Options& options) {
    const Grid& grid = scene.grid;
    const int m = grid.cells_x, n = grid.cells_y;
    Reference r{.next = CellState(grid, 1), .force = VectorField(grid), .counts = {}};
    const auto column = [m](int i) { return (i % m + m) % m; };
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < m; ++i) {
            // velocity and its gradient, Eq. (2), (grad v)_ij = dv_i/dx_j
            const int right = column(i + 1);
            const auto centre = [&](const Field& f) { return (f(i, j) + f(right, j) + f(i, j + 1) + f(right, j + 1)) / 4.0; };
            const auto dx = [&](const Field& f) {
                return (f(right, j) + f(right, j + 1) - f(i, j) - f(i, j + 1)) / (2.0 * grid.dx());
            };
            const auto dy = [&](const Field& f) {
                return (f(i, j + 1) + f(right, j + 1) - f(i, j) - f(right, j)) / (2.0 * grid.dy());
            };
            const Matrix grad{{{dx(w.u), dy(w.u), 0.0}, {dx(w.v), dy(w.v), 0.0}, {0.0, 0.0, 0.0}}};
            const double p = now.stress.p(i, j), s = now.stress.s(i, j), tau = now.stress.tau(i, j), q = now.stress.q(i, j);
            Matrix rate{}; // of the stress without plasticity

            if (scene.model == Model::full) {
                Matrix spin;
                for (std::size_t a = 0; a < 3; ++a)
                    for (std::size_t b = 0; b < 3; ++b)
                        spin[a][b] = 0.5 * (grad[a][b] - grad[b][a]);
                const Matrix stress{{{-p + s - q, tau, 0.0}, {tau, -p - s - q, 0.0}, {0.0, 0.0, -p + 2.0 * q}}};
                const Matrix stress_spin = product(stress, spin), spin_stress = product(spin, stress);
                for (std::size_t a = 0; a < 3; ++a)
                    for (std::size_t b = 0; b < 3; ++b)
                        rate[a][b] = -stress_spin[a][b] + spin_stress[a][b]; // Eq. (5)
            }
            if (predictor == Predictor::incremental) {
                const double trace = grad[0][0] + grad[1][1];
                for (std::size_t a = 0; a < 3; ++a)
                    for (std::size_t b = 0; b < 3; ++b)
                        rate[a][b] += mu * (grad[a][b] + grad[b][a]) + (a == b ? (K - 2.0 * mu / 3.0) * trace : 0.0);
            }
            // back to the components of Eq. (1)
            double p_rate = -(rate[0][0] + rate[1][1] + rate[2][2]) / 3.0;
            std::array<double, 4> source{(rate[0][0] - rate[1][1]) / 2.0, rate[0][1], (rate[2][2] + p_rate) / 2.0, 0.0};
            if (scene.model == Model::full) {
                const auto advection = [&](const Field& f) {
                    const auto value = [&](int k, int l) { // two ghost rows by linear extrapolation
                        if (l < 0)
                            return f(column(k), 0) + l * (f(column(k), 1) - f(column(k), 0));
                        if (l >= n)
                            return f(column(k), n - 1) + (l - n + 1) * (f(column(k), n - 1) - f(column(k), n - 2));
                        return f(column(k), l);
                    };
                    const double u = centre(w.u), v = centre(w.v);
                    return -u * literal_eno(u, [&](int k) { return value(i + k, j); }) / (2.0 * grid.dx()) -
                           v * literal_eno(v, [&](int l) { return value(i, j + l); }) / (2.0 * grid.dy());
                };
                p_rate += advection(now.stress.p);
                source[0] += advection(now.stress.s);
                source[1] += advection(now.stress.tau);
                source[2] += advection(now.stress.q);
                source[3] += advection(now.internal[0]);
            }
            const auto slope = [&](const std::array<double, 4>& y) {
                const double sbar = std::sqrt(y[0] * y[0] + y[1] * y[1] + 3.0 * y[2] * y[2]);
                std::array<double, 4> k = source;
                const auto [flow, internal_rate] = law.rates(sbar, y[3]);
                if (flow > 0.0)
                    for (std::size_t c = 0; c < 3; ++c)
                        k[c] -= 2.0 * mu * flow * y[c] / sbar; // C : D^pl, Eq. (20): deviatoric
                k[3] += internal_rate;
                return k;
            };
            std::array<double, 4> y{s, tau, q, now.internal[0](i, j)};
            const auto flows = [&](const std::array<double, 4>& x) {
                return law.rates(std::sqrt(x[0] * x[0] + x[1] * x[1] + 3.0 * x[2] * x[2]), x[3])[0] > 0.0;
            };
            std::array<double, 4> end;
            for (std::size_t c = 0; c < 4; ++c)
                end[c] = y[c] + dt * source[c];
            const bool plastic = flows(y) || flows(end); // on a straight path sbar is largest at an end
            ++(plastic ? r.plastic : r.elastic);
            if (predictor == Predictor::euler) {
                const auto k = slope(y);
                for (std::size_t c = 0; c < 4; ++c)
                    end[c] = y[c] + dt * k[c];
            } else if (plastic) {
                const auto result = reference_rk21(slope, y, dt, options);
                end = result.y;
                r.counts.accepted += result.accepted;
                r.counts.rejected += result.rejected;
            }
            r.next.stress.p(i, j) = p + dt * p_rate;
            r.next.stress.s(i, j) = end[0];
            r.next.stress.tau(i, j) = end[1];
            r.next.stress.q(i, j) = end[2];
            r.next.internal[0](i, j) = end[3];
        }
    for (Field* f : fields::fields_of(r.next))
        fields::wrap(*f);
    const auto& next = r.next.stress;
    for (int j = 1; j < n; ++j)
        for (int i = 0; i < m; ++i) {
            // minus (S.14), (S.15) over dt: the four cells around the corner push along their outward normals
            for (const auto& [k, l, x, y] : {std::array{column(i - 1), j - 1, 1, 1}, std::array{i, j - 1, -1, 1},
                                             std::array{column(i - 1), j, 1, -1}, std::array{i, j, -1, -1}}) {
                const double xx = -next.p(k, l) + next.s(k, l) - next.q(k, l), yy = -next.p(k, l) - next.s(k, l) - next.q(k, l);
                r.force.u(i, j) -= 0.5 * (x * grid.dy() * xx + y * grid.dx() * next.tau(k, l)) / dt;
                r.force.v(i, j) -= 0.5 * (x * grid.dy() * next.tau(k, l) + y * grid.dx() * yy) / dt;
            }
        }
    return r;
}

/// Smooth random fields around yield: some cells stay elastic, some flow, some begin to.
struct Problem {
    CellState cells;
    VectorField velocity;
};

Problem random_problem(const Grid& grid, const Checked& law, unsigned seed) {
    std::mt19937 engine(seed);
    Problem problem{CellState(grid, 1), VectorField(grid)};
    fields::fill_smoothly(problem.cells.stress.p, engine, 0.1, 0.5);
    fields::fill_smoothly(problem.cells.stress.s, engine, 0.2, 0.4);
    fields::fill_smoothly(problem.cells.stress.tau, engine, 0.95, 0.4);
    fields::fill_smoothly(problem.cells.stress.q, engine, -0.05, 0.1);
    if (law.rates == stz_rates)
        fields::fill_smoothly(problem.cells.internal[0], engine, 0.034, 0.004);
    else
        fields::fill_smoothly(problem.cells.internal[0], engine, 0.05, 0.02);
    fields::fill_smoothly(problem.velocity.u, engine, 1e-6, 4e-6);
    fields::fill_smoothly(problem.velocity.v, engine, -5e-7, 4e-6);
    return problem;
}

/// Relative to the largest value of the field.
double deviation(const Field& a, const Field& b) {
    double worst = 0.0;
    for (int j = 0; j < a.rows(); ++j)
        for (int i = 0; i < a.columns(); ++i) {
            const double d = std::abs(a(i, j) - b(i, j));
            worst = d <= worst ? worst : d;
        }
    return worst / fields::largest(b);
}

constexpr Predictor predictors[] = {Predictor::euler, Predictor::substepped, Predictor::incremental};
const Grid grids[] = {Grid{4, 5, 1.0, 1.0}, Grid{13, 7, 2.0, 1.0}, Grid{16, 9, 1.0, 3.0}, Grid{21, 16, 2.0, 2.0},
                      Grid{35, 4, 7.0, 0.5}};
constexpr double dt = 300.0;

} // namespace

TEST_SUITE("predictor") {
    TEST_CASE_FIXTURE(fields::OneThread, "every predictor and model agrees with a literal evaluation of the equations") {
        int elastic = 0, plastic = 0;
        long long accepted = 0, rejected = 0;
        for (const Checked& law : {stz, perzyna})
            for (const Model model : {Model::reduced, Model::full})
                for (const Predictor predictor : predictors)
                    for (const Grid& grid : grids) {
                        const Scene scene = fields::scene_on(grid, model, {2e-7, 0.0}, law.law);
                        Problem problem = random_problem(grid, law, 7u + static_cast<unsigned>(grid.cells_x));
                        const CellState before = problem.cells;
                        // tight enough for several substeps in the cells that flow most
                        const Rk21Options options{.absolute_tolerance = 1e-5, .relative_tolerance = 1e-5, .exact_components = 1};
                        const Reference expected = reference(scene, law, predictor, before, problem.velocity, dt, options);
                        CellState next(grid, 1);
                        VectorField force(grid);
                        const Rk21Counts report = fields::predict(scene, predictor, problem.cells, problem.cells,
                                                                  problem.velocity, dt, options, next, force);
                        CAPTURE(grid.cells_x);
                        CAPTURE(static_cast<int>(predictor));
                        CAPTURE(static_cast<int>(model));
                        const auto a = fields::fields_of(next);
                        const auto b = fields::fields_of(expected.next);
                        for (std::size_t k = 0; k < a.size(); ++k) {
                            CAPTURE(k);
                            CHECK(deviation(*a[k], *b[k]) < 1e-12);
                            CHECK(fields::distance(*a[k], *b[k]) < 1e-12 * (1.0 + fields::largest(*b[k]))); // images wrapped
                        }
                        for (const auto& [f, g] :
                             {std::pair{&force.u, &expected.force.u}, std::pair{&force.v, &expected.force.v}})
                            for (int j = 1; j < grid.cells_y; ++j)
                                for (int i = 0; i < grid.cells_x; ++i)
                                    CHECK(std::abs((*f)(i, j) - (*g)(i, j)) < 1e-12 * fields::largest(*g));
                        for (std::size_t k = 0; k < a.size(); ++k) // the present is left as it was
                            CHECK(fields::same_bits(*fields::fields_of(problem.cells)[k], *fields::fields_of(before)[k]));
                        CHECK(report.accepted == expected.counts.accepted);
                        CHECK(report.rejected == expected.counts.rejected);
                        CHECK(!report.failed);
                        elastic += expected.elastic;
                        plastic += expected.plastic;
                        accepted += expected.counts.accepted;
                        rejected += expected.counts.rejected;
                    }
        CHECK(elastic > 1000);
        CHECK(plastic > 1000);
        CHECK(accepted > 2000);
        CHECK(rejected > 100);
    }

    TEST_CASE_FIXTURE(fields::OneThread, "a field without stress or motion stays so") {
        const Grid grid{9, 6, 2.0, 2.0};
        for (const Model model : {Model::reduced, Model::full})
            for (const Predictor predictor : predictors) {
                const Scene scene = fields::scene_on(grid, model, {0.0, 0.0});
                CellState now(grid, 1), next(grid, 1);
                for (int j = 0; j < grid.cells_y; ++j)
                    std::fill_n(now.internal[0].row(j), now.internal[0].columns(), 0.03);
                fields::wrap(now.internal[0]);
                const VectorField still(grid);
                VectorField force(grid);
                const Rk21Counts report =
                    fields::predict(scene, predictor, now, now, still, dt, fields::pointwise(dt), next, force);
                for (const Field* f : {&next.stress.p, &next.stress.s, &next.stress.tau, &next.stress.q})
                    CHECK(fields::largest(*f) == 0.0);
                fields::check_uniform(next.internal[0], 0.03, 0.0);
                CHECK(report.accepted == 0);
                CHECK(fields::largest(force.u) + fields::largest(force.v) == 0.0);
            }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "the number of threads changes no bit") {
        for (const Model model : {Model::reduced, Model::full})
            for (const Predictor predictor : predictors)
                for (const Grid& grid : grids) {
                    const Scene scene = fields::scene_on(grid, model, {2e-7, 0.0});
                    Problem problem = random_problem(grid, stz, 11);
                    CellState expected(grid, 1);
                    VectorField expected_force(grid);
                    set_thread_count(1);
                    const Rk21Counts counts = fields::predict(scene, predictor, problem.cells, problem.cells, problem.velocity,
                                                              dt, fields::pointwise(dt, 1e-9), expected, expected_force);
                    for (const int threads : {2, 3, 8}) {
                        set_thread_count(threads, 0);
                        CellState next(grid, 1);
                        VectorField force(grid);
                        const Rk21Counts others = fields::predict(scene, predictor, problem.cells, problem.cells,
                                                                  problem.velocity, dt, fields::pointwise(dt, 1e-9), next, force);
                        for (std::size_t k = 0; k < 5; ++k)
                            CHECK(fields::fields_of(next)[k]->storage() == fields::fields_of(expected)[k]->storage());
                        CHECK(force.u.storage() == expected_force.u.storage());
                        CHECK(force.v.storage() == expected_force.v.storage());
                        CHECK(others.accepted == counts.accepted);
                        CHECK(others.rejected == counts.rejected);
                    }
                }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "a cell's result does not depend on whether its neighbours in the batch flow") {
        const Grid grid{2 * pack_size + 3, 4, 2.0, 2.0};
        // without transport a cell knows nothing of its neighbours
        for (const Predictor predictor : predictors) {
            const Scene scene = fields::scene_on(grid, Model::reduced, {2e-7, 0.0});
            Problem problem = random_problem(grid, stz, 13);
            for (int j = 0; j < grid.cells_y; ++j)
                for (int i = 0; i < grid.cells_x; ++i) { // scaled to sbar = 0.5: elastic
                    auto& [p, s, tau, q] = problem.cells.stress;
                    const double sbar = std::sqrt(s(i, j) * s(i, j) + tau(i, j) * tau(i, j) + 3.0 * q(i, j) * q(i, j));
                    for (Field* f : {&s, &tau, &q})
                        (*f)(i, j) *= 0.5 / sbar;
                }
            for (Field* f : fields::fields_of(problem.cells))
                fields::wrap(*f);
            const auto advance = [&](const CellState& cells) {
                CellState now = cells, next(grid, 1);
                VectorField force(grid);
                (void)fields::predict(scene, predictor, now, now, problem.velocity, dt, fields::pointwise(dt, 1e-9), next, force);
                return next;
            };
            const CellState elastic = advance(problem.cells);
            for (int flowing = 0; flowing < grid.cells_x; ++flowing) {
                CellState cells = problem.cells;
                cells.stress.tau(flowing, 1) = 1.4;
                fields::wrap(cells.stress.tau);
                const CellState next = advance(cells);
                CHECK(next.internal[0](flowing, 1) > elastic.internal[0](flowing, 1));
                for (std::size_t k = 0; k < 5; ++k)
                    for (int j = 0; j < grid.cells_y; ++j)
                        for (int i = 0; i < grid.cells_x; ++i)
                            if (i != flowing || j != 1)
                                CHECK((*fields::fields_of(next)[k])(i, j) == (*fields::fields_of(elastic)[k])(i, j));
            }
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "a cell that cannot be integrated is reported") {
        const Grid grid{9, 5, 2.0, 2.0};
        for (const Predictor predictor : {Predictor::substepped, Predictor::incremental}) {
            const Scene scene = fields::scene_on(grid, Model::reduced, {2e-7, 0.0});
            Problem problem = random_problem(grid, stz, 17);
            problem.cells.stress.tau(8, 4) = std::numeric_limits<double>::quiet_NaN();
            fields::wrap(problem.cells.stress.tau);
            CellState next(grid, 1);
            VectorField force(grid);
            CHECK(fields::predict(scene, predictor, problem.cells, problem.cells, problem.velocity, dt, fields::pointwise(dt),
                                  next, force)
                      .failed);
        }
    }
}

} // namespace predictor_suite
