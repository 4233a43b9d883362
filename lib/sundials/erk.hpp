#pragma once
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace ductile::sundials {

/// dy/dt = f(t, y): writes the rate of `y` at time `t` into `rate`, which has as many components. It may throw: the exception
/// comes out of ErkIntegrator::integrate. A rate that is not finite ends the integration.
using RightHandSide = std::function<void(double t, std::span<const double> y, std::span<double> rate)>;

/// An explicit Runge-Kutta pair: k_i = f(t + c_i h, y + h sum_j a_ij k_j), y_new = y + h sum_i b_i k_i, and the embedded solution
/// with the weights d, whose difference from y_new is the estimate of the error.
struct ErkTable {
    int order = 0, embedded_order = 0;
    std::vector<double> c = {}; ///< one a stage
    std::vector<double> a = {}; ///< stages x stages, row after row, strictly lower triangular
    std::vector<double> b = {}, d = {};
};

/// Ralston's method as the first-same-as-last RK2(1) pair of Lu & Rycroft, Table A.4.
[[nodiscard]] ErkTable paper_rk21();

struct ErkOptions {
    /// Bound of the local error, relative to each component (adaptive steps).
    double relative_tolerance = 1e-10;
    /// The same, absolute; the same for all components: scale them to similar sizes.
    double absolute_tolerance = 1e-12;
    /// The method; none stands for Dormand and Prince's 5(4), which is sound in every release of SUNDIALS.
    std::optional<ErkTable> table = {};
    /// Above zero: equal steps without error control, of this length but for what makes a whole number of them fill the interval.
    double fixed_step = 0.0;
    /// First step of adaptive runs; 0 leaves it to ARKODE.
    double first_step = 0.0;
    /// Longest step of adaptive runs; 0 means none. Where the solution is a polynomial the error test sees nothing, and a step
    /// may jump over the beginning of what matters.
    double largest_step = 0.0;
    /// Steps of one call of integrate() after which it gives up.
    long long largest_step_count = 1'000'000;
};

/// What the integrator did since its construction.
struct ErkCounts {
    long long steps = 0;       ///< accepted
    long long rejected = 0;    ///< by the error test
    long long evaluations = 0; ///< of the right-hand side
};

/// A small system of ordinary differential equations, integrated by SUNDIALS (ARKODE's ERKStep): the independent reference of our
/// own integrators. One object belongs to one thread. Throws RunError when SUNDIALS gives up, with its own words.
class ErkIntegrator {
public:
    ErkIntegrator(RightHandSide f, std::size_t components, const ErkOptions& options = {});
    ~ErkIntegrator();
    ErkIntegrator(ErkIntegrator&&) noexcept;
    ErkIntegrator& operator=(ErkIntegrator&&) noexcept;

    /// Takes `y` from t0 to t1 > t0. Fixed steps deliver exactly what the method computed, adaptive ones land on t1 through
    /// ARKODE's stop time. `y` is unchanged when it throws. May be called again, on the same interval or another.
    void integrate(std::span<double> y, double t0, double t1);

    [[nodiscard]] ErkCounts counts() const;

private:
    class Memory;
    std::unique_ptr<Memory> memory_;
};

} // namespace ductile::sundials
