// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/sundials/initial_value.hpp>

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace ductile::sundials {

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

/// ARKODE's own pairs that keep their order in every release of SUNDIALS. (Releases before 6.7 take some others for
/// first-same-as-last which are not.)
enum class ErkMethod {
    bogacki_shampine, ///< 3(2)
    zonneveld,        ///< 4(3)
    cash_karp,        ///< 5(4)
    dormand_prince,   ///< 5(4)
};

/// Who chooses the steps of adaptive runs.
enum class StepControl {
    arkode, ///< its PI controller, with the factors that are its defaults
    /// Lu & Rycroft, App. B: E by (B.2) with the scales s_i = A + R |y0_i| (ARKODE has no others: they are those of (B.1) but for
    /// the maximum), h_new = h min(3, max(1/3, 0.9 E^(-1/order))) as in (B.4), no growth right after a rejection. The first step
    /// is the whole interval if first_step is 0.
    lu_rycroft,
};

struct ErkOptions {
    /// Bound of the local error, relative to each component (adaptive steps).
    double relative_tolerance = 1e-10;
    /// The same, absolute; the same for all components: scale them to similar sizes.
    double absolute_tolerance = 1e-12;
    ErkMethod method = ErkMethod::dormand_prince;
    /// A pair that takes the place of `method`.
    std::optional<ErkTable> table = {};
    StepControl step_control = StepControl::arkode;
    /// Above zero: equal steps without error control, of this length but for what makes a whole number of them fill the interval.
    double fixed_step = 0.0;
    /// First step of adaptive runs; 0 leaves it to the step control.
    double first_step = 0.0;
    /// Longest step of adaptive runs; 0 means none. Where the solution is a polynomial the error test sees nothing, and a step
    /// may jump over the beginning of what matters.
    double largest_step = 0.0;
    /// Steps of one call of integrate() after which it gives up.
    long long largest_step_count = 1'000'000;
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
    /// ARKODE's stop time. What `dense` asks for comes from cubics through both ends of a step and their rates. `y` is unchanged
    /// when it throws. May be called again, on the same interval or another.
    void integrate(std::span<double> y, double t0, double t1, const StepObserver& observe = {}, const DenseOutput& dense = {});

    [[nodiscard]] Counts counts() const;

private:
    class Memory;
    std::unique_ptr<Memory> memory_;
};

} // namespace ductile::sundials
