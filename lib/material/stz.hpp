// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/simd.hpp>
#include <ductile/material/law.hpp>
#include <ductile/material/rate_form.hpp>
#include <ductile/material/units.hpp>

namespace ductile {

/// Parameters of the athermal shear-transformation-zone theory (Lu & Rycroft, App. A, Table A.3: Vitreloy 1), in SI.
struct StzParameters {
    double yield_stress = 0.85e9;          ///< s_Y [Pa]
    double molecular_time = 1e-13;         ///< tau_0 [s]
    double local_strain = 0.3;             ///< epsilon_0
    double heat_capacity = 0.4;            ///< c_0
    double activation_barrier = 8000.0;    ///< Delta/k_B [K]
    double activation_volume = 300e-30;    ///< zeta [m^3]
    double bath_temperature = 400.0;       ///< T [K]
    double steady_temperature = 900.0;     ///< chi_inf [K]
    double formation_temperature = 21000.; ///< e_Z/k_B [K]
    double corner_width = 0.0;             ///< w of the smoothed yield corner, in units of s_Y; 0: the sharp corner of (A.1)

    bool operator==(const StzParameters&) const = default;
};

/// Throws InputError naming the parameter unless all are positive (the corner width: not negative) and finite.
void check(const StzParameters& parameters);

/// STZ plasticity in natural units, App. A; the internal variable is the effective temperature chi:
///   D^pl = (t_s/tau_0) exp(-e_Z/(k_B chi)) exp(-Delta/(k_B T)) cosh(a sbar) (1 - s_Y/sbar)  for sbar >= s_Y, else 0, (A.1)-(A.3)
///   a = zeta epsilon_0/(k_B T);
///   c_0 dchi/dt = (D^pl : sigma_0)(chi_inf - chi)/s_Y,  Eq. (21).
/// With sbar = |sigma_0| = sqrt(s^2 + tau^2 + 3 q^2) (Sec. 2), sigma_0 : sigma_0 = 2 sbar^2, hence D^pl : sigma_0 = 2 sbar D^pl.
/// The three exponents are added before one exponential is taken: exp(E) (1 + exp(-2 a sbar))/2 is the product above. The second
/// half of the cosh (jumps against the stress) is left out where it stays below 1e-11 of the first at any stress above yield:
/// it is 9e-13 for the parameters of Table A.3.
///
/// With a corner width w > 0 the factor 1 - s_Y/sbar =: x, cut at zero, becomes (x + sqrt(x^2 + w^2))/2, analytic in sbar: flow
/// creeps below yield, no cell is ever elastic, and time integrators meet a smooth right-hand side. For x < 0 it is evaluated as
/// w^2/(2 (sqrt(x^2 + w^2) - x)), without cancellation; both in terms of sbar x = sbar - s_Y, so that sbar -> 0 is harmless.
class StzModel {
public:
    StzModel(const StzParameters& parameters, const Units& units);

    /// Zero with a smooth corner: there is no elastic range.
    template <class V> [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] V yield_stress(const std::array<V, 1>&) const {
        return V(corner_width_ > 0.0 ? 0.0 : yield_stress_);
    }

    template <class V>
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] PlasticRates<V, 1> rates(const V& sbar, const std::array<V, 1>& internal) const {
        const V& chi = internal[0];
        const V inverse_product = V(1.0) / (sbar * chi); // one division serves both reciprocals
        const V inverse_sbar = inverse_product * chi;
        const V bias = V(activation_) * sbar;
        V transition = exponential(bias + V(log_half_attempt_rate_) - V(formation_) * (inverse_product * sbar));
        if (backward_jumps_)
            transition = transition + transition * exponential(V(-2.0) * bias);
        const V fluidity = corner_width_ > 0.0
                               ? transition * smooth_overstress(sbar, inverse_sbar)
                               : select(sbar >= V(yield_stress_),
                                        transition * (V(1.0) - V(yield_stress_) * inverse_sbar) * inverse_sbar, V(0.0));
        return {fluidity, {V(heating_) * (sbar * sbar) * fluidity * (V(steady_) - chi)}};
    }

    /// dD^pl/dsbar, zero below yield: how fast the flow relaxes the stress.
    template <class V> [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] V flow_slope(const V& sbar, const std::array<V, 1>& chi) const {
        const V inverse_sbar = V(1.0) / sbar;
        const V overstress = V(1.0) - V(yield_stress_) * inverse_sbar;
        const V flow = rates(sbar, chi).fluidity * sbar; // D^pl = transition * overstress
        if (corner_width_ > 0.0)
            return flow * (V(activation_) + V(yield_stress_) * inverse_sbar * inverse_sbar /
                                                square_root(overstress * overstress + V(corner_width_ * corner_width_)));
        const V slope =
            V(activation_) * flow + flow / maximum(overstress, V(1e-12)) * V(yield_stress_) * (inverse_sbar * inverse_sbar);
        return select(overstress > V(0.0), slope, V(0.0));
    }

    /// chi: it begins at T_base = 640 K (Table C.5), and chi_inf counts as one. Below 1 K exp(-e_Z/(k_B chi)) has no meaning
    /// left, above e_Z/k_B the zones are no longer dilute.
    [[nodiscard]] std::array<InternalVariable, 1> variables() const { return {variable_}; }

private:
    /// (x + sqrt(x^2 + w^2))/(2 sbar) with x = 1 - s_Y/sbar.
    template <class V> [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] V smooth_overstress(const V& sbar, const V& inverse_sbar) const {
        const V width = V(corner_width_) * sbar, excess = sbar - V(yield_stress_);
        const V root = square_root(excess * excess + width * width);
        return select(excess > V(0.0), V(0.5) * (excess + root) * (inverse_sbar * inverse_sbar),
                      V(0.5 * corner_width_ * corner_width_) / (root - excess));
    }

    double yield_stress_;          // s_Y
    double corner_width_;          // w
    double activation_;            // zeta epsilon_0/(k_B T)
    double log_half_attempt_rate_; // ln(t_s/(2 tau_0)) - Delta/(k_B T)
    double formation_;             // e_Z/k_B
    double steady_;                // chi_inf
    double heating_;               // 2/(c_0 s_Y)
    bool backward_jumps_;          // whether exp(-2 a sbar) counts
    InternalVariable variable_;
};

/// As both carriers use it; `elasticity` in natural units. Throws InputError as check() does.
[[nodiscard]] Law stz_law(const IsotropicElasticity& elasticity, const StzParameters& parameters, const Units& units = si_units);

} // namespace ductile
