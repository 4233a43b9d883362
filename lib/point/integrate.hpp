// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/tensor.hpp>
#include <ductile/material/law.hpp>
#include <ductile/point/gradient_history.hpp>
#include <ductile/sundials/initial_value.hpp>

#include <array>
#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

namespace ductile::point {

/// p, s, tau, q of Eq. (1) and the law's internal variables, in natural units.
using State = std::vector<double>;

/// Eq. (6) at a point that moves with the material, with the spin of Eq. (5) and D^pl of Eq. (20), in the components of Eq. (1):
///   dp/dt   = -K (ux + vy)
///   ds/dt   = mu (ux - vy) + (uy - vx) tau - 2 mu (D^pl/sbar) s
///   dtau/dt = mu (uy + vx) - (uy - vx) s   - 2 mu (D^pl/sbar) tau
///   dq/dt   = -(mu/3) (ux + vy)            - 2 mu (D^pl/sbar) q
/// and the rates of the internal variables (STZ: Eq. (21)). Writes the rate of `state` to `slope`.
void rate(const Law& law, const VelocityGradient<double>& gradient, std::span<const double> state, std::span<double> slope);

enum class Method {
    rk21,             ///< ductile/ode/rk21.hpp, as the cells of a quasi-static run use it
    arkode_rk21,      ///< the same pair and step control in ARKODE, which weighs errors with |y| at the start of a step
    bogacki_shampine, ///< ARKODE, order 3
    zonneveld,        ///< ARKODE, order 4
    cash_karp,        ///< ARKODE, order 5
    dormand_prince,   ///< ARKODE, order 5
    adams,            ///< CVODE
    bdf,              ///< CVODE
};
inline constexpr std::array all_methods{Method::rk21,      Method::arkode_rk21, Method::bogacki_shampine,
                                        Method::zonneveld, Method::cash_karp,   Method::dormand_prince,
                                        Method::adams,     Method::bdf};
/// "arkode-3-bogacki-shampine": the library, the order if it has one, the name.
[[nodiscard]] std::string_view name(Method method);

/// The states after every step of a method, the first one included. Every segment of the history begins and ends with one.
struct Trajectory {
    std::vector<double> time = {};
    std::vector<State> state = {};
    std::vector<std::size_t> segment_end = {}; ///< index of the last state of each segment
    sundials::Counts counts = {};
};

/// Integrates from `start` at time 0 through the whole history; `tolerance` is the absolute and the relative one of the error of
/// a step, in natural units. Every segment is begun afresh. Throws RunError naming method, tolerance and segment when the method
/// gives up.
[[nodiscard]] Trajectory integrate(const Law& law, const GradientHistory& history, const State& start, Method method,
                                   double tolerance);

/// The largest difference of a trajectory from an integration by Dormand and Prince's pair with tolerance 1e-13 that stops at
/// each of its times: in stresses in natural units, and in the internal variables divided by their scales.
[[nodiscard]] double largest_error(const Law& law, const GradientHistory& history, const Trajectory& trajectory);

} // namespace ductile::point
