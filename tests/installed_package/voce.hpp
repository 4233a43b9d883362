// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/material/make_law.hpp>

namespace own {
using namespace ductile; // its functions of one number or of a vector of them

/// A law of a user's own: hardening that saturates (Voce 1948), with a rate,
///   D^pl = D_0 (sbar/Y - 1) above Y(kappa) = Y_inf - (Y_inf - Y_0) exp(-kappa/kappa_0),  dkappa/dt = D^pl.
struct Voce {
    double first_yield, saturation; ///< Y_0, Y_inf, of sbar
    double strain;                  ///< kappa_0
    double rate;                    ///< D_0

    static std::array<InternalVariable, 1> variables() {
        return {{{.name = "accumulated_shear", .unit = "1", .start = 0.0, .scale = 0.01, .lower = 0.0, .upper = 10.0}}};
    }

    template <class V> V yield_stress(const std::array<V, 1>& kappa) const {
        return V(saturation) - V(saturation - first_yield) * exponential(V(-1.0 / strain) * kappa[0]);
    }

    template <class V> PlasticRates<V, 1> rates(const V& sbar, const std::array<V, 1>& kappa) const {
        const V flow = V(rate) * maximum(sbar / yield_stress(kappa) - V(1.0), V(0.0));
        return {flow / sbar, {flow}};
    }

    template <class V> V flow_slope(const V& sbar, const std::array<V, 1>& kappa) const {
        const V yield = yield_stress(kappa);
        return select(sbar > yield, V(rate) / yield, V(0.0));
    }
};

} // namespace own
