#pragma once
#include <ductile/ode/rk21.hpp>
#include <ductile/space/grid.hpp>

#include <optional>

namespace ductile::quasistatic {

/// Adaptive global steps by the size of the projection (Sec. 7, Table 2), in natural units.
struct AdaptiveStepOptions {
    double tolerance = 0.001;     ///< F_Q: Q* is held near F_Q h^2 (h^2 = dx dy), Q* as in Projection::apply
    double largest_growth = 2.0;  ///< F_max
    double safety = 0.9;          ///< F_s
    double smallest_step = 1e-6;  ///< Delta t_min
    double largest_step = 1000.0; ///< Delta t_max
    double first_step = 10.0;     ///< Delta t_init
};

/// Factors F_RK2(1) of the tolerances of the pointwise integration.
struct PointwiseTolerance {
    double fixed_factor = 1e-7;   ///< fixed steps: tolerances F dt^2 (Sec. 8.1)
    double adaptive_factor = 0.1; ///< adaptive steps: tolerances F h^2 (Sec. 8.2)
};

/// Why a step has its length; shown in the progress line.
enum class StepLimit { fixed, projection, growth, largest, smallest, output };
[[nodiscard]] const char* to_string(StepLimit limit);

/// Chooses the steps of a run: fixed or by Q*; every step is cut so that it lands exactly on the next target time
/// (snapshots, knots of the wall history, the end).
class StepControl {
public:
    /// Fixed steps of length dt.
    StepControl(const Grid& grid, double fixed_step, const PointwiseTolerance& pointwise);
    /// Adaptive steps.
    StepControl(const Grid& grid, const AdaptiveStepOptions& adaptive, const PointwiseTolerance& pointwise);

    struct Step {
        double dt = 0.0;
        double end = 0.0;   ///< time after the step: the target itself where the step lands on it
        bool lands = false; ///< the step ends on the target
        StepLimit limit = StepLimit::fixed;
    };
    /// The next step from `time` towards `target` > time.
    [[nodiscard]] Step next(double time, double target) const;
    /// Takes the projection measure of the step just made, Eq. (56).
    void update(const Step& step, double projection_measure);

    /// Tolerances A and R of the pointwise integration for a step of length dt, Secs. 8.1, 8.2 (F h^2/L^2 when adaptive).
    [[nodiscard]] Rk21Options pointwise_options(double dt) const;

    /// Q*_tol = F_Q h^2, or nothing with fixed steps.
    [[nodiscard]] std::optional<double> projection_tolerance() const;
    /// The planned step: what a checkpoint must store.
    [[nodiscard]] double planned_step() const { return planned_; }
    /// Goes on with the step a checkpoint planned, within the bounds of this run. Fixed steps keep their own length: a run may
    /// be continued with other options than it was started with.
    void restore_planned_step(double dt);

private:
    double cell_area_;
    std::optional<AdaptiveStepOptions> adaptive_;
    PointwiseTolerance pointwise_;
    double planned_;
    StepLimit limit_ = StepLimit::fixed;
};

} // namespace ductile::quasistatic
