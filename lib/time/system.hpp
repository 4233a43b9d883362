// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <cstddef>
#include <span>

/// Time integrators that know no space: they combine states and rates that they can neither read nor write.
namespace ductile::time {

/// factor * vector, of a state or of a rate.
template <class Vector> struct Term {
    const Vector* vector = nullptr;
    double factor = 0.0;
};

/// A rate as evaluate() leaves it, which the next combination or close() completes.
template <class Vector> struct OpenRate { Vector* vector = nullptr; };

enum class Completed { kept, dropped }; ///< whether a combination leaves the complete rate behind

/// dy/dt = f(t, y) on states of any kind. A space that finds a part of the rate late (where a constraint holds, the part that its
/// multiplier makes) leaves it out of evaluate() and adds it in the sweep of the next combination; others have nothing to close.
///
/// Verbs are one call a sweep over all of a state. Whatever a vector holds besides its values, images or ghost rows, is the
/// business of the system.
template <class Vector> class System {
public:
    virtual ~System() = default;

    /// Every step begins with it: stages lie at the fractions 0 to 1 of the way from `begin` to `end`, and `end` may differ from
    /// begin + dt by round-off.
    void begin_step(double begin, double dt, double end) {
        begin_ = begin;
        length_ = dt;
        end_ = end;
    }
    [[nodiscard]] double step_length() const { return length_; }
    [[nodiscard]] double stage_time(double fraction) const { return fraction < 1.0 ? begin_ + fraction * length_ : end_; }

    /// A state of the system's shape, zero.
    [[nodiscard]] virtual Vector make() const = 0;
    /// Writes f at stage_time(fraction) and y to `rate`. Throws RunError where it is not finite, or leaves it so.
    virtual OpenRate<Vector> evaluate(Vector& y, double fraction, Vector& rate) = 0;
    /// Completes the latest rate of evaluate().
    virtual void close(OpenRate<Vector> rate) = 0;
    /// out = sum of terms; `out` may be one of them. At most ten.
    virtual void combine(std::span<const Term<Vector>> terms, Vector& out) = 0;
    /// out = sum of terms + factor * the latest rate of evaluate(), completed.
    virtual void combine(std::span<const Term<Vector>> terms, OpenRate<Vector> rate, double factor, Completed completed,
                         Vector& out) = 0;
    /// What errors are measured by.
    [[nodiscard]] virtual double norm(std::span<const Term<Vector>> terms) = 0;

    /// For integrators that want one flat vector: the number of its components, and a state scaled such that norm() is at most
    /// norm_of_components() times the root mean square of the components.
    [[nodiscard]] virtual std::size_t components() const = 0;
    [[nodiscard]] virtual double norm_of_components() const = 0;
    virtual void pack(const Vector& y, std::span<double> values) const = 0;
    virtual void unpack(std::span<const double> values, Vector& y) const = 0;

private:
    double begin_ = 0.0, length_ = 0.0, end_ = 0.0;
};

} // namespace ductile::time
