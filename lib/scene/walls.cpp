// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/scene/walls.hpp>

#include <algorithm>

namespace ductile {

bool Walls::by_traction() const { return shear.by == WallControl::By::traction || opening.by == WallControl::By::traction; }

WallRates Walls::after(double time) const {
    const auto rate = [&](const WallControl& control) {
        return control.by == WallControl::By::velocity ? control.history.after(time) : control.history.slope(time);
    };
    return {rate(shear), rate(opening)};
}

WallRates Walls::before(double time) const {
    const auto rate = [&](const WallControl& control) {
        return control.by == WallControl::By::velocity ? control.history.before(time) : control.history.slope_before(time);
    };
    return {rate(shear), rate(opening)};
}

double Walls::next_knot(double time) const { return std::min(shear.history.next_knot(time), opening.history.next_knot(time)); }

Walls moving(const History<Velocity>& velocity) {
    std::vector<History<double>::Knot> shear, opening;
    for (const auto& [time, value] : velocity.knots()) {
        shear.push_back({time, value.u});
        opening.push_back({time, value.v});
    }
    return {{WallControl::By::velocity, History<double>(std::move(shear))},
            {WallControl::By::velocity, History<double>(std::move(opening))}};
}

} // namespace ductile
