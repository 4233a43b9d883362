#pragma once
#include <ductile/base/simd.hpp>
#include <ductile/base/tensor.hpp>
#include <ductile/material/elasticity.hpp>

#include <array>

/// The constitutive law at a point, for V = double (one) or Pack (a batch): what every time integrator is made of.
namespace ductile {
inline namespace DUCTILE_VECTOR_ABI {

/// What plastic flow couples at a point: s, tau, q, internal; p only follows its source.
template <class V> using FlowState = std::array<V, 4>;

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
template <class V> [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] inline V deviatoric_square(const FlowState<V>& y) {
    return y[0] * y[0] + y[1] * y[1] + V(3.0) * (y[2] * y[2]);
}

/// sbar, kept away from zero so that its reciprocal exists at points without stress.
template <class V> [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] inline V deviatoric_magnitude(const FlowState<V>& y) {
    return maximum(square_root(deviatoric_square(y)), V(1e-150));
}

/// Rate of (s, tau, q, internal): frozen sources minus the plastic relaxation -C : D^pl = -2 mu (D^pl/sbar) sigma_0, Eq. (20).
template <class M, class V> struct FlowRate {
    const M& model;
    const V two_mu;
    const FlowState<V> source;

    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] FlowState<V> operator()(const FlowState<V>& y) const {
        const auto rates = model.rates(deviatoric_magnitude(y), y[3]);
        const V relaxation = two_mu * rates.fluidity;
        return {source[0] - relaxation * y[0], source[1] - relaxation * y[1], source[2] - relaxation * y[2],
                source[3] + rates.internal};
    }
};

} // namespace DUCTILE_VECTOR_ABI
} // namespace ductile
