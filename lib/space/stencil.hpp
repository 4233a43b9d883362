// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/space/equilibrium_solver.hpp>

#include <array>

namespace ductile {

/// Couples the force on one node (row: x, y component) to the velocity of another (column: u, v).
struct StiffnessBlock {
    double xx = 0.0, xy = 0.0, yx = 0.0, yy = 0.0;
};

/// The 8 x 8 stiffness of one cell, in units of stress. Row and column 2 n + c belong to component c (0: x, 1: y) at corner n;
/// corners are counted (0,0), (1,0), (0,1), (1,1) in (x, y).
using CellStiffness = std::array<std::array<double, 8>, 8>;

/// The constant-coefficient stiffness K as nine 2 x 2 blocks: (K w)_{i,j} = sum_{a,b} block(a, b) w_{i+a,j+b}, a, b in {-1, 0,
/// 1}.
///
/// Both stiffnesses are sums of tensor products. Along one direction, of spacing h, let three-point operators with the weights
/// of the neighbours -1, 0, 1 be
///     mass        h {m, 1 - 2 m, m},
///     stiffness   {-1, 2, -1} / h,
///     cross       {-1/2, 0, 1/2}            (integral of psi_centre dpsi_neighbour, antisymmetric).
/// With bilinear functions integrated exactly m = 1/6. The one-point gradient of Eq. (2) differences along one direction and
/// averages along the other, with {1/2, 1/2}; the cell area times average^T average has m = 1/4, and average^T difference is the
/// same cross operator. So B^T C B (times the cell area) is the integrated element with 1/4 in place of 1/6. Writing
/// d(0) = 2, d(+-1) = -1 and m(0) = 1 - 2 m, m(+-1) = m, and with the plane-strain C of Eq. (42),
///     block(a, b).xx = alpha (dy/dx) d(a) m(b) + mu (dx/dy) m(a) d(b),
///     block(a, b).yy = mu (dy/dx) d(a) m(b) + alpha (dx/dy) m(a) d(b),
///     block(a, b).xy = block(a, b).yx = -(beta + mu) a b / 4,       beta + mu = K + mu/3,
/// which for m = 1/6 are the entries of (S.20).
class Stencil {
public:
    Stencil(const Grid& grid, const IsotropicElasticity& elasticity, Stiffness stiffness);
    [[nodiscard]] const StiffnessBlock& block(int a, int b) const {
        return blocks_[static_cast<std::size_t>(3 * (b + 1) + a + 1)];
    }

private:
    std::array<StiffnessBlock, 9> blocks_;
};

/// The weight m above: the mass coupling of two neighbours over the spacing, 1/4 (exact) or 1/6 (full).
[[nodiscard]] constexpr double neighbour_mass(Stiffness stiffness) {
    return stiffness == Stiffness::exact ? 1.0 / 4.0 : 1.0 / 6.0;
}

/// The stiffness of one cell; the assembly of four of them gives the stencil.
[[nodiscard]] CellStiffness cell_stiffness(const Grid& grid, const IsotropicElasticity& elasticity, Stiffness stiffness);

/// f = K w on rows 1 .. N-1 of a grid periodic in x; rows 0 and N, the walls, are copied, so that solving with WallData::given
/// takes f back to w. Both fields are N + 1 rows of M values; the images of w must be wrapped, those of f are on exit.
/// Plain on purpose: the reference of tests and benchmarks.
void apply(const Stencil& stencil, const VectorField& w, VectorField& f);

} // namespace ductile
