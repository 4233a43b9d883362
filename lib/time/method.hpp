// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/function_ref.hpp>
#include <ductile/time/system.hpp>

#include <array>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace ductile::time {

/// A step from y_n: what is given, and the room for what comes of it.
template <class Vector> struct Step {
    Vector& start;
    Vector& start_rate; ///< complete
    Vector& next;       ///< receives y_{n+1}
    Vector& next_rate;  ///< receives its complete rate, evaluated at the end of the step
    double dt = 0.0;
    double relaxation = 0.0;                                 ///< the fastest rate of decay at y_n, where stiff parts decay
    std::span<const double> memory;                          ///< a value of each of Method::memory()
    std::span<const double> within = {};                     ///< fractions of the step, rising, that
    FunctionRef<void(double fraction, Vector& y)> show = {}; ///< is called for, on the way, by a method that does not interpolate
};

/// The cubic in time through both ends of a step and their rates: fourth order within a step. `fraction` of the way.
template <class Vector> [[nodiscard]] std::array<Term<Vector>, 4> cubic_within(const Step<Vector>& step, double fraction) {
    const double x = fraction, rest = 1.0 - fraction;
    return {{{&step.start, (1.0 + 2.0 * x) * rest * rest},
             {&step.start_rate, step.dt * x * rest * rest},
             {&step.next, x * x * (1.0 + 2.0 * rest)},
             {&step.next_rate, -step.dt * x * x * rest}}};
}

/// Steps that a method takes inside of one of ours.
struct InnerCounts {
    long long steps = 0, rejected = 0;
};

/// A one-step method with an estimate of its error. What it remembers from step to step is a few numbers that belong to the state
/// and live with it; otherwise steps leave no trace in the method.
template <class Vector> class Method {
public:
    virtual ~Method() = default;

    /// Makes the step that System::begin_step() has begun. Returns the norm of its estimated error. The last evaluation is that
    /// of next_rate.
    [[nodiscard]] virtual double advance(const Step<Vector>& step) = 0;

    /// Whether interpolate() tells what is within a step. Otherwise advance() calls Step::show: a step that is a whole
    /// integration by another library may be too long for an interpolant.
    [[nodiscard]] virtual bool interpolates() const { return false; }
    /// y at this fraction of the step that advance() has just made, as accurate as its end.
    virtual void interpolate(const Step<Vector>& step, double fraction, Vector& y) const {
        (void)step, (void)fraction, (void)y;
        throw std::logic_error("this method does not interpolate");
    }

    /// Names of the numbers that it remembers; they begin as zeros.
    [[nodiscard]] virtual std::vector<std::string> memory() const { return {}; }
    /// A step with this estimated error has become the state, where flow now decays at `relaxation`.
    virtual void accept(double dt, double error, double relaxation, std::span<double> memory) const {
        (void)dt, (void)error, (void)relaxation, (void)memory;
    }
    /// Accepted steps by the method that took them, where there is more than one.
    [[nodiscard]] virtual std::vector<std::pair<std::string, long long>> steps_by_method(std::span<const double>) const {
        return {};
    }

    /// The longest step that is stable when the system's fastest decay has the rate `relaxation`.
    [[nodiscard]] virtual double relaxation_step(double relaxation, std::span<const double> memory) const {
        (void)relaxation, (void)memory;
        return std::numeric_limits<double>::infinity();
    }
    /// The longest step times the largest rate |v|/h of stable upwind advection. The shortest wave of the one-sided differences
    /// of Lu & Rycroft's Eq. (4) decays at 4 times that rate.
    [[nodiscard]] virtual double courant_number(std::span<const double> memory) const {
        (void)memory;
        return std::numeric_limits<double>::infinity();
    }
    /// Right-hand sides of a step of length dt, where it may be that long.
    [[nodiscard]] virtual double evaluations(double dt, double relaxation) const {
        (void)dt, (void)relaxation;
        return 1.0;
    }
    [[nodiscard]] virtual InnerCounts inner_counts() const { return {}; }
    /// Number of states that the method itself keeps.
    [[nodiscard]] virtual int buffers() const = 0;
};

} // namespace ductile::time
