// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/material/elasticity.hpp>
#include <ductile/material/internal_variable.hpp>
#include <ductile/material/rate_form.hpp>
#include <ductile/material/symmetric_tensor.hpp>

#include <array>
#include <concepts>
#include <cstddef>

namespace ductile {

/// What a law makes of a trial stress.
template <std::size_t n> struct StressReturn {
    SymmetricTensor stress = {};
    std::array<double, n> internal = {}; ///< the internal variables at the end of the step
};

/// What a law in step form offers to a point that knows its strain increment: isotropic elasticity with any number n of internal
/// variables.
/// - `variables()`: what they are, an std::array<InternalVariable, n>;
/// - `correct(trial, internal, dt)`: stress and internal variables at the end of a step of dt seconds, from the elastic trial
///   stress and the internal variables at its beginning;
/// - `tangent(trial, internal, dt)`: the derivative of that stress with respect to the strain increment, exactly (consistent);
/// - `yield_stress(internal)`: the equivalent stress of von Mises at yield without mean stress; infinity if there is none;
/// - `linear`: true where correct() hands the trial stress back, always;
/// - `isochoric`: true where plastic flow keeps the volume and does not depend on the pressure.
template <class L>
concept StepForm = requires(const L law) {
    law.variables();
}
&&requires(const L law, const SymmetricTensor& trial, const std::array<double, variable_count<L>>& internal, double dt) {
    { law.elasticity() } -> std::same_as<const IsotropicElasticity&>;
    { law.correct(trial, internal, dt) } -> std::same_as<StressReturn<variable_count<L>>>;
    { law.tangent(trial, internal, dt) } -> std::same_as<Tangent>;
    { law.yield_stress(internal) } -> std::same_as<double>;
    { L::linear } -> std::convertible_to<bool>;
    { L::isochoric } -> std::convertible_to<bool>;
};

} // namespace ductile
