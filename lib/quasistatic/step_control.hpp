// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/quasistatic/time_stepper.hpp>
#include <ductile/space/grid.hpp>

#include <limits>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace ductile::quasistatic {

/// Steps of one length, in natural units.
struct FixedSteps {
    double dt = 0.0;
};

/// Steps by the size of the projection (Sec. 7, Table 2), in natural units.
struct ProjectionSteps {
    double tolerance = 0.001;     ///< F_Q: Q* is held near F_Q h^2 (h^2 = dx dy), Q* as in Projection::apply
    double largest_growth = 2.0;  ///< F_max
    double safety = 0.9;          ///< F_s
    double smallest_step = 1e-6;  ///< Delta t_min
    double largest_step = 1000.0; ///< Delta t_max
    double first_step = 10.0;     ///< Delta t_init
    /// A step whose Q* exceeds this many times its tolerance is repeated shorter; infinity: none is, as in the paper.
    double largest_excess = std::numeric_limits<double>::infinity();
};

/// Steps by the estimated error of the whole step: a PI controller (Gustafsson) with rejection, in natural units.
struct ErrorSteps {
    double tolerance = 1e-4; ///< of the error norm of one step: sigma/s_Y and chi/chi_inf
    int order = 3;           ///< the estimate falls with this power of dt
    double safety = 0.9;
    double largest_growth = 5.0;
    double smallest_shrink = 0.2;
    double smallest_step = 1e-6; ///< a rejected step below it ends the run
};

/// Steps that are whole integrations by another library, which chooses its own within: each as long as the time_scale() of the
/// state that the run begins with.
struct OwnSteps {};

/// Why a step has its length; shown in the progress line.
enum class StepLimit { fixed, projection, accuracy, relaxation, advection, growth, largest, smallest, yield, output };
[[nodiscard]] const char* to_string(StepLimit limit);

/// Chooses the steps of a run; every step is cut so that it lands exactly on the next target time (snapshots, knots of the wall
/// history, the end).
class StepControl {
public:
    using Policy = std::variant<FixedSteps, ProjectionSteps, ErrorSteps, OwnSteps>;
    StepControl(const Grid& grid, const Policy& policy);

    /// Plans the first step of a run from TimeStepper::time_scale(): steps by the error start with the step after which a method
    /// of their order may be off by the tolerance; where it is too long, rejection cuts it. OwnSteps{} stay at it.
    void start(double time_scale);

    struct Step {
        double dt = 0.0;
        double end = 0.0;   ///< time after the step: the target itself where the step lands on it
        bool lands = false; ///< the step ends on the target
        StepLimit limit = StepLimit::fixed;
    };
    /// The next step from `time` towards `target` > time. Throws RunError where no step would ever get there: it is so short that
    /// time + dt is time, or (fixed steps apart) a thousand in a row were planned shorter than 1e-8 of the way to the target.
    [[nodiscard]] Step next(double time, double target);

    /// The step as the stepper limits it (TimeStepper::limit_step) to dt <= step.dt, from `time`.
    [[nodiscard]] static Step shortened(const Step& step, double time, double dt);

    /// Judges an attempted step and plans the next. Returns whether the step is accepted.
    [[nodiscard]] bool judge(const Step& step, const StepAttempt& attempt);
    /// An attempt ended in values that are not finite: plans a shorter one. Returns false when the policy knows no shorter step.
    [[nodiscard]] bool retry_shorter(const Step& step);

    [[nodiscard]] bool steps_are_own() const { return std::holds_alternative<OwnSteps>(policy_); }
    /// The numbers that a checkpoint must hold; they mean nothing to a control of another identity.
    [[nodiscard]] const char* identity() const;
    [[nodiscard]] std::vector<std::pair<std::string, double*>> hidden_numbers();
    /// To be called once they are restored: the plan is kept within the bounds of this run, which may differ.
    void resume();
    [[nodiscard]] double planned_step() const { return planned_; }

private:
    [[nodiscard]] bool judge_by_projection(const ProjectionSteps& policy, const Step& step, double measure);
    [[nodiscard]] bool judge_by_error(const ErrorSteps& policy, const Step& step, const StepAttempt& attempt);

    double cell_area_;
    Policy policy_;
    double planned_;
    int short_plans_ = 0;         ///< in a row: shorter than 1e-8 of the way
    double previous_error_ = 1.0; ///< of the last accepted step, in units of the tolerance
    StepLimit limit_ = StepLimit::fixed;
};

} // namespace ductile::quasistatic
