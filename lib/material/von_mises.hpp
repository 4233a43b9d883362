// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/material/elasticity.hpp>
#include <ductile/material/law.hpp>
#include <ductile/material/step_form.hpp>

#include <array>
#include <vector>

namespace ductile {

/// The hardening function H of the equivalent plastic strain p, (2.1.19) of Sulsky & Kaul: tau_0 + c_1 p up to p_L, from there
/// on down with the slope -c_2, and zero once nothing is left. With the default p_L it is linear hardening. Voce's (1948) adds
/// Q (1 - exp(-p/p_0)). A curve of points takes the place of c_1, p_L and c_2: straight between them, constant after the last.
struct Hardening {
    double yield_stress = 0.0;                     ///< tau_0 [Pa]
    double modulus = 0.0;                          ///< c_1 [Pa]
    double limit_strain = 1e300;                   ///< p_L
    double softening = 0.0;                        ///< c_2 [Pa]
    double saturation = 0.0;                       ///< Q [Pa], >= 0
    double saturation_strain = 0.1;                ///< p_0
    std::vector<std::array<double, 2>> curve = {}; ///< p and H [Pa] from p = 0, where H is tau_0; empty: none

    bool operator==(const Hardening&) const = default;
};

/// Von Mises plasticity with isotropic hardening and associated flow, (2.1.13)-(2.1.19), rate-independent; the internal variable
/// is the equivalent plastic strain p of (2.1.16).
///
/// Backward Euler over a step with the trial stress sigma* (old stress + elasticity : strain increment), deviator s*, equivalent
/// stress q* = sqrt(3/2 s*:s*): if q* > H(p), the increment d of p solves q* - 3 mu d = H(p + d), which is linear on each piece
/// of H, and s = (1 - 3 mu d/q*) s*.
class VonMises {
public:
    static constexpr bool linear = false, isochoric = true;
    /// Throws InputError for a yield stress that is not positive, a negative limit strain, softening as steep as 3 mu (then a
    /// step has no unique solution), and a curve that does not begin with the yield stress or whose strains do not grow.
    VonMises(const IsotropicElasticity& elasticity, const Hardening& hardening);

    [[nodiscard]] const IsotropicElasticity& elasticity() const { return elasticity_; }
    [[nodiscard]] static std::array<InternalVariable, 1> variables() { return {plastic_strain_variable}; }
    /// The equivalent stress of von Mises at yield.
    [[nodiscard]] double yield_stress(const std::array<double, 1>& plastic_strain) const {
        const Piece& piece = pieces_[piece_of(plastic_strain[0])];
        return piece.value + piece.slope * plastic_strain[0] + saturating(plastic_strain[0]);
    }

    [[nodiscard]] StressReturn<1> correct(const SymmetricTensor& trial, const std::array<double, 1>& plastic_strain,
                                          double) const {
        const SymmetricTensor s = deviator(trial);
        const double q = std::sqrt(1.5 * contraction(s, s));
        if (q <= yield_stress(plastic_strain))
            return {trial, plastic_strain};
        const double increment = plastic_increment(q, plastic_strain[0]).increment;
        const double factor = 3.0 * elasticity_.shear_modulus * increment / q;
        return {trial - factor * s, {plastic_strain[0] + increment}};
    }

    /// The derivative of correct(): K I(x)I + 2 mu b (1 - I(x)I/3) - 2 mu (1/(1 + H'/(3 mu)) - (1 - b)) n(x)n with b = 1 - 3 mu
    /// d/q*, n = s*/|s*|.
    [[nodiscard]] Tangent tangent(const SymmetricTensor& trial, const std::array<double, 1>& plastic_strain, double) const {
        const double mu = elasticity_.shear_modulus;
        const SymmetricTensor s = deviator(trial);
        const double q = std::sqrt(1.5 * contraction(s, s));
        if (q <= yield_stress(plastic_strain))
            return isotropic_tangent(elasticity_.bulk_modulus, mu);
        const Increment step = plastic_increment(q, plastic_strain[0]);
        const double lost = 3.0 * mu * step.increment / q;
        Tangent t = isotropic_tangent(elasticity_.bulk_modulus, mu * (1.0 - lost));
        const double direct = 2.0 * mu * (3.0 * mu / (3.0 * mu + step.slope) - lost) * 1.5 / (q * q); // n(x)n = 1.5 s(x)s/q^2
        const double n[4] = {s.xx, s.yy, s.zz, s.xy};
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j)
                t.entry[i][j] -= direct * n[i] * n[j];
        return t;
    }

private:
    /// H = value + slope p for p below `end`.
    struct Piece {
        double end, value, slope;
    };
    struct Increment {
        double increment, slope;
    };

    [[nodiscard]] std::size_t piece_of(double plastic_strain) const {
        std::size_t k = 0;
        while (plastic_strain > pieces_[k].end)
            ++k;
        return k;
    }
    /// Voce's part of H.
    [[nodiscard]] double saturating(double plastic_strain) const {
        return saturation_ > 0.0 ? -saturation_ * std::expm1(-plastic_strain / saturation_strain_) : 0.0;
    }
    [[nodiscard]] Increment plastic_increment(double q, double plastic_strain) const {
        for (std::size_t k = piece_of(plastic_strain);; ++k) {
            const Piece& piece = pieces_[k];
            if (saturation_ > 0.0) {
                const Increment step = saturating_increment(q, plastic_strain, piece);
                if (!(plastic_strain + step.increment > piece.end))
                    return step;
                continue;
            }
            const double increment =
                (q - piece.value - piece.slope * plastic_strain) / (3.0 * elasticity_.shear_modulus + piece.slope);
            if (!(plastic_strain + increment > piece.end)) // what is no number ends here, too, and is found out by whoever steps
                return {increment, piece.slope};
        }
    }

    /// With the straight part `piece` and Voce's. Newton's method from nothing on, below yield from where the straight part ends.
    [[nodiscard]] Increment saturating_increment(double q, double plastic_strain, const Piece& piece) const {
        const double stiffness = 3.0 * elasticity_.shear_modulus + piece.slope;
        double increment = 0.0, slope = 0.0;
        for (int iteration = 0; iteration < 100; ++iteration) {
            const double p = plastic_strain + increment;
            slope = saturation_ / saturation_strain_ * std::exp(-p / saturation_strain_);
            const double excess = q - piece.value - piece.slope * plastic_strain - stiffness * increment - saturating(p);
            const double change = excess / (stiffness + slope);
            increment += change;
            if (!(std::abs(change) > 1e-15 * (std::abs(increment) + q / stiffness)))
                break;
        }
        return {increment, piece.slope + slope};
    }

    IsotropicElasticity elasticity_;
    double saturation_, saturation_strain_;
    std::vector<Piece> pieces_;
};

/// The same at finite strain, for particles: multiplicative flow (finite_strain.hpp).
[[nodiscard]] Law hencky_von_mises_law(const IsotropicElasticity& elasticity, const Hardening& hardening);

/// As both carriers use it; on cells with the given relaxation time, see duvaut_lions.hpp, in natural units if the rest is.
[[nodiscard]] Law von_mises_law(const IsotropicElasticity& elasticity, const Hardening& hardening, double relaxation_time = 1e-3);

} // namespace ductile
