// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/aligned.hpp>
#include <ductile/material/elasticity.hpp>
#include <ductile/space/element_line.hpp>
#include <ductile/space/equilibrium_solver.hpp>
#include <ductile/space/periodic_line.hpp>

#include <vector>

namespace ductile {

/// K v = f for K = B^T C B of elements along y and a periodic line along x, both walls Dirichlet.
///
/// For the wave of number l in x, with kappa and iota of PeriodicLine and w = i v, the strains at the stress points are
///     exx = i kappa V u,   eyy = -i iota S w,   2 exy = iota S u + kappa V w,
/// V and S the values and slopes of ElementLine, so that K is real, symmetric and the same for real and imaginary parts:
///     K_uu = alpha kappa^2 V^T W V + mu iota^2 S^T W S,   K_ww = alpha iota^2 S^T W S + mu kappa^2 V^T W V,
///     K_uw = kappa iota (mu S^T W V - beta V^T W S),      W = dx times the Gauss weights.
/// A node couples with those of its element alone: L D L^T keeps the rows' first columns, those of the element's lower edge.
/// Waves are factorised at once and solved in the lanes of a vector: one register has the real parts of as many, one the
/// imaginary ones.
class ElementModes final : public EquilibriumSolver {
public:
    ElementModes(const PeriodicLine& x, const ElementLine& y, const IsotropicElasticity& elasticity);

    void solve(VectorField& field, WallData walls) override;
    [[nodiscard]] std::string_view name() const override { return "fourier"; }
    [[nodiscard]] std::size_t memory_bytes() const override;

private:
    /// The degrees of freedom of a row of nodes are 2 j - 2 (u) and 2 j - 1 (w).
    [[nodiscard]] int unknowns() const { return 2 * (rows_ - 1); }
    /// The first column of a row of the factor.
    [[nodiscard]] int first(int row) const;
    void factorise(const PeriodicLine& x, const ElementLine& y, const IsotropicElasticity& elasticity, int block);
    /// Those of a row of nodes, u before w.
    [[nodiscard]] double* modes_of(int block, int node);
    void to_modes(const VectorField& field, int begin, int end);
    void apply_walls(const VectorField& field);
    void substitute(int block);
    [[nodiscard]] double to_nodes(int begin, int end, VectorField& field);

    int points_, padded_, rows_, degree_;            ///< M, N
    int blocks_;                                     ///< of as many modes as a register has lanes
    std::size_t entries_ = 0;                        ///< of the factor of a mode
    aligned_vector<double> u_to_modes_, w_to_modes_; ///< [M][blocks][pack]
    aligned_vector<double> u_to_nodes_, w_to_nodes_; ///< [blocks][pack][padded]
    aligned_vector<double> factors_;                 ///< [blocks][entries][register]: of each row those of L, then 1/D
    /// [2 walls][blocks][degree][4: uu, uw, wu, ww][register]: K of the nodes of the walls' elements and the walls' own
    aligned_vector<double> wall_couplings_;
    aligned_vector<double> values_;      ///< [blocks][unknowns][pack]
    std::vector<double> checksums_;      ///< of the shares of a solution
    aligned_vector<double> wall_values_; ///< [2 walls][blocks][2][pack]
};

} // namespace ductile
