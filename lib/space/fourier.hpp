// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/space/equilibrium_solver.hpp>

namespace ductile {

/// The direct solver for x periodic between two Dirichlet walls: FFT in x, then one block tridiagonal system in y a mode.
///
/// Method: u + i v of a row is one complex transform. W_k holds u_k + i v_k and the conjugate of W_{-k} holds u_k - i v_k, whose
/// sum and difference are just the unknowns u and i v for which ModeSystems is real. Coefficients take the place of the row they
/// come from, so that a solve reads and writes the field twice and touches no other large array: every row is eliminated right
/// after its transform and transformed back right after its substitution. The lower half of the rows is swept upwards and the
/// upper half downwards; one or two threads do that fused, more threads take turns: rows (transform), modes (sweeps), rows
/// (transform). Every row and mode sees the same operations in the same order whatever the number of threads, and FFTW estimates
/// its plans: on one machine results agree bitwise from thread to thread and from process to process, which restarts rely on.
///
/// Any M >= 4 and N >= 4, fastest when M has small prime factors only. Memory besides the field: pivots, a few MB.
/// Throws InputError for an impossible grid or elasticity, RunError when FFTW cannot plan; solve() throws InputError when the
/// field does not have the shape of the grid. A solver must not be used by two callers at once.
[[nodiscard]] std::unique_ptr<EquilibriumSolver> make_fourier_solver(const EquilibriumProblem& problem);

} // namespace ductile
