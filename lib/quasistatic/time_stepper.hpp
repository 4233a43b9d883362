// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/function_ref.hpp>
#include <ductile/base/timer.hpp>
#include <ductile/quasistatic/state.hpp>

#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ductile::quasistatic {

/// What an attempted step found.
struct StepAttempt {
    bool accepted = false; ///< as judged
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

/// Times within a step, rising, and what to do with the state at each: in equilibrium, as accurate as the end of the step, its
/// memory not filled in.
struct Within {
    std::span<const double> times = {};
    FunctionRef<void(const State&)> show = {}; ///< may throw, as a Judge may
};

/// Whether an attempted step is good enough to be kept. May throw: the state is then as it was.
using Judge = std::function<bool(const StepAttempt&)>;

/// A time integrator of the quasi-static system. The state is the caller's, and all that steps leave behind is in it: one stepper
/// may serve many states in turn.
class TimeStepper {
public:
    virtual ~TimeStepper() = default;

    /// The name of its scheme, see schemes().
    [[nodiscard]] virtual std::string_view scheme() const = 0;
    /// What it steps on.
    [[nodiscard]] virtual Space& space() const = 0;
    /// Lays out the memory of a state that has none of this scheme, where another's is thrown away.
    virtual void adopt(State& state) const = 0;

    /// Time in which the state would change by the units of its error norm at the rate it starts with; infinity where the scheme
    /// does not know rates. For the choice of a first step. This and the next two adopt the state, and complete what its memory
    /// lacks: rate and velocity at its time, which jump where the velocity of the walls does.
    [[nodiscard]] virtual double time_scale(State& state) {
        (void)state;
        return std::numeric_limits<double>::infinity();
    }
    /// A step of length dt or a shorter one: where all cells are elastic and the first is about to yield, schemes of higher order
    /// end the step at that moment, because no Runge-Kutta method keeps its order across the corner.
    [[nodiscard]] virtual double limit_step(State& state, double dt) {
        (void)state;
        return dt;
    }
    /// Makes a step of length dt > 0 to the time `end` (which may differ from the sum by round-off: steps land on targets) and
    /// asks `judge`, because only a step that is made tells how good it is. If the answer is yes, `state` is at its end.
    /// Otherwise, and where this or `judge` throws, it is as it was, and another attempt may follow. Throws RunError (where,
    /// when, what to change) when the result is not finite.
    /// A step that is accepted has shown what is `within` it; that it was asked for changes no bit of the step.
    virtual StepAttempt attempt(State& state, double dt, double end, const Judge& judge, const Within& within = {}) = 0;
    /// Others have changed the fields of a state: what its memory says of their rates is found anew.
    virtual void renew(State& state) { (void)state; }

    /// Whether the velocity that a step leaves is that of its middle, and its mean to second order; otherwise it is that of its
    /// end.
    [[nodiscard]] virtual bool leaves_velocity_of_middle() const { return false; }
    /// What a step from `state`, at the end of one, is off by because it takes spin and advection of its start for those of all
    /// its length dt, over dt^2: [spin - advection]^2 y/2 in the norm (59). Zero where a scheme does not.
    [[nodiscard]] virtual double frozen_transport(State& state) {
        (void)state;
        return 0.0;
    }

    [[nodiscard]] virtual StepperCounts counts() const = 0;
    /// Since construction.
    [[nodiscard]] virtual PhaseSeconds phase_seconds() const = 0;
    /// Bytes of a state, buffers and space.
    [[nodiscard]] virtual std::size_t memory_bytes() const = 0;
    /// Steps by the methods that took them, where a scheme has more than one; of a state of its own.
    [[nodiscard]] virtual std::vector<std::pair<std::string, long long>> steps_by_method(const State& state) const {
        (void)state;
        return {};
    }
};

} // namespace ductile::quasistatic
