// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/sundials/initial_value.hpp>

#include <cstddef>
#include <functional>
#include <memory>
#include <span>

namespace ductile::sundials {

/// A system of differential-algebraic equations of index 1, F(t, y, y') = 0. The functions may throw: the exception comes out of
/// IdaIntegrator::integrate.
struct DifferentialAlgebraicSystem {
    std::size_t components = 0;
    /// Components 0 .. differential - 1 have a derivative in F, the others are algebraic and stay out of the error test.
    std::size_t differential = 0;
    /// Writes F(t, y, rate) into `residual`.
    std::function<void(double t, std::span<const double> y, std::span<const double> rate, std::span<double> residual)> residual;
    /// Solves P z = r for an approximation P of dF/dy + derivative_factor dF/dy'.
    std::function<void(double derivative_factor, std::span<const double> r, std::span<double> z)> precondition;
};

struct IdaOptions {
    /// Bound of the local error, absolute and the same for all components: scale them to similar sizes.
    double absolute_tolerance = 1e-6;
    /// Steps of one call of integrate() after which it gives up.
    long long largest_step_count = 100'000;
};

/// A large system of differential-algebraic equations, integrated by SUNDIALS (IDA: backward differentiation of orders 1 to 5,
/// Newton's method with GMRES). One object belongs to one thread. Throws RunError when SUNDIALS gives up, with its own words.
class IdaIntegrator {
public:
    IdaIntegrator(DifferentialAlgebraicSystem system, const IdaOptions& options = {});
    ~IdaIntegrator();

    /// Takes `y` and its derivative `rate`, which must satisfy the system at t0, to t1 > t0, starting at order one. Both are
    /// unchanged when it throws.
    void integrate(std::span<double> y, std::span<double> rate, double t0, double t1, const DenseOutput& dense = {});

    [[nodiscard]] Counts counts() const; ///< evaluations: of the residual

private:
    class Memory;
    std::unique_ptr<Memory> memory_;
};

} // namespace ductile::sundials
