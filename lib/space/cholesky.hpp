// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/space/boundary.hpp>
#include <ductile/space/equilibrium_solver.hpp>

#include <memory>

namespace ductile {

/// What CholeskyEquilibrium is built from.
struct BoundaryValueProblem {
    Grid grid;
    IsotropicElasticity elasticity;
    BoundaryConditions boundary;
    Stiffness stiffness = Stiffness::exact;
};

/// Solves K w = f on the rectangle for any combination of prescribed, traction and periodic sides, by sparse Cholesky
/// factorisation.
///
/// Where the sides leave rigid (or, for the one-point stiffness, alternating) motions free, the load must not drive them; the
/// answer then is the one of least norm on the free degrees of freedom. See FreeMotions. One to two orders of magnitude slower
/// than the Fourier solver, plus seconds of factorisation for 10^5 nodes and more.
class CholeskyEquilibrium {
public:
    /// Throws InputError for an impossible grid, elasticity or boundary, RunError when the factorisation fails.
    explicit CholeskyEquilibrium(const BoundaryValueProblem& problem);
    ~CholeskyEquilibrium();
    CholeskyEquilibrium(const CholeskyEquilibrium&) = delete;
    CholeskyEquilibrium& operator=(const CholeskyEquilibrium&) = delete;

    [[nodiscard]] int node_rows() const;
    [[nodiscard]] int node_columns() const;
    /// Number of independent motions that neither the sides nor the stiffness hold.
    [[nodiscard]] int free_motions() const;

    /// In place, on node_rows() rows of node_columns() values. On entry prescribed degrees of freedom hold their values and all
    /// others nodal forces per unit thickness (stress times length), tractions included; on exit all hold w, images in x wrapped.
    /// Throws InputError for a field of another shape and for a load that drives a free motion by more than 10^-8 of its norm,
    /// RunError when the solution is not finite.
    void solve(VectorField& field);

    /// Bytes held by the factor and work space.
    [[nodiscard]] std::size_t memory_bytes() const;

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

/// CholeskyEquilibrium for x periodic between two Dirichlet walls. Throws as its constructor does.
[[nodiscard]] std::unique_ptr<EquilibriumSolver> make_cholesky_solver(const EquilibriumProblem& problem);

} // namespace ductile
