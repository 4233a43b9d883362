// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/simd.hpp>
#include <ductile/base/tensor.hpp>
#include <ductile/material/elasticity.hpp>

#include <array>
#include <cstddef>

/// The constitutive law at a point, for V = double (one) or Pack (a batch): what every time integrator is made of.
namespace ductile {
inline namespace DUCTILE_VECTOR_ABI {

/// What plastic flow couples at a point with n internal variables: s, tau, q, internal; p only follows its source.
template <class V, std::size_t n> using FlowState = std::array<V, 3 + n>;

template <class V, std::size_t m> [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] inline auto internal_of(const std::array<V, m>& y) {
    std::array<V, m - 3> internal;
    for (std::size_t k = 0; k + 3 < m; ++k)
        internal[k] = y[k + 3];
    return internal;
}

/// C : D for the gradient, Eq. (42) in the components of Eq. (1):
///   p = -K tr D, s = mu (ux - vy), tau = mu (uy + vx), q = -(mu/3) tr D  (sigma_zz = -p + 2q = (K - 2 mu/3) tr D).
template <class V>
[[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] inline StressComponents<V> elastic_rate(const IsotropicElasticity& c,
                                                                                  const VelocityGradient<V>& g) {
    const V trace = g.ux + g.vy;
    const V mu(c.shear_modulus);
    return {V(-c.bulk_modulus) * trace, mu * (g.ux - g.vy), mu * (g.uy + g.vx), V(-c.shear_modulus / 3.0) * trace};
}

/// sbar^2 = s^2 + tau^2 + 3 q^2.
template <class V, std::size_t m>
[[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] inline V deviatoric_square(const std::array<V, m>& y) {
    return y[0] * y[0] + y[1] * y[1] + V(3.0) * (y[2] * y[2]);
}

/// sbar, kept away from zero so that its reciprocal exists at points without stress.
template <class V, std::size_t m>
[[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] inline V deviatoric_magnitude(const std::array<V, m>& y) {
    return maximum(square_root(deviatoric_square(y)), V(1e-150));
}

/// Rate of (s, tau, q, internal): frozen sources minus the plastic relaxation -C : D^pl = -2 mu (D^pl/sbar) sigma_0, Eq. (20).
template <class M, class V, std::size_t m> struct FlowRate {
    const M& model;
    const V two_mu;
    const std::array<V, m> source;

    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] std::array<V, m> operator()(const std::array<V, m>& y) const {
        const auto rates = model.rates(deviatoric_magnitude(y), internal_of(y));
        const V relaxation = two_mu * rates.fluidity;
        std::array<V, m> slope;
        for (std::size_t k = 0; k < 3; ++k)
            slope[k] = source[k] - relaxation * y[k];
        for (std::size_t k = 3; k < m; ++k)
            slope[k] = source[k] + rates.internal[k - 3];
        return slope;
    }
};

} // namespace DUCTILE_VECTOR_ABI
} // namespace ductile
