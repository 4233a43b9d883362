#pragma once
#include <ductile/sundials/initial_value.hpp>

#include <cstddef>
#include <memory>
#include <span>

namespace ductile::sundials {

/// Linear multistep formulas, of an order and a step that follow the error.
enum class CvodeMethod {
    bdf,   ///< backward differentiation, orders 1 to 5: for stiff systems
    adams, ///< Adams-Moulton, orders 1 to 12
};

struct CvodeOptions {
    CvodeMethod method = CvodeMethod::bdf;
    /// Bound of the local error, relative to each component; above 0.
    double relative_tolerance = 1e-10;
    /// The same, absolute, above 0; the same for all components: scale them to similar sizes.
    double absolute_tolerance = 1e-12;
    /// Steps of one call of integrate() after which it gives up.
    long long largest_step_count = 1'000'000;
};

/// A small system of ordinary differential equations, integrated by SUNDIALS (CVODE, Newton's method with a dense matrix of
/// difference quotients): an implicit reference beside the explicit ErkIntegrator. One object belongs to one thread.
/// Throws RunError when SUNDIALS gives up, with its own words.
class CvodeIntegrator {
public:
    CvodeIntegrator(RightHandSide f, std::size_t components, const CvodeOptions& options = {});
    ~CvodeIntegrator();
    CvodeIntegrator(CvodeIntegrator&&) noexcept;
    CvodeIntegrator& operator=(CvodeIntegrator&&) noexcept;

    /// Takes `y` from t0 to t1 > t0, starting at order one: nothing is carried over from an earlier call. `y` is unchanged when
    /// it throws.
    void integrate(std::span<double> y, double t0, double t1, const StepObserver& observe = {});

    [[nodiscard]] Counts counts() const;

private:
    class Memory;
    std::unique_ptr<Memory> memory_;
};

} // namespace ductile::sundials
