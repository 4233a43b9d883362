#include <ductile/base/error.hpp>
#include <ductile/equilibrium/cholesky.hpp>
#include <ductile/equilibrium/fourier.hpp>
#include <ductile/equilibrium/solver.hpp>

#include <fmt/format.h>

namespace ductile {

std::unique_ptr<EquilibriumSolver> make_equilibrium_solver(const EquilibriumProblem& problem, SolverKind kind) {
    return kind == SolverKind::cholesky ? make_cholesky_solver(problem) : make_fourier_solver(problem);
}

SolverKind solver_kind(std::string_view name) {
    if (name == "fastest")
        return SolverKind::fastest;
    if (name == "fourier")
        return SolverKind::fourier;
    if (name == "cholesky")
        return SolverKind::cholesky;
    throw InputError(fmt::format("--equilibrium {}: the solvers are fastest, fourier and cholesky", name));
}

Stiffness stiffness_kind(std::string_view name) {
    if (name == "exact")
        return Stiffness::exact;
    if (name == "full")
        return Stiffness::full;
    throw InputError(fmt::format("--operator {}: the operators are exact and full", name));
}

} // namespace ductile
