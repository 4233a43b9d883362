// SPDX-License-Identifier: GPL-3.0-or-later
// How fast the equilibrium solvers are on this machine: the Fourier solver on one and two threads, CHOLMOD beside it where its
// factors fit, and the bandwidth of a triad to judge them by. Run it alone on an idle machine; it takes about two minutes.
#include <ductile/base/aligned.hpp>
#include <ductile/base/threads.hpp>
#include <ductile/space/equilibrium_solver.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fmt/format.h>

using namespace ductile;

namespace {

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// Shortest of the repetitions that fit into `budget` seconds; `prepare` is not timed.
template <class Prepare, class Work> double shortest(double budget, const Prepare& prepare, const Work& work) {
    double best = 1e300;
    const double start = seconds();
    do {
        prepare();
        const double begin = seconds();
        work();
        best = std::min(best, seconds() - begin);
    } while (seconds() - start < budget);
    return best;
}

/// a = b + s c on arrays far larger than the caches: 24 bytes a value are counted, as STREAM does.
double triad_gigabytes_per_second() {
    constexpr long size = 16 << 20;
    aligned_vector<double> a(static_cast<std::size_t>(size), 0.0), b(a.size(), 1.0), c(a.size(), 2.0);
    const double time = shortest(
        1.0, [] {},
        [&] {
            constexpr long row = 1 << 10;
            for_each_row({size / row, row}, [&](int j) {
                for (long i = j * row; i < (j + 1) * row; ++i)
                    a[static_cast<std::size_t>(i)] = b[static_cast<std::size_t>(i)] + 3.0 * c[static_cast<std::size_t>(i)];
            });
        });
    return 24e-9 * static_cast<double>(size) / time;
}

VectorField smooth_load(const Grid& grid) {
    VectorField f(grid);
    for (int j = 1; j < grid.cells_y; ++j) {
        for (int i = 0; i < grid.cells_x; ++i) {
            f.u(i, j) = std::sin(7.0 * grid.x(i)) * std::cos(3.0 * grid.y(j)) * grid.cell_area();
            f.v(i, j) = std::cos(5.0 * grid.x(i) - grid.y(j)) * grid.cell_area();
        }
        f.u.wrap_row(j);
        f.v.wrap_row(j);
    }
    return f;
}

void report(int cells, SolverKind kind, int threads) {
    set_thread_count(threads);
    const EquilibriumProblem problem{.grid = {.cells_x = cells, .cells_y = cells},
                                     .elasticity = {.bulk_modulus = 122.0, .shear_modulus = 37.4}};
    const double begin = seconds();
    const auto solver = make_equilibrium_solver(problem, kind);
    const double preparation = seconds() - begin;
    const VectorField load = smooth_load(problem.grid);
    VectorField field = load;
    const double time = shortest(
        1.5, [&] { field = load; }, [&] { solver->solve(field, WallData::zero); });
    const double unknowns = 2.0 * cells * (cells - 1);
    fmt::print("{:>9} {:>6} {:>8} {:>12.3f} {:>14.1f} {:>12.3f} {:>10.2f}\n", solver->name(), cells, threads, 1e3 * time,
               1e-6 * unknowns / time, preparation, 1e-6 * static_cast<double>(solver->memory_bytes()));
    std::fflush(stdout);
}

} // namespace

int main() {
    for (const int threads : {1, 2}) {
        set_thread_count(threads);
        fmt::print("triad, {} thread{}: {:.1f} GB/s\n", threads, threads == 1 ? "" : "s", triad_gigabytes_per_second());
    }
    fmt::print("{:>9} {:>6} {:>8} {:>12} {:>14} {:>12} {:>10}\n", "solver", "cells", "threads", "solve (ms)", "M unknowns/s",
               "prepare (s)", "MB");
    for (const int cells : {128, 252, 504, 512, 1260, 2520})
        for (const int threads : {1, 2})
            report(cells, SolverKind::fourier, threads);
    for (const int cells : {128, 252, 504, 512})
        report(cells, SolverKind::cholesky, 1);
}
