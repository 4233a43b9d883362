// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/simd.hpp>
#include <ductile/material/law.hpp>
#include <ductile/material/rate_form.hpp>
#include <ductile/material/units.hpp>

namespace ductile {

/// Rate-dependent von Mises plasticity (Perzyna overstress law) with linear isotropic hardening, in SI.
/// Stresses are magnitudes sbar = sqrt(s^2 + tau^2 + 3 q^2), i.e. von Mises equivalent stress divided by sqrt(3).
struct PerzynaParameters {
    double yield_stress = 0.85e9;   ///< sbar at first yield [Pa]
    double hardening_modulus = 0.0; ///< H = d(yield stress)/d(plastic strain) [Pa], >= 0
    double reference_rate = 1e-2;   ///< D_0 [1/s]
    int overstress_exponent = 1;    ///< n >= 1

    bool operator==(const PerzynaParameters&) const = default;
};

/// Throws InputError naming the parameter: yield stress and reference rate positive, hardening >= 0, 1 <= n <= 100.
void check(const PerzynaParameters& parameters);

/// Perzyna plasticity in natural units; the internal variable is the plastic strain kappa (shear measure, dkappa/dt = D^pl):
///   D^pl = D_0 (sbar/Y - 1)^n for sbar >= Y = s_Y + H kappa, else 0.
class PerzynaModel {
public:
    PerzynaModel(const PerzynaParameters& parameters, const Units& units);

    template <class V> [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] V yield_stress(const std::array<V, 1>& plastic_strain) const {
        return V(yield_stress_) + V(hardening_) * plastic_strain[0];
    }

    template <class V>
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] PlasticRates<V, 1> rates(const V& sbar,
                                                                       const std::array<V, 1>& plastic_strain) const {
        const V overstress = maximum(sbar / yield_stress(plastic_strain) - V(1.0), V(0.0));
        V flow = V(reference_rate_) * overstress;
        for (int k = 1; k < exponent_; ++k)
            flow = flow * overstress;
        return {flow / sbar, {flow}};
    }

    /// dD^pl/dsbar, zero below yield: how fast the flow relaxes the stress.
    template <class V>
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] V flow_slope(const V& sbar, const std::array<V, 1>& plastic_strain) const {
        const V inverse_yield = V(1.0) / yield_stress(plastic_strain);
        const V overstress = sbar * inverse_yield - V(1.0);
        V slope = V(reference_rate_ * exponent_) * inverse_yield;
        for (int k = 1; k < exponent_; ++k)
            slope = slope * overstress;
        return select(overstress > V(0.0), slope, V(0.0));
    }

    /// kappa, whose unit is 1 in any system.
    [[nodiscard]] static std::array<InternalVariable, 1> variables() { return {plastic_strain_variable}; }

private:
    double yield_stress_, hardening_, reference_rate_;
    int exponent_;
};

/// As both carriers use it; `elasticity` in natural units. Throws InputError as check() does.
[[nodiscard]] Law perzyna_law(const IsotropicElasticity& elasticity, const PerzynaParameters& parameters,
                              const Units& units = si_units);

} // namespace ductile
