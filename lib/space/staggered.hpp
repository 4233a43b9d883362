#pragma once
#include <ductile/base/simd.hpp>
#include <ductile/material/elasticity.hpp>
#include <ductile/space/field.hpp>
#include <ductile/space/grid.hpp>

/// The staggered discretisation as few verbs. B maps corner velocities to velocity gradients at cell centres (Eq. 2), its
/// transpose maps cell stresses to nodal forces (S.14), (S.15); both use the same one-point gradient, so that
/// K = B^T C B is the operator that makes the projection exact.
namespace ductile {

inline namespace DUCTILE_VECTOR_ABI {

/// Velocity gradient at a vector of cell centres: ux = du/dx, uy = du/dy, vx = dv/dx, vy = dv/dy.
struct VelocityGradient {
    Pack ux, uy, vx, vy;
};

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

[[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] inline VelocityGradient
velocity_gradient(const Corners& u, const Corners& v, double half_inverse_dx, double half_inverse_dy) {
    return {u.difference_x() * Pack(half_inverse_dx), u.difference_y() * Pack(half_inverse_dy),
            v.difference_x() * Pack(half_inverse_dx), v.difference_y() * Pack(half_inverse_dy)};
}

/// The components of Eq. (1) at a vector of cells: a stress or a stress rate.
struct StressPack {
    Pack p, s, tau, q;
};

/// C : D for the gradient, Eq. (42) in the components of Eq. (1):
///   p = -K tr D, s = mu (ux - vy), tau = mu (uy + vx), q = -(mu/3) tr D  (sigma_zz = -p + 2q = (K - 2 mu/3) tr D).
[[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] inline StressPack elastic_rate(const IsotropicElasticity& c,
                                                                         const VelocityGradient& g) {
    const Pack trace = g.ux + g.vy;
    const Pack mu(c.shear_modulus);
    return {Pack(-c.bulk_modulus) * trace, mu * (g.ux - g.vy), mu * (g.uy + g.vx), Pack(-c.shear_modulus / 3.0) * trace};
}

} // namespace DUCTILE_VECTOR_ABI

/// factor * B^T sigma on corner row `node_row` (1 <= node_row <= N - 1) for all columns, (S.14), (S.15): stress times length.
/// Needs the images of the two stress rows beside it. Writes whole vectors of `force`, images not wrapped.
void divergence_row(const Grid& grid, const StressField& stress, double factor, int node_row, VectorField& force);

/// factor * B^T sigma on all interior corner rows; rows 0 and N are set to zero.
void divergence(const Grid& grid, const StressField& stress, double factor, VectorField& force);

} // namespace ductile
