// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/simd.hpp>
#include <ductile/base/tensor.hpp>
#include <ductile/space/field.hpp>
#include <ductile/space/grid.hpp>

/// The staggered discretisation as few verbs. B maps corner velocities to velocity gradients at cell centres (Eq. 2), its
/// transpose maps cell stresses to nodal forces (S.14), (S.15); both use the same one-point gradient, so that
/// K = B^T C B is the operator that makes the projection exact.
namespace ductile {

inline namespace DUCTILE_VECTOR_ABI {

/// The four corner values of one velocity component around a vector of cells.
struct Corners {
    Pack lower_left, lower_right, upper_left, upper_right;

    Corners(const double* lower, const double* upper)
        : lower_left(load(lower)), lower_right(load(lower + 1)), upper_left(load(upper)), upper_right(load(upper + 1)) {}

    [[nodiscard]] Pack mean() const { return Pack(0.25) * ((lower_left + lower_right) + (upper_left + upper_right)); }
    /// 2 dx times the derivative in x, Eq. (2).
    [[nodiscard]] Pack difference_x() const { return (lower_right + upper_right) - (lower_left + upper_left); }
    /// 2 dy times the derivative in y.
    [[nodiscard]] Pack difference_y() const { return (upper_left + upper_right) - (lower_left + lower_right); }
};

/// At a vector of cell centres.
[[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] inline VelocityGradient<Pack>
velocity_gradient(const Corners& u, const Corners& v, double half_inverse_dx, double half_inverse_dy) {
    return {u.difference_x() * Pack(half_inverse_dx), u.difference_y() * Pack(half_inverse_dy),
            v.difference_x() * Pack(half_inverse_dx), v.difference_y() * Pack(half_inverse_dy)};
}

} // namespace DUCTILE_VECTOR_ABI

/// factor * B^T sigma on corner row `node_row` (1 <= node_row <= N - 1) for all columns, (S.14), (S.15): stress times length.
/// Needs the images of the two stress rows beside it. Writes whole vectors of `force`, images not wrapped.
void divergence_row(const Grid& grid, const StressField& stress, double factor, int node_row, VectorField& force);

/// factor * B^T sigma on all interior corner rows; rows 0 and N are set to zero.
void divergence(const Grid& grid, const StressField& stress, double factor, VectorField& force);

} // namespace ductile
