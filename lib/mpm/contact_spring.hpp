// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: the force and the energy of a point that touches a surface, derived in surface_contact.hpp.
#include <ductile/mpm/plane_vector.hpp>

#include <algorithm>
#include <cmath>

namespace ductile::mpm {

[[nodiscard]] inline PlaneVector tangent_of(const PlaneVector& normal) { return {-normal[1], normal[0]}; }

/// The springs of a touch in a step: k, mu, and g and T where the step begins.
struct ContactSpring {
    double stiffness, friction, gap, held;

    /// phi
    [[nodiscard]] double stored(double at_gap) const { return at_gap < 0.0 ? 0.5 * stiffness * at_gap * at_gap : 0.0; }

    /// Where the step begins.
    [[nodiscard]] PlaneVector force_at_begin(const PlaneVector& normal_there) const {
        if (!(gap < 0.0))
            return {};
        return -stiffness * gap * normal_there + held * tangent_of(normal_there);
    }

    /// f_n of a step that ends at a gap: that at the end, or -(phi(g^L) - phi(g))/(g^L - g).
    [[nodiscard]] double normal(double end_gap, bool midpoint) const {
        if (!midpoint)
            return stiffness * std::max(-end_gap, 0.0);
        if ((gap < 0.0 && end_gap < 0.0) || gap == end_gap)
            return 0.5 * stiffness * (std::max(-gap, 0.0) + std::max(-end_gap, 0.0));
        return (stored(end_gap) - stored(gap)) / (gap - end_gap);
    }
    /// df_n/dg^L
    [[nodiscard]] double slope_of_normal(double end_gap, double normal_force, bool midpoint) const {
        const double slope = end_gap < 0.0 ? -stiffness : 0.0;
        if (!midpoint)
            return slope;
        return (gap < 0.0 && end_gap < 0.0) || gap == end_gap ? 0.5 * slope : (slope * end_gap - normal_force) / (end_gap - gap);
    }

    /// T^L after a way over the surface.
    [[nodiscard]] double tangential(double slid, double normal_force) const {
        const double most = friction * normal_force;
        return std::clamp(held - stiffness * slid, -most, most);
    }
    [[nodiscard]] bool sticks(double slid, double normal_force) const {
        return std::abs(held - stiffness * slid) <= friction * normal_force;
    }

    /// What a step has rubbed off, by how much the stored energy grows, and the tangential force that is left.
    struct Outcome {
        double rubbed, kept, held;
    };
    [[nodiscard]] Outcome outcome(double end_gap, double tangential_force, double slid) const {
        const double left = end_gap < 0.0 ? tangential_force : 0.0;
        const double elastic = (held - tangential_force) / stiffness; // of the way over the surface
        return {-tangential_force * (slid - elastic),
                stored(end_gap) - stored(gap) + 0.5 * (left * left - held * held) / stiffness, left};
    }
};

} // namespace ductile::mpm
