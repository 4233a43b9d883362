#pragma once
#include <ductile/material/drucker_prager.hpp>
#include <ductile/material/linear_elastic.hpp>
#include <ductile/material/viscoplastic.hpp>
#include <ductile/material/von_mises.hpp>

#include <concepts>
#include <variant>

namespace ductile {

/// What a law offers to a material point that knows its strain increment: isotropic elasticity with one internal variable.
/// - `correct(trial, internal, dt)`: stress and internal variable at the end of a step of dt seconds, from the elastic trial
///   stress and the internal variable at its beginning;
/// - `tangent(trial, internal, dt)`: the derivative of that stress with respect to the strain increment, exactly (consistent);
/// - `internal_variable()`: what that variable is;
/// - `linear`: true where correct() hands the trial stress back, always.
template <class L>
concept StressLaw = requires(const L law, const SymmetricTensor& trial, double x) {
    { law.elasticity() } -> std::same_as<const IsotropicElasticity&>;
    { law.correct(trial, x, x) } -> std::same_as<StressReturn>;
    { law.tangent(trial, x, x) } -> std::same_as<Tangent>;
    { law.internal_variable() } -> std::convertible_to<InternalVariable>;
    { L::linear } -> std::convertible_to<bool>;
};

/// The registry: a new law is one more type in this line.
using AnyStressLaw = std::variant<LinearElastic, VonMises, DruckerPrager, Viscoplastic<StzModel>, Viscoplastic<PerzynaModel>>;

[[nodiscard]] inline InternalVariable internal_variable(const AnyStressLaw& law) {
    return std::visit([](const auto& each) -> InternalVariable { return each.internal_variable(); }, law);
}

static_assert(StressLaw<LinearElastic> && StressLaw<VonMises> && StressLaw<DruckerPrager> && StressLaw<Viscoplastic<StzModel>>,
              "a law must offer elasticity, correct and tangent");

} // namespace ductile
