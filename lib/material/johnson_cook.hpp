// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/material/elasticity.hpp>
#include <ductile/material/law.hpp>
#include <ductile/material/step_form.hpp>

#include <array>

namespace ductile {

/// Flow stress of Johnson & Cook (1983) by equivalent plastic strain p, its rate and the temperature:
///   Y = (A + B p^n) (1 + C ln(max(dp/dt, r_0)/r_0)) (1 - T*^m),   T* = (T - T_0)/(T_m - T_0) between 0 and 1.
struct JohnsonCookParameters {
    double yield_stress = 0.0;              ///< A [Pa]
    double hardening = 0.0;                 ///< B [Pa], >= 0
    double hardening_exponent = 1.0;        ///< n
    double rate_coefficient = 0.0;          ///< C, >= 0
    double reference_rate = 1.0;            ///< r_0 [1/s]
    double thermal_exponent = 1.0;          ///< m
    double reference_temperature = 293.15;  ///< T_0 [K], where a material begins
    double melting_temperature = 1e300;     ///< T_m [K]
    double temperature_by_plastic_work = 0; ///< of a volume: its part that is heat, over density and heat capacity [K/Pa], >= 0

    bool operator==(const JohnsonCookParameters&) const = default;
};

/// Von Mises plasticity with that flow stress; the internal variables are p and T. No heat leaves a point.
///
/// Backward Euler over a step: from the equivalent trial stress q* > Y(p, 0, T), the increment d solves
///   g(d) = q* - 3 mu d - Y(p + d, d/dt, T + c q d) = 0,   q = q* - 3 mu d,   c: temperature_by_plastic_work,
/// which has a root between 0 and q*/(3 mu), where g is positive and not. By Newton's method, within a bracket of it.
///
/// Derivative: dd/dq* = (1 - c d Y_T)/(3 mu + Y_p + Y_r/dt + c (q - 3 mu d) Y_T).
class JohnsonCook {
public:
    static constexpr bool linear = false, isochoric = true;

    /// Throws InputError naming the parameter.
    JohnsonCook(const IsotropicElasticity& elasticity, const JohnsonCookParameters& parameters);

    [[nodiscard]] const IsotropicElasticity& elasticity() const { return elasticity_; }
    [[nodiscard]] std::array<InternalVariable, 2> variables() const;
    /// Where it flows slowly.
    [[nodiscard]] double yield_stress(const std::array<double, 2>& internal) const {
        return flow_stress(internal[0], 0.0, internal[1]).value;
    }
    [[nodiscard]] StressReturn<2> correct(const SymmetricTensor& trial, const std::array<double, 2>& internal, double dt) const;
    [[nodiscard]] Tangent tangent(const SymmetricTensor& trial, const std::array<double, 2>& internal, double dt) const;

private:
    struct FlowStress {
        double value, by_strain, by_rate, by_temperature;
    };
    [[nodiscard]] FlowStress flow_stress(double plastic_strain, double rate, double temperature) const;

    struct Increment {
        double value, by_trial;
    };
    [[nodiscard]] Increment increment(double q, const std::array<double, 2>& internal, double dt) const;

    IsotropicElasticity elasticity_;
    JohnsonCookParameters parameters_;
};

/// At finite strain, for particles (finite_strain.hpp).
[[nodiscard]] Law johnson_cook_law(const IsotropicElasticity& elasticity, const JohnsonCookParameters& parameters);

} // namespace ductile
