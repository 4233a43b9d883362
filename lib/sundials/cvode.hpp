// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/sundials/initial_value.hpp>

#include <cstddef>
#include <functional>
#include <memory>
#include <span>

namespace ductile::sundials {

/// Linear multistep formulas, of an order and a step that follow the error.
enum class CvodeMethod {
    bdf,   ///< backward differentiation, orders 1 to 5: for stiff systems
    adams, ///< Adams-Moulton, orders 1 to 12
};

/// How the implicit equation of a step is solved.
enum class CvodeSolver {
    dense,       ///< Newton's method with a dense matrix of difference quotients: for small systems
    krylov,      ///< Newton's method with GMRES and difference quotients along its directions: for large stiff systems
    fixed_point, ///< iteration with Anderson's acceleration: for large systems that are not stiff
};

/// Writes the correction of `y` that puts it back on the manifold where the solution stays. It may throw.
using StateProjection = std::function<void(double t, std::span<const double> y, std::span<double> correction)>;

struct CvodeOptions {
    CvodeMethod method = CvodeMethod::bdf;
    CvodeSolver solver = CvodeSolver::dense;
    /// With CvodeMethod::bdf: applied to every accepted step.
    StateProjection projection = {};
    /// Bound of the local error, relative to each component; above 0 with the dense solver.
    double relative_tolerance = 1e-10;
    /// The same, absolute, above 0; the same for all components: scale them to similar sizes.
    double absolute_tolerance = 1e-12;
    /// Steps of one call of integrate() after which it gives up.
    long long largest_step_count = 1'000'000;
};

/// A system of ordinary differential equations, integrated by SUNDIALS (CVODE): an implicit reference beside the explicit
/// ErkIntegrator. One object belongs to one thread.
/// Throws RunError when SUNDIALS gives up, with its own words.
class CvodeIntegrator {
public:
    CvodeIntegrator(RightHandSide f, std::size_t components, const CvodeOptions& options = {});
    ~CvodeIntegrator();
    CvodeIntegrator(CvodeIntegrator&&) noexcept;
    CvodeIntegrator& operator=(CvodeIntegrator&&) noexcept;

    /// Takes `y` from t0 to t1 > t0, starting at order one: nothing is carried over from an earlier call. `y` is unchanged when
    /// it throws.
    void integrate(std::span<double> y, double t0, double t1, const StepObserver& observe = {}, const DenseOutput& dense = {});

    [[nodiscard]] Counts counts() const;

private:
    class Memory;
    std::unique_ptr<Memory> memory_;
};

} // namespace ductile::sundials
