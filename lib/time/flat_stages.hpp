// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/error.hpp>
#include <ductile/sundials/initial_value.hpp>
#include <ductile/time/method.hpp>

#include <algorithm>
#include <array>
#include <functional>
#include <limits>

namespace ductile::time {

/// How a method of SUNDIALS takes its own steps within one of ours.
struct InnerSteps {
    double tolerance = 1e-4; ///< of the error of one of its steps, in the norm of the system
    bool fixed = false;      ///< one inner step a step, without error control
    /// Called before every right-hand side; what it throws ends the step. Steps may last.
    std::function<void()> poll = [] {};
};

/// What the methods of SUNDIALS share: the state as one flat vector, its rate, and the end of a step. A step is a whole
/// integration by SUNDIALS, time running from 0 to dt, and nothing is carried over from one to the next.
template <class Vector> class FlatStages {
public:
    FlatStages(System<Vector>& system, InnerSteps steps)
        : system_(system), steps_(std::move(steps)), stage_(system.make()), stage_rate_(system.make()),
          values_(system.components()) {}

    /// The start of a step, flat: to be integrated in place.
    [[nodiscard]] std::span<double> begin(const Step<Vector>& step) {
        start_rate_ = &step.start_rate;
        system_.pack(step.start, values_);
        return values_;
    }

    /// What the step wants to be shown on the way.
    [[nodiscard]] sundials::DenseOutput dense(const Step<Vector>& step) {
        times_.clear();
        for (const double fraction : step.within)
            times_.push_back(fraction * step.dt);
        const auto show = [this, &step, n = std::size_t{0}](double, std::span<const double> y) mutable {
            system_.unpack(y.first(values_.size()), stage_);
            step.show(step.within[n++], stage_);
        };
        return {times_, show};
    }

    /// dy/dt; not finite where its parts are not, so that SUNDIALS tries a shorter step.
    void rate(double t, std::span<const double> y, std::span<double> rate) {
        if (t == 0.0)
            system_.pack(*start_rate_, rate);
        else if (evaluate(t, y))
            system_.pack(stage_rate_, rate);
        else
            std::ranges::fill(rate, std::numeric_limits<double>::quiet_NaN());
    }

    /// Leaves the state y in stage() and its complete rate in stage_rate(). Returns false where that is not finite.
    [[nodiscard]] bool evaluate(double t, std::span<const double> y) {
        poll();
        system_.unpack(y, stage_);
        try {
            system_.close(system_.evaluate(stage_, t / system_.step_length(), stage_rate_));
        } catch (const RunError&) {
            return false;
        }
        return true;
    }

    /// Evaluates the rate of the new state, which is in step.next, and returns the norm of the error: what the error control of
    /// SUNDIALS allows, or, without it, that of the trapezoidal rule, which bounds those of higher order.
    [[nodiscard]] double finish(const Step<Vector>& step) {
        system_.close(system_.evaluate(step.next, 1.0, step.next_rate));
        if (!steps_.fixed)
            return steps_.tolerance;
        using Term = Term<Vector>;
        return system_.norm(std::array{Term{&step.next, 1.0}, Term{&step.start, -1.0}, Term{&step.start_rate, -0.5 * step.dt},
                                       Term{&step.next_rate, -0.5 * step.dt}});
    }

    void poll() const { steps_.poll(); }
    /// The absolute tolerance of every component that bounds norm() by the tolerance.
    [[nodiscard]] double component_tolerance() const { return steps_.tolerance / system_.norm_of_components(); }
    [[nodiscard]] const Vector& start_rate() const { return *start_rate_; }
    [[nodiscard]] Vector& stage() { return stage_; }
    [[nodiscard]] Vector& stage_rate() { return stage_rate_; }
    [[nodiscard]] std::size_t size() const { return values_.size(); }

    /// Vectors that SUNDIALS keeps, about: of ERKStep its stages, of the others histories and bases.
    static constexpr int buffers = 24;

private:
    System<Vector>& system_;
    InnerSteps steps_;
    Vector stage_, stage_rate_;
    const Vector* start_rate_ = nullptr; ///< of the current step
    std::vector<double> values_, times_;
};

} // namespace ductile::time
