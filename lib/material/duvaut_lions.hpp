// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/material/rate_form.hpp>
#include <ductile/material/step_form.hpp>

#include <array>
#include <cmath>
#include <cstddef>

namespace ductile {

/// The rate form of a rate-independent law in step form (Duvaut & Lions 1972; Simo, Kennedy & Govindjee, Int. J. Numer. Methods
/// Eng. 26, 1988): stress and internal variables relax towards what the law returns them to, within a relaxation time T,
///   2 mu D^pl = (sbar - P(sbar))/T,  d(internal)/dt = (P(internal) - internal)/T,
/// where P is correct() of the present stress. The stress exceeds yield by about 2 mu T times the rate of deformation; T -> 0
/// gives the law back, and makes the equations stiff. For isochoric laws, whose P knows the stress by its magnitude alone.
template <StepForm L> class DuvautLions {
public:
    static constexpr std::size_t n = variable_count<L>;

    /// `relaxation_time` in the units of the law, > 0.
    DuvautLions(const L& law, double relaxation_time)
        : law_(law), inverse_time_(1.0 / relaxation_time), compliance_(inverse_time_ / (2.0 * law.elasticity().shear_modulus)) {}

    [[nodiscard]] std::array<InternalVariable, n> variables() const { return law_.variables(); }

    template <class V> [[nodiscard]] V yield_stress(const std::array<V, n>& internal) const {
        return each([&](const auto& x) { return law_.yield_stress(x) / std::sqrt(3.0); }, internal);
    }

    template <class V> [[nodiscard]] PlasticRates<V, n> rates(const V& sbar, const std::array<V, n>& internal) const {
        PlasticRates<V, n> result;
        result.fluidity =
            each([&](double stress, const auto& x) { return compliance_ * (1.0 - returned(stress, x).stress.xy / stress); }, sbar,
                 internal);
        for (std::size_t k = 0; k < n; ++k)
            result.internal[k] =
                each([&](double stress, const auto& x) { return inverse_time_ * (returned(stress, x).internal[k] - x[k]); }, sbar,
                     internal);
        return result;
    }

    template <class V> [[nodiscard]] V flow_slope(const V& sbar, const std::array<V, n>& internal) const {
        return each(
            [&](double stress, const auto& x) {
                const double kept = law_.tangent({0.0, 0.0, 0.0, stress}, x, 0.0).entry[3][3] / law_.elasticity().shear_modulus;
                return compliance_ * (1.0 - kept);
            },
            sbar, internal);
    }

private:
    /// From pure shear, which stands for every deviator of this magnitude.
    [[nodiscard]] StressReturn<n> returned(double sbar, const std::array<double, n>& internal) const {
        return law_.correct({0.0, 0.0, 0.0, sbar}, internal, 0.0);
    }

    // point after point where there is a batch of them
    static double each(const auto& f, double sbar, const std::array<double, n>& internal) { return f(sbar, internal); }
    static double each(const auto& f, const std::array<double, n>& internal) { return f(internal); }
    static Pack each(const auto& f, const Pack& sbar, const std::array<Pack, n>& internal) {
        double result[pack_size];
        for (int lane = 0; lane < pack_size; ++lane)
            result[lane] = f(sbar[lane], lane_of(internal, lane));
        return load(result);
    }
    static Pack each(const auto& f, const std::array<Pack, n>& internal) {
        return each([&](double, const auto& x) { return f(x); }, Pack(0.0), internal);
    }
    static std::array<double, n> lane_of(const std::array<Pack, n>& internal, int lane) {
        std::array<double, n> x;
        for (std::size_t k = 0; k < n; ++k)
            x[k] = internal[k][lane];
        return x;
    }

    L law_;
    double inverse_time_, compliance_; // 1/T and 1/(2 mu T)
};

} // namespace ductile
