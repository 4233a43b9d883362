// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <cmath>

namespace ductile {

/// A symmetric tensor of a plane or axisymmetric state. Axisymmetric: x is the radius, y the axis, zz the hoop component.
/// As a strain it holds tensor components: xy is half the engineering shear.
struct SymmetricTensor {
    double xx = 0.0, yy = 0.0, zz = 0.0, xy = 0.0;

    friend constexpr SymmetricTensor operator+(const SymmetricTensor& a, const SymmetricTensor& b) {
        return {a.xx + b.xx, a.yy + b.yy, a.zz + b.zz, a.xy + b.xy};
    }
    friend constexpr SymmetricTensor operator-(const SymmetricTensor& a, const SymmetricTensor& b) {
        return {a.xx - b.xx, a.yy - b.yy, a.zz - b.zz, a.xy - b.xy};
    }
    friend constexpr SymmetricTensor operator*(double c, const SymmetricTensor& a) {
        return {c * a.xx, c * a.yy, c * a.zz, c * a.xy};
    }
};

[[nodiscard]] constexpr double trace(const SymmetricTensor& a) { return a.xx + a.yy + a.zz; }

[[nodiscard]] constexpr SymmetricTensor deviator(const SymmetricTensor& a) {
    const double mean = trace(a) / 3.0;
    return {a.xx - mean, a.yy - mean, a.zz - mean, a.xy};
}

/// a : b
[[nodiscard]] constexpr double contraction(const SymmetricTensor& a, const SymmetricTensor& b) {
    return a.xx * b.xx + a.yy * b.yy + a.zz * b.zz + 2.0 * a.xy * b.xy;
}

/// The equivalent stress of von Mises, sqrt(3 J_2) with (2.1.14) of Sulsky & Kaul.
[[nodiscard]] inline double equivalent_stress(const SymmetricTensor& stress) {
    const SymmetricTensor s = deviator(stress);
    return std::sqrt(1.5 * contraction(s, s));
}

/// d(stress)/d(strain). Rows: stress xx, yy, zz, xy; columns: strain xx, yy, zz and the engineering shear 2 eps_xy.
/// Not symmetric where plastic flow is not associated.
struct Tangent {
    double entry[4][4] = {};
};

} // namespace ductile
