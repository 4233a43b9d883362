#pragma once
#include <ductile/material/linear_elastic.hpp>
#include <ductile/material/perzyna.hpp>
#include <ductile/material/plasticity.hpp>
#include <ductile/material/stz.hpp>

namespace ductile {

/// SI as natural units: the rate models of the quasi-static side without scaling.
inline constexpr Units si_units{.length = 1.0, .time = 1.0, .stress = 1.0, .temperature = 1.0};

/// A rate model D^pl(sbar, internal) (see plasticity.hpp) as a law of material points, in SI; sbar = sqrt(J_2).
///
/// Backward Euler for the stress: the deviator keeps the direction of the trial one, and its magnitude solves
///   sbar + 2 mu dt D^pl(sbar, internal^k) = sbar*,
/// whose left side grows with sbar, so that Newton's method within a bracket finds the one solution. Then forward Euler for the
/// internal variable with that sbar. First order in dt, and stable for any dt as far as the stress goes.
template <PlasticityModel Model> class Viscoplastic {
public:
    static constexpr bool linear = false;
    Viscoplastic(const IsotropicElasticity& elasticity, const Model& model) : elasticity_(elasticity), model_(model) {
        check(elasticity);
    }

    [[nodiscard]] const IsotropicElasticity& elasticity() const { return elasticity_; }
    [[nodiscard]] InternalVariable internal_variable() const { return model_.internal_variable(); }

    /// The equivalent stress of von Mises at yield.
    [[nodiscard]] double yield_stress(double internal) const { return std::sqrt(3.0) * model_.yield_stress(internal); }

    [[nodiscard]] StressReturn correct(const SymmetricTensor& trial, double internal, double dt) const {
        const SymmetricTensor s = deviator(trial);
        const double magnitude = std::sqrt(0.5 * contraction(s, s));
        if (magnitude <= model_.yield_stress(internal))
            return {trial, internal};
        const double sbar = relaxed(magnitude, internal, dt);
        return {trial - (1.0 - sbar / magnitude) * s, internal + dt * model_.rates(sbar, internal).internal};
    }

    /// With a = sbar/sbar*: K I(x)I + 2 mu a (1 - I(x)I/3) + 2 mu (1/(1 + 2 mu dt dD^pl/dsbar) - a) n(x)n, n = s*/|s*|.
    [[nodiscard]] Tangent tangent(const SymmetricTensor& trial, double internal, double dt) const {
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
    [[nodiscard]] double relaxed(double trial, double internal, double dt) const {
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
