// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/mpm/krylov.hpp>

#include <cstdint>
#include <span>
#include <string>

namespace ductile::mpm {

/// F(u) = 0 with its derivative; what MomentumBalance offers, and what the solvers below and KINSOL's need.
struct NonlinearSystem {
    std::size_t size = 0;
    /// F, and what its norm is measured by at this u.
    FunctionRef<double(std::span<const double> u, std::span<double> f)> residual = {};
    FunctionRef<void(std::span<const double> u)> linearise = {}; ///< fixes the u of jacobian_times
    LinearMap jacobian_times = {};
    InPlaceMap precondition = {}; ///< an approximation of the inverse of J; may be empty
    /// The velocity that a change s of u adds, along which F does work, for the energy line search.
    LinearMap velocity_change = {};
};

enum class LinearMethod { conjugate_gradients, gmres };
enum class JacobianProduct {
    analytic,
    difference ///< (2.4.18), with the increment h |u| s/|s| (as printed it fails)
};
enum class LineSearch {
    none,
    residual, ///< Armijo backtracking: |F| must fall by 1e-4 of what the full step promises
    energy    ///< |w.F(u + a s)| <= |w.F(u)|/2 with the change of velocity w that belongs to s
};

struct NewtonOptions {
    LinearMethod linear = LinearMethod::gmres;
    JacobianProduct product = JacobianProduct::analytic;
    LineSearch line_search = LineSearch::energy;
    double tolerance = 1e-6;            ///< on |F|_2/scale
    double linear_tolerance = 0.1;      ///< relative to |F|; the first and largest with Eisenstat-Walker forcing
    bool eisenstat_walker = true;       ///< forcing terms 0.9 (|F_n|/|F_n-1|)^2 with their safeguard (Eisenstat & Walker 1996)
    double difference_increment = 1e-5; ///< h of (2.4.18)
    int largest_newton_iterations = 50;
    int largest_linear_iterations = 50; ///< a Newton step; the number of GMRES's vectors
};

struct SolverCounts {
    std::int64_t newton_iterations = 0, linear_iterations = 0, residual_evaluations = 0, jacobian_products = 0;
    std::int64_t backtracks = 0; ///< Newton steps that a line search shortened

    SolverCounts& operator+=(const SolverCounts& other);
};

struct SolverResult {
    bool converged = false;
    double norm = 0.0;        ///< |F|_2/scale at the end
    std::string failure = {}; ///< what went wrong, with what was tried; empty if it converged
};

/// Newton's method, Algorithm 1, with a Krylov method for its linear systems: Newton-CG and Newton-GMRES of the paper, and better
/// ones. Ends at |F|/scale <= tolerance with the scale at the same u, which is tested before the first iteration, too: a guess is
/// a solution only if its own residual says so.
class NewtonKrylov {
public:
    explicit NewtonKrylov(const NewtonOptions& options) : options_(options) {}

    /// `u` holds the initial guess, then the solution (or the last iterate). Adds to `counts`.
    SolverResult solve(const NonlinearSystem& system, std::span<double> u, SolverCounts& counts);
    /// One linear solve to the tolerance instead, for systems that are linear; in cycles of the largest number of linear
    /// iterations.
    SolverResult solve_linear(const NonlinearSystem& system, std::span<double> u, SolverCounts& counts);

private:
    LinearResult find_step(const NonlinearSystem& system, std::span<const double> u, double tolerance, int iterations,
                           SolverCounts& counts);
    /// Moves u along the step; F at the new place is in f_. Returns false where no length will do.
    bool search(const NonlinearSystem& system, std::span<double> u, double before, SolverCounts& counts);
    double evaluate(const NonlinearSystem& system, std::span<const double> u, double length, SolverCounts& counts);

    NewtonOptions options_;
    Krylov krylov_;
    double scale_ = 1.0, trial_scale_ = 1.0; // of f_ and of trial_f_
    aligned_vector<double> f_, negative_f_, step_, velocity_change_, trial_, trial_f_, shifted_;
};

} // namespace ductile::mpm
