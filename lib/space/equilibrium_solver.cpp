// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/space/cholesky.hpp>
#include <ductile/space/equilibrium_solver.hpp>
#include <ductile/space/fourier.hpp>

namespace ductile {

std::unique_ptr<EquilibriumSolver> make_equilibrium_solver(const EquilibriumProblem& problem, SolverKind kind) {
    return kind == SolverKind::cholesky ? make_cholesky_solver(problem) : make_fourier_solver(problem);
}

} // namespace ductile
