// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/material/elasticity.hpp>
#include <ductile/space/field.hpp>
#include <ductile/space/grid.hpp>

#include <memory>
#include <string_view>

namespace ductile {

/// Which discretisation of the elastic stiffness the solver inverts.
enum class Stiffness {
    exact, ///< K = B^T C B with the one-point (cell-centre) gradient B: the projection is exact to round-off
    full,  ///< the fully integrated bilinear element, Lu & Rycroft (S.20): the paper's approximate projection
};

/// Whether the rows of the walls carry data. Homogeneous walls cost nothing on the right-hand side.
enum class WallData { zero, given };

/// Solves the constant-coefficient elastic operator K w = f on the staggered grid, x periodic, Dirichlet data on both walls.
/// Everything is in the units of the grid and the elasticity; f is a nodal force per unit thickness (stress times length),
/// f = -B^T sigma/dt in the projection, Eq. (50).
class EquilibriumSolver {
public:
    virtual ~EquilibriumSolver() = default;

    /// In place. On entry rows 1 .. N-1 of `field` hold f; with WallData::given rows 0 and N hold the Dirichlet data,
    /// with WallData::zero they are taken (and set) to be zero. On exit all rows hold w, images wrapped.
    /// Throws RunError when the solution is not finite (f was not).
    virtual void solve(VectorField& field, WallData walls) = 0;

    [[nodiscard]] virtual std::string_view name() const = 0;
    /// Bytes held by factors, plans and work space.
    [[nodiscard]] virtual std::size_t memory_bytes() const = 0;
};

enum class SolverKind { fastest, fourier, cholesky };

/// What the factory builds a solver from.
struct EquilibriumProblem {
    Grid grid;
    IsotropicElasticity elasticity;
    Stiffness stiffness = Stiffness::exact;
};

/// Builds a solver; `fastest` picks Fourier, which fits every grid with periodic x and Dirichlet walls.
/// Throws InputError for an impossible grid or elasticity.
[[nodiscard]] std::unique_ptr<EquilibriumSolver> make_equilibrium_solver(const EquilibriumProblem& problem, SolverKind kind);

} // namespace ductile
