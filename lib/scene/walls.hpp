// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/scene/history.hpp>

namespace ductile {

/// How one component of the motion of two rigid walls is controlled, the lower and the upper side of a rectangle: the lower one
/// always moves oppositely.
struct WallControl {
    enum class By {
        velocity, ///< the history is that of the upper wall's velocity
        traction, ///< the history is that of the mean stress on the walls, and they move as it takes
    };
    By by = By::velocity;
    History<double> history = {};
};

/// What walls are told at one moment, component by component: the velocity of the upper wall, or the rate of the traction.
struct WallRates {
    double shear = 0.0, opening = 0.0;

    bool operator==(const WallRates&) const = default;
};

/// Both walls: they shear along x by tau, and open, or close the gap, by sigma_yy (tension is positive). Any consistent units.
struct Walls {
    WallControl shear, opening;

    [[nodiscard]] bool by_traction() const;
    /// Just after or before a time: they differ at knots.
    [[nodiscard]] WallRates after(double time) const;
    [[nodiscard]] WallRates before(double time) const;
    /// See History.
    [[nodiscard]] double next_knot(double time) const;
};

/// Walls with a prescribed velocity.
[[nodiscard]] Walls moving(const History<Velocity>& velocity);

} // namespace ductile
