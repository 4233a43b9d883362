#pragma once
#include <ductile/base/simd.hpp>
#include <ductile/material/internal_variable.hpp>
#include <ductile/material/perzyna.hpp>
#include <ductile/material/plastic_rates.hpp>
#include <ductile/material/stz.hpp>

#include <concepts>
#include <variant>

namespace ductile {

/// What a plasticity model offers to the pointwise integrators, in the scene's natural units, for V = double and V = Pack:
/// D^pl = D^pl(sbar, internal) sigma_0/sbar, Eq. (20), with one internal variable.
/// - `yield_stress(internal)`: D^pl is exactly zero wherever sbar is below it;
/// - `flow_slope(sbar, internal)`: dD^pl/dsbar, for the choice of stable steps;
/// - `rates(sbar, internal)`: D^pl/sbar and d(internal)/dt, both zero below yield; sbar > 0;
/// - `internal_variable()`: what the internal variable is.
template <class M, class V>
concept PlasticityModelFor = requires(const M model, const V value) {
    { model.yield_stress(value) } -> std::same_as<V>;
    { model.flow_slope(value, value) } -> std::same_as<V>;
    { model.rates(value, value) } -> std::same_as<PlasticRates<V>>;
};

template <class M>
concept PlasticityModel = PlasticityModelFor<M, double> && PlasticityModelFor<M, Pack> && requires(const M model) {
    { model.internal_variable() } -> std::convertible_to<InternalVariable>;
};

/// The registry: a new model is one more type in this line.
using Plasticity = std::variant<StzModel, PerzynaModel>;

[[nodiscard]] inline InternalVariable internal_variable(const Plasticity& plasticity) {
    return std::visit([](const auto& model) -> InternalVariable { return model.internal_variable(); }, plasticity);
}

static_assert(PlasticityModel<StzModel>, "the STZ model must offer yield_stress and rates for double and Pack");
static_assert(PlasticityModel<PerzynaModel>, "the Perzyna model must offer yield_stress and rates for double and Pack");

} // namespace ductile
