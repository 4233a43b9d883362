// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/space/stencil.hpp>

#include <algorithm>

namespace ductile {

Stencil::Stencil(const Grid& grid, const IsotropicElasticity& elasticity, Stiffness stiffness) {
    const double alpha = elasticity.alpha(), beta = elasticity.beta(), mu = elasticity.shear_modulus;
    const double dy_dx = grid.dy() / grid.dx(), dx_dy = grid.dx() / grid.dy();
    const double m = neighbour_mass(stiffness);
    for (int b = -1; b <= 1; ++b)
        for (int a = -1; a <= 1; ++a) {
            const double along_x = dy_dx * (a == 0 ? 2.0 : -1.0) * (b == 0 ? 1.0 - 2.0 * m : m);
            const double along_y = dx_dy * (a == 0 ? 1.0 - 2.0 * m : m) * (b == 0 ? 2.0 : -1.0);
            const double cross = -0.25 * (beta + mu) * a * b;
            blocks_[static_cast<std::size_t>(3 * (b + 1) + a + 1)] = {
                .xx = alpha * along_x + mu * along_y, .xy = cross, .yx = cross, .yy = mu * along_x + alpha * along_y};
        }
}

CellStiffness cell_stiffness(const Grid& grid, const IsotropicElasticity& elasticity, Stiffness stiffness) {
    const double alpha = elasticity.alpha(), beta = elasticity.beta(), mu = elasticity.shear_modulus;
    const double dy_dx = grid.dy() / grid.dx(), dx_dy = grid.dx() / grid.dy();
    const double neighbour = neighbour_mass(stiffness), own = 0.5 - neighbour;
    const auto sign = [](std::size_t end) { return end == 0 ? -1.0 : 1.0; };
    CellStiffness k{};
    for (std::size_t n = 0; n < 4; ++n)
        for (std::size_t m = 0; m < 4; ++m) {
            const std::size_t nx = n % 2, ny = n / 2, mx = m % 2, my = m / 2;
            const double along_x = dy_dx * sign(nx) * sign(mx) * (ny == my ? own : neighbour);
            const double along_y = dx_dy * sign(ny) * sign(my) * (nx == mx ? own : neighbour);
            k[2 * n][2 * m] = alpha * along_x + mu * along_y;
            k[2 * n + 1][2 * m + 1] = mu * along_x + alpha * along_y;
            k[2 * n][2 * m + 1] = 0.25 * (beta * sign(nx) * sign(my) + mu * sign(ny) * sign(mx));
            k[2 * n + 1][2 * m] = 0.25 * (beta * sign(ny) * sign(mx) + mu * sign(nx) * sign(my));
        }
    return k;
}

void apply(const Stencil& stencil, const VectorField& w, VectorField& f) {
    const int columns = w.u.columns(), walls = w.u.rows() - 1;
    for (int j : {0, walls}) {
        std::copy_n(w.u.row(j), columns, f.u.row(j));
        std::copy_n(w.v.row(j), columns, f.v.row(j));
    }
    for (int j = 1; j < walls; ++j)
        for (int i = 0; i < columns; ++i) {
            double fx = 0.0, fy = 0.0;
            for (int b = -1; b <= 1; ++b)
                for (int a = -1; a <= 1; ++a) {
                    const StiffnessBlock& k = stencil.block(a, b);
                    fx += k.xx * w.u(i + a, j + b) + k.xy * w.v(i + a, j + b);
                    fy += k.yx * w.u(i + a, j + b) + k.yy * w.v(i + a, j + b);
                }
            f.u(i, j) = fx;
            f.v(i, j) = fy;
        }
    for (int j = 0; j <= walls; ++j) {
        f.u.wrap_row(j);
        f.v.wrap_row(j);
    }
}

} // namespace ductile
