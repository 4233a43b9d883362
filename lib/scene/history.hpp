// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/error.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace ductile {

/// A velocity in the plane.
struct Velocity {
    double u = 0.0; ///< in x
    double v = 0.0; ///< in y

    bool operator==(const Velocity&) const = default;
};
[[nodiscard]] inline Velocity operator+(const Velocity& a, const Velocity& b) { return {a.u + b.u, a.v + b.v}; }
[[nodiscard]] inline Velocity operator-(const Velocity& a, const Velocity& b) { return {a.u - b.u, a.v - b.v}; }
[[nodiscard]] inline Velocity operator*(double factor, const Velocity& a) { return {factor * a.u, factor * a.v}; }
[[nodiscard]] inline Velocity operator/(const Velocity& a, double divisor) { return {a.u / divisor, a.v / divisor}; }
[[nodiscard]] inline bool is_finite(const Velocity& a) { return std::isfinite(a.u) && std::isfinite(a.v); }
[[nodiscard]] inline bool is_finite(double a) { return std::isfinite(a); }

/// What changes with time as prescribed: linear between knots, constant before the first and after the last. Two knots at one
/// time are a jump. Any consistent units; `Value` has the operators and is_finite() above.
template <class Value> class History {
public:
    struct Knot {
        double time = 0.0;
        Value value;

        bool operator==(const Knot&) const = default;
    };

    /// One value, always. Throws InputError unless it is finite.
    History(const Value& constant = {}) : History(std::vector<Knot>{{0.0, constant}}) {}
    /// Throws InputError when there is no knot, a number is not finite, times decrease, or three knots share one time.
    explicit History(std::vector<Knot> knots) : knots_(std::move(knots)) {
        if (knots_.empty())
            throw InputError("the history has no knot: give at least one time and value");
        for (std::size_t k = 0; k < knots_.size(); ++k) {
            const double time = knots_[k].time;
            if (!std::isfinite(time) || !is_finite(knots_[k].value))
                throw InputError(fmt::format("history, knot {}: time and value must be finite", k + 1));
            if (k > 0 && time < knots_[k - 1].time)
                throw InputError(
                    fmt::format("history, knot {}: time {} lies before the previous knot's {}", k + 1, time, knots_[k - 1].time));
            if (k > 1 && time == knots_[k - 2].time)
                throw InputError(fmt::format("history: three knots at time {}; two describe a jump", time));
        }
    }

    /// The mean over [from, to], to >= from: the exact integral divided by the length; after(from) where there is none.
    [[nodiscard]] Value mean(double from, double to) const {
        Value value = after(from);
        if (is_constant() || !(to > from) || next_knot(from) == std::numeric_limits<double>::infinity())
            return value; // to the last bit, so that walls at rest in the frame of the step need no work

        // integral over the pieces between knots; a knot at `to` closes the last piece from its left side
        Value sum{};
        double time = from;
        const auto add = [&](double end, const Value& at_end) {
            sum = sum + (0.5 * (end - time)) * (value + at_end);
            time = end;
            value = at_end; // at a jump the second knot follows at once
        };
        for (const Knot& knot : knots_)
            if (knot.time > from && time < to)
                add(std::min(knot.time, to), knot.time <= to ? knot.value : interpolate({time, value}, knot, to));
        if (time < to)
            add(to, value);
        return sum / (to - from);
    }
    /// Just after `time`.
    [[nodiscard]] Value after(double time) const { return at(later(time), time); }
    /// Just before `time`: differs from after() at a jump only.
    [[nodiscard]] Value before(double time) const { return at(not_earlier(time), time); }
    /// The derivative just after `time`.
    [[nodiscard]] Value slope(double time) const { return slope_at(later(time)); }
    /// Just before `time`: differs from slope() at a knot only.
    [[nodiscard]] Value slope_before(double time) const { return slope_at(not_earlier(time)); }
    /// Of a velocity, from time 0 to `time`; none before.
    [[nodiscard]] Value displacement(double time) const { return time <= 0.0 ? Value{} : time * mean(0.0, time); }
    /// The smallest knot time that lies after `time`, infinity if there is none: steps land on it.
    [[nodiscard]] double next_knot(double time) const {
        const auto next = later(time);
        return next == knots_.end() ? std::numeric_limits<double>::infinity() : next->time;
    }

    bool operator==(const History&) const = default;
    [[nodiscard]] const std::vector<Knot>& knots() const { return knots_; }
    [[nodiscard]] bool is_constant() const { return knots_.size() == 1; }
    /// The largest of a measure of the value at the knots from `time` on, and there.
    template <class Measure> [[nodiscard]] double largest(Measure measure, double time) const {
        double most = measure(after(time));
        for (const Knot& knot : knots_)
            if (knot.time > time)
                most = std::max(most, measure(knot.value));
        return most;
    }

private:
    using Place = typename std::vector<Knot>::const_iterator;

    static Value interpolate(const Knot& a, const Knot& b, double time) {
        return a.value + ((time - a.time) / (b.time - a.time)) * (b.value - a.value);
    }
    [[nodiscard]] Place later(double time) const { return std::ranges::upper_bound(knots_, time, {}, &Knot::time); }
    [[nodiscard]] Place not_earlier(double time) const { return std::ranges::lower_bound(knots_, time, {}, &Knot::time); }
    [[nodiscard]] Value slope_at(Place next) const {
        if (next == knots_.begin() || next == knots_.end())
            return {};
        return ((next->value - (next - 1)->value)) / (next->time - (next - 1)->time);
    }
    [[nodiscard]] Value at(Place next, double time) const {
        if (next == knots_.begin())
            return knots_.front().value;
        if (next == knots_.end())
            return knots_.back().value;
        return interpolate(*(next - 1), *next, time);
    }

    std::vector<Knot> knots_;
};

} // namespace ductile
