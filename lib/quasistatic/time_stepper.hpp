#pragma once
#include <ductile/quasistatic/scene.hpp>
#include <ductile/quasistatic/schemes.hpp>

#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace ductile::quasistatic {

/// What an attempted step found.
struct StepAttempt {
    /// How good the step was, for the step control: Q* of the projection schemes (see Projection::apply), the estimated error of
    /// the index-reduced ones (largest of the norms (59) of sigma/s_Y and chi/chi_inf).
    double measure = 0.0;
    /// Estimated error of the step in sigma/s_Y and chi/chi_inf, for AccuracyWatch: `measure` of the index-reduced schemes, see
    /// ProjectionStepper for the others.
    double error = 0.0;
    /// Longest next steps that are stable by the relaxation rate of the plastic flow and by advection, where the method knows.
    double relaxation_step = std::numeric_limits<double>::infinity();
    double advection_step = std::numeric_limits<double>::infinity();
};

/// Work done since construction.
struct StepperCounts {
    long long elliptic_solves = 0;
    long long evaluations = 0;        ///< right-hand sides of the method of lines
    long long pointwise_substeps = 0; ///< accepted substeps of the RK2(1) pair, summed over plastic cells
    long long rejected_substeps = 0;
    long long inner_steps = 0; ///< of SUNDIALS
    long long rejected_inner_steps = 0;
};

/// Wall seconds by phase since construction, in the order of printing.
using PhaseSeconds = std::vector<std::pair<std::string, double>>;

/// A time integrator of the quasi-static system. attempt() leaves state() as it is; accept() takes the attempted step.
class TimeStepper {
public:
    virtual ~TimeStepper() = default;

    /// Time in which the state would change by the units of its error norm at the rate it starts with; infinity where the scheme
    /// does not know rates. For the choice of a first step.
    [[nodiscard]] virtual double time_scale() { return std::numeric_limits<double>::infinity(); }
    /// A step of length dt or a shorter one: where all cells are elastic and the first is about to yield, schemes of higher order
    /// end the step at that moment, because no Runge-Kutta method keeps its order across the corner.
    [[nodiscard]] virtual double limit_step(double dt) { return dt; }
    /// Tries a step of length dt > 0 to the time `end` (which may differ from the sum by round-off: steps land on targets).
    /// Throws RunError (where, when, what to change) when the result is not finite; state() is intact then, and another attempt
    /// may follow.
    [[nodiscard]] virtual StepAttempt attempt(double dt, double end) = 0;
    virtual void accept() = 0;

    [[nodiscard]] virtual const State& state() const = 0;
    [[nodiscard]] virtual StepperCounts counts() const = 0;
    [[nodiscard]] virtual PhaseSeconds phase_seconds() const = 0;
    /// Bytes of state, buffers and solver.
    [[nodiscard]] virtual std::size_t memory_bytes() const = 0;

    /// Steps by the methods that took them, where a scheme has more than one.
    [[nodiscard]] virtual std::vector<std::pair<Scheme, long long>> steps_by_scheme() const { return {}; }

    /// Hidden values of one scheme are nothing to another.
    [[nodiscard]] virtual Scheme scheme() const = 0;
    /// The fields besides state() that a checkpoint must hold so that a restarted run goes on bitwise, by name.
    [[nodiscard]] virtual std::vector<std::pair<std::string, Field*>> hidden_fields() = 0;
    /// The numbers besides them.
    [[nodiscard]] virtual std::vector<std::pair<std::string, double*>> hidden_numbers() = 0;
    /// To be called once hidden fields and numbers are restored.
    virtual void resume() = 0;
};

} // namespace ductile::quasistatic
