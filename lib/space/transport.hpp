// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/simd.hpp>
#include <ductile/space/field.hpp>

#include <cstddef>

namespace ductile {

/// Twice the grid spacing times the second-order ENO derivative of Eq. (4), upwinded by the sign of `velocity`.
/// f[-2..2] are the five values along the line, in the direction of growing coordinate. With sigma = sign(velocity), a and b the
/// first and second upwind neighbours, d0 = f1 - 2 f0 + f-1 and dup = f0 - 2a + b, both one-sided formulas of (4) equal
///   (f1 - f-1) + sigma (dup - d0),  taken where |d0| > |dup|; ties and velocity = 0 take the centred difference.
template <class V>
[[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] inline V eno2_difference(const V& velocity, const V& fm2, const V& fm1, const V& f0,
                                                                   const V& f1, const V& f2) {
    const Mask<V> from_right = velocity < V(0.0);
    const V a = select(from_right, f1, fm1);
    const V b = select(from_right, f2, fm2);
    const V here = (f1 - f0) - (f0 - fm1);
    const V upwind = (f0 - a) - (a - b);
    const V bend = select(magnitude(here) > magnitude(upwind), upwind - here, V(0.0));
    const V centred = f1 - fm1;
    return select(from_right, centred - bend, select(velocity > V(0.0), centred + bend, centred));
}

/// The differences of -(v . grad) f at a pack of cells.
enum class Advection {
    eno2,  ///< Lu & Rycroft's Eq. (4), second order: jumps from stencil to stencil, so that its rate is not continuous in f
    weno3, ///< on the same cells, third order where f is smooth, and as smooth in f as f itself (Jiang & Peng 2000)
};

/// The same as a weighted mean of both formulas instead of a choice between them, with a quotient of polynomials for the weight:
///   (f1 - f-1) + sigma w (dup - d0),  w = 1/(1 + 2 r^2),  r = (e + dup^2)/(e + d0^2),
/// Jiang & Peng, SIAM J. Sci. Comput. 21 (2000) 2126, their third-order weights. The errors of the centred and of the one-sided
/// formula are h^2 f_xxx/6 and -h^2 f_xxx/3, so that w = 1/3, where f_xx does not change from cell to cell, leaves h^3 f_xxxx/12.
/// At a kink on the upwind side r >> 1 and w -> 0, on the other side r << 1 and w -> 1: ENO's choice. Second differences below
/// sqrt(e) count as equal: waves that small meet a linear scheme. The weight stays a fraction, for one division a cell.
template <class V> struct Weno3Difference {
    V centred, bend;          ///< sigma (dup - d0)
    V numerator, denominator; ///< of w

    [[gnu::DUCTILE_ALWAYS_INLINE]] Weno3Difference(const V& velocity, const V& fm2, const V& fm1, const V& f0, const V& f1,
                                                   const V& f2, const V& e) {
        const Mask<V> from_right = velocity < V(0.0);
        const V a = select(from_right, f1, fm1);
        const V b = select(from_right, f2, fm2);
        const V here = (f1 - f0) - (f0 - fm1);
        const V upwind = (f0 - a) - (a - b);
        const V change = upwind - here;
        centred = f1 - fm1;
        bend = select(from_right, -change, select(velocity > V(0.0), change, V(0.0)));
        const V by_here = e + here * here, by_upwind = e + upwind * upwind;
        numerator = by_here * by_here;
        denominator = numerator + V(2.0) * (by_upwind * by_upwind);
    }
};

/// -(v . grad) f at the pack of cells starting at `f`, with `stride` doubles from row to row; u, v are the velocities at the cell
/// centres, half_inverse_d* = 1/(2 d*), and `smallest_bend` the e of weno3.
template <Advection advection>
[[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] inline Pack advection_rate(const double* f, std::ptrdiff_t stride, const Pack& u,
                                                                     const Pack& v, double half_inverse_dx,
                                                                     double half_inverse_dy, double smallest_bend) {
    const Pack f0 = load(f);
    if constexpr (advection == Advection::eno2) {
        const Pack x = eno2_difference(u, load(f - 2), load(f - 1), f0, load(f + 1), load(f + 2));
        const Pack y = eno2_difference(v, load(f - 2 * stride), load(f - stride), f0, load(f + stride), load(f + 2 * stride));
        return -(u * Pack(half_inverse_dx) * x + v * Pack(half_inverse_dy) * y);
    } else {
        using Difference = Weno3Difference<Pack>;
        const Pack e(smallest_bend);
        const Difference x(u, load(f - 2), load(f - 1), f0, load(f + 1), load(f + 2), e);
        const Difference y(v, load(f - 2 * stride), load(f - stride), f0, load(f + stride), load(f + 2 * stride), e);
        const Pack inverse = Pack(1.0) / (x.denominator * y.denominator);
        const Pack by_x = x.centred + x.bend * (x.numerator * y.denominator * inverse);
        const Pack by_y = y.centred + y.bend * (y.numerator * x.denominator * inverse);
        return -(u * Pack(half_inverse_dx) * by_x + v * Pack(half_inverse_dy) * by_y);
    }
}

/// Closes a cell field at the walls for the ENO stencil: two ghost rows on each side by linear extrapolation, images wrapped.
void extrapolate_to_ghost_rows(Field& field);

} // namespace ductile
