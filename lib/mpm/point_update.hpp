// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: the kinematics of a material point; templates that the discretisations instantiate.
#include <ductile/base/simd.hpp>
#include <ductile/material/finite_strain.hpp>
#include <ductile/material/symmetric_tensor.hpp>
#include <ductile/mpm/grid.hpp>

#include <algorithm>

namespace ductile::mpm {

/// The gradient of the velocity at a particle: xy = d(v_x)/dy; hoop = v_r/r in axisymmetry.
struct VelocityGradient {
    double xx = 0.0, xy = 0.0, yx = 0.0, yy = 0.0, hoop = 0.0;
};

/// A stress that is turned by half the angle whose cosine and sine are c and s.
[[gnu::DUCTILE_ALWAYS_INLINE]] inline SymmetricTensor turned_by_half(const SymmetricTensor& stress, double c, double s) {
    const double mean = 0.5 * (stress.xx + stress.yy), half = 0.5 * (stress.xx - stress.yy);
    const double half_turned = c * half - s * stress.xy;
    return {mean + half_turned, mean - half_turned, stress.zz, c * stress.xy + s * half};
}

/// Jaumann's rate over a step: the stress turned by the angle a with tan(a/2) = w/2, where w = dt (d(v_y)/dx - d(v_x)/dy)/2 is
/// the spin of the step (Hughes & Winget 1980), so that a rotation turns the stress without changing its invariants.
[[gnu::DUCTILE_ALWAYS_INLINE]] inline SymmetricTensor turned(const SymmetricTensor& stress, double w) {
    const double quarter = 0.25 * w * w, denominator = 1.0 / (1.0 + quarter);
    const double c = (1.0 - quarter) * denominator, s = w * denominator;
    return turned_by_half(stress, c * c - s * s, 2.0 * s * c);
}

/// The same by half of the angle.
[[gnu::DUCTILE_ALWAYS_INLINE]] inline SymmetricTensor half_turned(const SymmetricTensor& stress, double w) {
    const double quarter = 0.25 * w * w, denominator = 1.0 / (1.0 + quarter);
    return turned_by_half(stress, (1.0 - quarter) * denominator, w * denominator);
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

// The forces of a step may act on the configuration that it moves to, or on that in its middle: x + h v with h = dt or dt/2 and
// the velocity v, deformed by f = 1 + h grad v from where the step began. There grad N is f^-T times what it was, and the volume
// det f times: a stress sigma makes the force -V P grad N with the volume and gradients of the beginning and
//   P = det(f) sigma f^-T,
// Piola's stress. Its derivative by a change dl of h grad v, with dL = dl f^-1 and d(sigma) by the law, is
//   dP = tr(dL) P + det(f) d(sigma) f^-T - P dl^T f^-T.
//
// In the middle, h = dt/2, the step is seen as g = dt grad v f^-1: of a rotation by the angle a the spin w with tan(a/2) = w/2,
// to any size, while f is half of that rotation and shorter by cos(a/2). With the stress at both ends, sigma^k and sigma^L, the
// forces there are those of the mean of both, turned to the middle,
//   sigma = Q^T (Q^2 sigma^k Q^-2 + sigma^L)/2 Q,   Q the rotation by a/2.
// A stress in rate form has at the end what the law makes of Q^2 sigma^k Q^-2 + C : Q e Q^T, e the symmetric part of g. Over the
// step the forces then do the work -dt f . v = V det(f) sigma : e, and that is what the particles get when U of (2.2.16) counts
// (Q^2 sigma^k Q^-2 + sigma^L)/2 : Q e Q^T in the volume of the middle: the balance of energy is exact, whatever flows. (The
// stress after half a step would not do: where it goes from one yield point to the other within a step it is no mean of both.)
// By a change of the gradient, with f = (1 + F)/2 and g = (F - 1) f^-1 of the step's F,
//   dg = 2 f^-1 dl f^-1 = f^-1 d(F) f^-1.

/// The deformation of a step h by the velocity gradient l; plane stress adds its zz.
template <Geometry geometry> [[gnu::DUCTILE_ALWAYS_INLINE]] inline Deformation deformation(const VelocityGradient& l, double h) {
    return {h * l.xx, h * l.xy, h * l.yx, h * l.yy, geometry == Geometry::axisymmetric ? h * l.hoop : 0.0};
}

/// a f^-1
[[gnu::DUCTILE_ALWAYS_INLINE]] inline Deformation over(const Deformation& a, const Deformation& f) {
    const double fxx = 1.0 + f.xx, fyy = 1.0 + f.yy, inverse = 1.0 / (fxx * fyy - f.xy * f.yx);
    return {inverse * (a.xx * fyy - a.xy * f.yx), inverse * (a.xy * fxx - a.xx * f.xy), inverse * (a.yx * fyy - a.yy * f.yx),
            inverse * (a.yy * fxx - a.yx * f.xy), a.zz / (1.0 + f.zz)};
}
/// a f^-T
[[gnu::DUCTILE_ALWAYS_INLINE]] inline Deformation over_transposed(const Deformation& a, const Deformation& f) {
    return over(a, {f.xx, f.yx, f.xy, f.yy, f.zz});
}

[[gnu::DUCTILE_ALWAYS_INLINE]] inline double determinant(const Deformation& f) {
    return ((1.0 + f.xx) * (1.0 + f.yy) - f.xy * f.yx) * (1.0 + f.zz);
}

/// a b
[[gnu::DUCTILE_ALWAYS_INLINE]] inline Deformation times(const Deformation& a, const Deformation& b) {
    return {a.xx * b.xx + a.xy * b.yx, a.xx * b.xy + a.xy * b.yy, a.yx * b.xx + a.yy * b.yx, a.yx * b.xy + a.yy * b.yy,
            a.zz * b.zz};
}
[[gnu::DUCTILE_ALWAYS_INLINE]] inline Deformation operator*(double c, const Deformation& a) {
    return {c * a.xx, c * a.xy, c * a.yx, c * a.yy, c * a.zz};
}
/// (1 + f)^-1
[[gnu::DUCTILE_ALWAYS_INLINE]] inline Deformation inverse(const Deformation& f) { return over({1.0, 0.0, 0.0, 1.0, 1.0}, f); }

/// A stress that need not be symmetric: xy is the force in x on an area across y.
struct PiolaStress {
    double xx = 0.0, xy = 0.0, yx = 0.0, yy = 0.0, zz = 0.0;

    friend constexpr PiolaStress operator*(double c, const PiolaStress& a) {
        return {c * a.xx, c * a.xy, c * a.yx, c * a.yy, c * a.zz};
    }
};

[[gnu::DUCTILE_ALWAYS_INLINE]] inline PiolaStress piola(const SymmetricTensor& s, const Deformation& f) {
    const double j = determinant(f);
    const Deformation p = over_transposed({s.xx, s.xy, s.xy, s.yy, s.zz}, f);
    return {j * p.xx, j * p.xy, j * p.yx, j * p.yy, j * p.zz};
}

/// dP by h grad w: rows and columns xx, xy, yx, yy (and hoop).
template <Geometry geometry> struct PiolaTangent {
    static constexpr int size = geometry == Geometry::axisymmetric ? 5 : 4;
    double entry[size][size];
};

/// Which change of deformation a tangent d(sigma) refers to.
enum class SeenBy {
    end,   ///< dL = dl f^-1
    middle ///< dg = 2 f^-1 dl f^-1
};
/// `t`: d(sigma) by what `seen` says. In plane stress sigma_zz = 0 at the end of the step, which its row zz is of, but for a
/// factor.
template <Geometry geometry, SeenBy seen>
PiolaTangent<geometry> differentiate_piola(const SpatialTangent& t, const SymmetricTensor& s, const Deformation& f) {
    const double j = determinant(f);
    const PiolaStress p = piola(s, f);
    PiolaTangent<geometry> result;
    for (int column = 0; column < PiolaTangent<geometry>::size; ++column) {
        Deformation change{double(column == 0), double(column == 1), double(column == 2), double(column == 3),
                           double(column == 4)};
        Deformation l = over(change, f);
        double volumetric = l.xx + l.yy + l.zz; // of dL, whatever the law sees
        if constexpr (seen == SeenBy::middle)
            l = 2.0 * times(inverse(f), l);
        if constexpr (geometry == Geometry::plane_stress) { // sigma_zz = 0
            const double* const z = t.entry[2];
            l.zz = -(z[0] * l.xx + z[1] * l.xy + z[2] * l.yx + z[3] * l.yy) / z[4];
            change.zz = seen == SeenBy::middle ? 0.5 * (1.0 + f.zz) * (1.0 + f.zz) * l.zz : (1.0 + f.zz) * l.zz;
            volumetric += change.zz / (1.0 + f.zz);
        }
        double d[4];
        for (int r = 0; r < 4; ++r)
            d[r] =
                t.entry[r][0] * l.xx + t.entry[r][1] * l.xy + t.entry[r][2] * l.yx + t.entry[r][3] * l.yy + t.entry[r][4] * l.zz;
        const Deformation of_stress = over_transposed({d[0], d[3], d[3], d[1], d[2]}, f);
        const Deformation turned =
            over_transposed({p.xx * change.xx + p.xy * change.xy, p.xx * change.yx + p.xy * change.yy,
                             p.yx * change.xx + p.yy * change.xy, p.yx * change.yx + p.yy * change.yy, p.zz * change.zz},
                            f);
        const double rows[5] = {
            volumetric * p.xx + j * of_stress.xx - turned.xx, volumetric * p.xy + j * of_stress.xy - turned.xy,
            volumetric * p.yx + j * of_stress.yx - turned.yx, volumetric * p.yy + j * of_stress.yy - turned.yy,
            volumetric * p.zz + j * of_stress.zz - turned.zz};
        for (int r = 0; r < PiolaTangent<geometry>::size; ++r)
            result.entry[r][column] = rows[r];
    }
    return result;
}

/// What turning a tensor further does to it, by the angle.
inline SymmetricTensor by_angle(const SymmetricTensor& a) { return {-2.0 * a.xy, 2.0 * a.xy, 0.0, a.xx - a.yy}; }

/// The derivative by g of a stress in rate form at the end of a step, which the law with the tangent d makes of the trial stress
/// start + C : strain: `start` is turned by the spin w of g, `strain` by half of that. As in differentiate_point() the deviator
/// that a turn makes of `start` acts like a strain.
inline SpatialTangent turned_tangent(const Tangent& d, const SymmetricTensor& start, const SymmetricTensor& strain, double mu,
                                     double w) {
    const double angle_slope = 1.0 / (1.0 + 0.25 * w * w);
    const SymmetricTensor by_spin = 0.5 * angle_slope * (by_angle(strain) + 1.0 / mu * by_angle(start));
    SpatialTangent t;
    for (int j = 0; j < 5; ++j) {
        const double xx = j == 0, xy = j == 1, yx = j == 2, yy = j == 3, zz = j == 4;
        const SymmetricTensor e = half_turned({xx, yy, zz, 0.5 * (xy + yx)}, w) + 0.5 * (yx - xy) * by_spin;
        for (int r = 0; r < 4; ++r)
            t.entry[r][j] = d.entry[r][0] * e.xx + d.entry[r][1] * e.yy + d.entry[r][2] * e.zz + 2.0 * d.entry[r][3] * e.xy;
    }
    return t;
}

/// The derivative by g of a stress at the end of a step whose derivative by dL, d(F) = dL F, is t; f is the middle of the step.
inline SpatialTangent seen_from_middle(const SpatialTangent& t, const Deformation& f) {
    const Deformation whole{1.0 + f.xx, f.xy, f.yx, 1.0 + f.yy, 1.0 + f.zz};
    SpatialTangent result;
    for (int j = 0; j < 5; ++j) {
        const Deformation g{double(j == 0), double(j == 1), double(j == 2), double(j == 3), double(j == 4)};
        const Deformation l = over(times(times(whole, g), whole), 2.0 * f); // dL = f dg f F^-1
        for (int r = 0; r < 4; ++r)
            result.entry[r][j] =
                t.entry[r][0] * l.xx + t.entry[r][1] * l.xy + t.entry[r][2] * l.yx + t.entry[r][3] * l.yy + t.entry[r][4] * l.zz;
    }
    return result;
}

/// The stress that acts in the middle of a step with the spin w: `start` is that of the beginning, turned to the end.
[[gnu::DUCTILE_ALWAYS_INLINE]] inline SymmetricTensor stress_in_middle(const SymmetricTensor& start, const SymmetricTensor& end,
                                                                       double w) {
    return half_turned(0.5 * (start + end), -w);
}

/// Its derivative by g; t that of `end`.
inline SpatialTangent middle_tangent(const SpatialTangent& t, const SymmetricTensor& start, const SymmetricTensor& end,
                                     double w) {
    const double angle_slope = 1.0 / (1.0 + 0.25 * w * w);
    const SymmetricTensor of_start = angle_slope * by_angle(start), back = -0.5 * angle_slope * by_angle(0.5 * (start + end));
    SpatialTangent result;
    for (int j = 0; j < 5; ++j) {
        const double spin_slope = j == 1 ? -0.5 : j == 2 ? 0.5 : 0.0;
        const SymmetricTensor of_end{t.entry[0][j], t.entry[1][j], t.entry[2][j], t.entry[3][j]};
        const SymmetricTensor d = half_turned(0.5 * of_end + spin_slope * (0.5 * of_start + back), -w);
        const double rows[4] = {d.xx, d.yy, d.zz, d.xy};
        for (int r = 0; r < 4; ++r)
            result.entry[r][j] = rows[r];
    }
    return result;
}

} // namespace ductile::mpm
