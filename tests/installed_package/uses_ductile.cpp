// SPDX-License-Identifier: GPL-3.0-or-later
// A layer between two fixed walls is pushed along them by the same force at every node and bends to a parabola.
#include <ductile/material/stz.hpp>
#include <ductile/space/equilibrium_solver.hpp>

#include <cmath>
#include <fmt/format.h>

int main() {
    using namespace ductile;
    const Grid grid{.cells_x = 32, .cells_y = 16, .width = 2.0, .height = 1.0};
    const IsotropicElasticity elasticity{.bulk_modulus = 3.0, .shear_modulus = 2.0};
    const auto solver = make_equilibrium_solver({.grid = grid, .elasticity = elasticity}, SolverKind::fourier);
    VectorField field(grid);
    for (int j = 1; j < grid.cells_y; ++j)
        for (int i = 0; i < grid.cells_x; ++i)
            field.u(i, j) = elasticity.shear_modulus * grid.dx() / grid.dy(); // then u_j = j (N - j)/2
    solver->solve(field, WallData::zero);
    fmt::print("{} solver: u = {:.9f} in the middle\n", solver->name(), field.u(7, 8));

    // Vector code compiled here, without the instruction set the library was compiled for, beside the library's own.
    const StzModel metal(StzParameters{}, Units{});
    double fluidity[pack_size];
    store(metal.rates(Pack(1.2), std::array{Pack(0.04)}).fluidity, fluidity);
    const double expected = metal.rates(1.2, std::array{0.04}).fluidity;
    fmt::print("vectors agree: {}\n", std::abs(fluidity[pack_size - 1] - expected) < 1e-13 * expected);
}
