// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: the kinematics of a material point; templates that the discretisations instantiate.
#include <ductile/base/simd.hpp>
#include <ductile/material/symmetric_tensor.hpp>
#include <ductile/mpm/grid.hpp>

#include <algorithm>

namespace ductile::mpm {

/// The gradient of the velocity at a particle: xy = d(v_x)/dy; hoop = v_r/r in axisymmetry.
struct VelocityGradient {
    double xx = 0.0, xy = 0.0, yx = 0.0, yy = 0.0, hoop = 0.0;
};

/// Jaumann's rate over a step: the stress turned by the angle a with tan(a/2) = w/2, where w = dt (d(v_y)/dx - d(v_x)/dy)/2 is
/// the spin of the step (Hughes & Winget 1980), so that a rotation turns the stress without changing its invariants.
[[gnu::DUCTILE_ALWAYS_INLINE]] inline SymmetricTensor turned(const SymmetricTensor& stress, double w) {
    const double quarter = 0.25 * w * w, denominator = 1.0 / (1.0 + quarter);
    const double c = (1.0 - quarter) * denominator, s = w * denominator;
    const double mean = 0.5 * (stress.xx + stress.yy), half = 0.5 * (stress.xx - stress.yy);
    const double c2 = c * c - s * s, s2 = 2.0 * s * c;
    const double half_turned = c2 * half - s2 * stress.xy;
    return {mean + half_turned, mean - half_turned, stress.zz, c2 * stress.xy + s2 * half};
}

[[gnu::DUCTILE_ALWAYS_INLINE]] inline double spin(const VelocityGradient& l, double dt) { return 0.5 * dt * (l.yx - l.xy); }

/// The strain increment (2.2.18)-(2.2.20), taken from the velocity of the end of the step; plane stress adds its zz.
template <Geometry geometry>
[[gnu::DUCTILE_ALWAYS_INLINE]] inline SymmetricTensor strain_increment(const VelocityGradient& l, double dt) {
    SymmetricTensor strain{dt * l.xx, dt * l.yy, 0.0, 0.5 * dt * (l.xy + l.yx)};
    if constexpr (geometry == Geometry::axisymmetric)
        strain.zz = dt * l.hoop;
    return strain;
}

/// The determinant of the deformation I + dt grad v of a step in the plane.
[[gnu::DUCTILE_ALWAYS_INLINE]] inline double plane_determinant(const VelocityGradient& l, double dt) {
    return (1.0 + dt * l.xx) * (1.0 + dt * l.yy) - dt * l.xy * (dt * l.yx);
}

/// The determinant of the deformation of a step with the stretch `out_of_plane`, or what is not positive where a material line
/// would turn over on the way there: with the trace t and the determinant d of dt grad v, det(I + s dt grad v) = 1 + s t + s^2 d
/// must stay positive for all s in (0, 1]. Two negative stretches have a positive determinant at the end, but not on the way:
/// where d > 0 the smallest value is 1 - t^2/(4 d), at s = -t/(2 d). Two equal ones make it just 0, up to round-off: below 0.01
/// it counts as such.
[[gnu::DUCTILE_ALWAYS_INLINE]] inline double determinant_on_the_way(const VelocityGradient& l, double dt, double out_of_plane) {
    const double end = plane_determinant(l, dt);
    const double t = dt * (l.xx + l.yy), d = dt * l.xx * (dt * l.yy) - dt * l.xy * (dt * l.yx);
    if (t < 0.0 && -t < 2.0 * d)
        if (const double turn = 1.0 - t * t / (4.0 * d); turn < 0.01)
            return std::min(turn, 0.0);
    if (!(end > 0.0))
        return end;
    return out_of_plane > 0.0 ? end * out_of_plane : out_of_plane;
}

/// The derivative of the stress at the end of a step with respect to the velocity gradient times dt: rows xx, yy, xy (and hoop),
/// columns xx, xy, yx, yy (and hoop).
template <Geometry geometry> struct GradientTangent {
    static constexpr int rows = geometry == Geometry::axisymmetric ? 4 : 3;
    static constexpr int columns = geometry == Geometry::axisymmetric ? 5 : 4;
    static constexpr int size = rows * columns;
    double entry[rows][columns];
};

/// With the derivative `d` of the law, d : d(strain) is one part; turning the old stress to `start` is the other: its derivative
/// with respect to the angle is a deviator x, which acts like the strain increment x/(2 mu).
template <Geometry geometry, bool rotate>
GradientTangent<geometry> differentiate_point(Tangent d, const SymmetricTensor& start, double mu, const VelocityGradient& l,
                                              double dt) {
    const double w = spin(l, dt);
    if constexpr (geometry == Geometry::plane_stress) { // sigma_zz = 0 eliminates the strain zz
        const Tangent full = d;
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j)
                d.entry[i][j] -= full.entry[i][2] * full.entry[2][j] / full.entry[2][2];
    }
    GradientTangent<geometry> t;
    constexpr int row_of[4] = {0, 1, 3, 2}; // xx, yy, xy, zz among the rows of the law
    const double angle_slope = 1.0 / (1.0 + 0.25 * w * w);
    for (int r = 0; r < GradientTangent<geometry>::rows; ++r) {
        const double* const row = d.entry[row_of[r]];
        double turn = 0.0; // d(stress)/d(dt l.yx) by turning alone
        if constexpr (rotate)
            turn = 0.5 * angle_slope / mu * (start.xy * (row[1] - row[0]) + (start.xx - start.yy) * row[3]);
        t.entry[r][0] = row[0];
        t.entry[r][1] = row[3] - turn;
        t.entry[r][2] = row[3] + turn;
        t.entry[r][3] = row[1];
        if constexpr (geometry == Geometry::axisymmetric)
            t.entry[r][4] = row[2];
    }
    return t;
}

} // namespace ductile::mpm
