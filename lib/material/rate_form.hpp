// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/simd.hpp>
#include <ductile/material/internal_variable.hpp>

#include <array>
#include <concepts>
#include <cstddef>
#include <tuple>
#include <type_traits>
#include <utility>

namespace ductile {

/// Rates at one point (or one vector of points), in natural units.
template <class V, std::size_t n> struct PlasticRates {
    V fluidity;                ///< D^pl/sbar: the plastic rate of deformation of Eq. (20) is fluidity * sigma_0
    std::array<V, n> internal; ///< of the internal variables
};

/// The number of internal variables of a law.
template <class M>
inline constexpr std::size_t variable_count =
    std::tuple_size_v<std::remove_cvref_t<decltype(std::declval<const M&>().variables())>>;

template <class M, class V>
concept RateFormFor = requires(const M model, const V sbar, const std::array<V, variable_count<M>> internal) {
    { model.yield_stress(internal) } -> std::same_as<V>;
    { model.flow_slope(sbar, internal) } -> std::same_as<V>;
    { model.rates(sbar, internal) } -> std::same_as<PlasticRates<V, variable_count<M>>>;
};

/// What a law in rate form offers, in the scene's natural units, for V = double and V = Pack:
/// D^pl = D^pl(sbar, internal) sigma_0/sbar, Eq. (20), with any number n of internal variables, an std::array<V, n>.
/// - `variables()`: what they are, an std::array<InternalVariable, n>;
/// - `yield_stress(internal)`: D^pl is exactly zero wherever sbar is below it;
/// - `flow_slope(sbar, internal)`: dD^pl/dsbar, for the choice of stable steps and for tangents;
/// - `rates(sbar, internal)`: D^pl/sbar and d(internal)/dt, all zero below yield; sbar > 0.
template <class M>
concept RateForm = requires(const M model) {
    model.variables();
}
&&RateFormFor<M, double>&& RateFormFor<M, Pack>;

} // namespace ductile
