// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/material/elasticity.hpp>
#include <ductile/material/rate_form.hpp>
#include <ductile/material/step_form.hpp>

namespace ductile {

/// The step form of a law in rate form D^pl(sbar, internal), in its units; sbar = sqrt(J_2).
///
/// Backward Euler for the stress: the deviator keeps the direction of the trial one, and its magnitude solves
///   sbar + 2 mu dt D^pl(sbar, internal^k) = sbar*,
/// whose left side grows with sbar, so that Newton's method within a bracket finds the one solution. Then forward Euler for the
/// internal variables with that sbar. First order in dt, and stable for any dt as far as the stress goes.
template <RateForm Model> class Viscoplastic {
public:
    static constexpr bool linear = false, isochoric = true;
    static constexpr std::size_t count = variable_count<Model>;
    Viscoplastic(const IsotropicElasticity& elasticity, const Model& model) : elasticity_(elasticity), model_(model) {
        check(elasticity);
    }

    [[nodiscard]] const IsotropicElasticity& elasticity() const { return elasticity_; }
    [[nodiscard]] std::array<InternalVariable, count> variables() const { return model_.variables(); }

    /// The equivalent stress of von Mises at yield.
    [[nodiscard]] double yield_stress(const std::array<double, count>& internal) const {
        return std::sqrt(3.0) * model_.yield_stress(internal);
    }

    [[nodiscard]] StressReturn<count> correct(const SymmetricTensor& trial, const std::array<double, count>& internal,
                                              double dt) const {
        const SymmetricTensor s = deviator(trial);
        const double magnitude = std::sqrt(0.5 * contraction(s, s));
        if (magnitude <= model_.yield_stress(internal))
            return {trial, internal};
        const double sbar = relaxed(magnitude, internal, dt);
        StressReturn<count> end{trial - (1.0 - sbar / magnitude) * s, internal};
        const auto rates = model_.rates(sbar, internal);
        for (std::size_t k = 0; k < count; ++k)
            end.internal[k] += dt * rates.internal[k];
        return end;
    }

    /// With a = sbar/sbar*: K I(x)I + 2 mu a (1 - I(x)I/3) + 2 mu (1/(1 + 2 mu dt dD^pl/dsbar) - a) n(x)n, n = s*/|s*|.
    [[nodiscard]] Tangent tangent(const SymmetricTensor& trial, const std::array<double, count>& internal, double dt) const {
        const double mu = elasticity_.shear_modulus;
        const SymmetricTensor s = deviator(trial);
        const double magnitude = std::sqrt(0.5 * contraction(s, s));
        if (magnitude <= model_.yield_stress(internal))
            return isotropic_tangent(elasticity_.bulk_modulus, mu);
        const double sbar = relaxed(magnitude, internal, dt), kept = sbar / magnitude;
        Tangent t = isotropic_tangent(elasticity_.bulk_modulus, mu * kept);
        const double along = 1.0 / (1.0 + 2.0 * mu * dt * model_.flow_slope(sbar, internal));
        const double factor = mu * (along - kept) / (magnitude * magnitude); // 2 mu n(x)n = mu s(x)s/sbar*^2
        const double n[4] = {s.xx, s.yy, s.zz, s.xy};
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j)
                t.entry[i][j] += factor * n[i] * n[j];
        return t;
    }

private:
    /// The magnitude at the end of the step, between yield and trial.
    [[nodiscard]] double relaxed(double trial, const std::array<double, count>& internal, double dt) const {
        const double viscosity = 2.0 * elasticity_.shear_modulus * dt;
        double low = model_.yield_stress(internal), high = trial, sbar = trial;
        for (int iteration = 0; iteration < 200; ++iteration) {
            const double excess = sbar + viscosity * model_.rates(sbar, internal).fluidity * sbar - trial;
            (excess > 0.0 ? high : low) = sbar;
            const double step = excess / (1.0 + viscosity * model_.flow_slope(sbar, internal));
            const double newton = sbar - step;
            const double next = newton > low && newton < high ? newton : 0.5 * (low + high);
            if (std::abs(next - sbar) <= 1e-14 * trial)
                return next;
            sbar = next;
        }
        return sbar;
    }

    IsotropicElasticity elasticity_;
    Model model_;
};

} // namespace ductile
