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

/// -(v . grad) f at the pack of cells starting at `f`, with `stride` doubles from row to row; u, v are the velocities at the cell
/// centres, half_inverse_d* = 1/(2 d*).
[[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] inline Pack advection_rate(const double* f, std::ptrdiff_t stride, const Pack& u,
                                                                     const Pack& v, double half_inverse_dx,
                                                                     double half_inverse_dy) {
    const Pack f0 = load(f);
    const Pack x = eno2_difference(u, load(f - 2), load(f - 1), f0, load(f + 1), load(f + 2));
    const Pack y = eno2_difference(v, load(f - 2 * stride), load(f - stride), f0, load(f + stride), load(f + 2 * stride));
    return -(u * Pack(half_inverse_dx) * x + v * Pack(half_inverse_dy) * y);
}

/// Closes a cell field at the walls for the ENO stencil: two ghost rows on each side by linear extrapolation, images wrapped.
void extrapolate_to_ghost_rows(Field& field);

} // namespace ductile
