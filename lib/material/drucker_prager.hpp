// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/material/elasticity.hpp>
#include <ductile/material/law.hpp>
#include <ductile/material/step_form.hpp>

namespace ductile {

/// Parameters of the Drucker-Prager cone q + friction * m = cohesion + hardening * k with q = sqrt(3 J_2), m = tr(sigma)/3
/// (tension is positive), k the accumulated plastic multiplier.
struct DruckerPragerParameters {
    double cohesion = 0.0;  ///< [Pa], > 0
    double friction = 0.0;  ///< > 0
    double dilatancy = 0.0; ///< between 0 (no plastic change of volume) and friction (associated flow)
    double hardening = 0.0; ///< [Pa], >= 0

    bool operator==(const DruckerPragerParameters&) const = default;
};

/// Drucker-Prager plasticity with the flow potential q + dilatancy * m; the internal variable is k.
///
/// Backward Euler: with the multiplier d, q = q* - 3 mu d and m = m* - K dilatancy d, so
///   d = (q* + friction m* - cohesion - hardening k)/(3 mu + K friction dilatancy + hardening);
/// where that asks for q < 0 the stress returns to the apex of the cone instead: no deviator, and a plastic change of volume e
/// with
///   friction (m* - K e) = cohesion + hardening (k + e/dilatancy)   (k stays if dilatancy = 0).
class DruckerPrager {
public:
    static constexpr bool linear = false, isochoric = false;
    /// Throws InputError naming the parameter that is out of its range.
    DruckerPrager(const IsotropicElasticity& elasticity, const DruckerPragerParameters& parameters);

    [[nodiscard]] const IsotropicElasticity& elasticity() const { return elasticity_; }
    /// The equivalent stress of von Mises at yield without mean stress.
    [[nodiscard]] double yield_stress(const std::array<double, 1>& internal) const {
        return parameters_.cohesion + parameters_.hardening * internal[0];
    }
    /// k, which off the apex is the equivalent plastic strain, too.
    [[nodiscard]] static std::array<InternalVariable, 1> variables() { return {plastic_strain_variable}; }
    [[nodiscard]] StressReturn<1> correct(const SymmetricTensor& trial, const std::array<double, 1>& internal, double) const;
    [[nodiscard]] Tangent tangent(const SymmetricTensor& trial, const std::array<double, 1>& internal, double) const;

private:
    struct Multiplier {
        double q, mean, excess, increment;
        SymmetricTensor deviator;
    };
    [[nodiscard]] Multiplier multiplier(const SymmetricTensor& trial, double internal) const;
    /// What the apex adds to K friction in the denominator of e: hardening/dilatancy, or 0.
    [[nodiscard]] double apex_hardening() const {
        return parameters_.dilatancy > 0.0 ? parameters_.hardening / parameters_.dilatancy : 0.0;
    }

    IsotropicElasticity elasticity_;
    DruckerPragerParameters parameters_;
};

/// As particles use it. Cells cannot: its flow changes the volume.
[[nodiscard]] Law drucker_prager_law(const IsotropicElasticity& elasticity, const DruckerPragerParameters& parameters);

} // namespace ductile
