// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace ductile::sundials {

/// F(u) = 0 for KINSOL. Functions may throw: the exception comes out of KinsolSolver::solve.
struct KinsolSystem {
    std::size_t size = 0;
    std::function<void(std::span<const double> u, std::span<double> f)> residual = {};
    /// Called at each Newton iterate before the functions below are used there.
    std::function<void(std::span<const double> u)> linearise = {};
    /// J s; empty: KINSOL takes a difference quotient.
    std::function<void(std::span<const double> s, std::span<double> js)> jacobian_times = {};
    /// z becomes P^-1 z, an approximation of J^-1 z; empty: none.
    std::function<void(std::span<double> z)> precondition = {};
};

enum class KrylovSolver { gmres, flexible_gmres, bicgstab, conjugate_gradients };

struct KinsolOptions {
    KrylovSolver linear = KrylovSolver::gmres;
    int krylov_vectors = 50;      ///< or iterations, for those that keep no basis
    bool eisenstat_walker = true; ///< forcing by KINSOL's second choice with gamma = 0.9, alpha = 2; else linear_tolerance
    double linear_tolerance = 0.1;
    double difference_increment = 1e-7; ///< relative error of F that the difference quotient assumes is its square
    int largest_iterations = 50;
};

struct KinsolCounts {
    long long iterations = 0, linear_iterations = 0, residual_evaluations = 0, jacobian_products = 0, backtracks = 0;
    long long linear_failures = 0; ///< linear solves that ended short of their tolerance
};

/// How a solve ended.
struct KinsolResult {
    bool converged = false;
    std::string failure = {}; ///< if not: what happened, what was tried, what to change
    KinsolCounts counts = {}; ///< of this solve
};

/// Newton-Krylov with line search by SUNDIALS (KINSOL). Its memory is kept from call to call as long as the size stays.
class KinsolSolver {
public:
    explicit KinsolSolver(const KinsolOptions& options);
    ~KinsolSolver();
    KinsolSolver(KinsolSolver&&) noexcept;
    KinsolSolver& operator=(KinsolSolver&&) noexcept;

    /// Solves until max |F_i| <= tolerance; `u` holds the initial guess, then the solution, or the last iterate. `typical_u` is
    /// the size of a component of u, which KINSOL measures steps by. Throws RunError when KINSOL cannot be set up.
    KinsolResult solve(const KinsolSystem& system, std::span<double> u, double tolerance, double typical_u);

private:
    class Memory;
    KinsolOptions options_;
    std::unique_ptr<Memory> memory_;
};

} // namespace ductile::sundials
