// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/mpm/active_nodes.hpp>

#include <array>
#include <cstdint>
#include <span>

namespace ductile::mpm {

/// The balance of a node over a step is m_i (v_i^L - v_i^k)/dt = F_i + R_i with F = f + b, internal and body force as the step
/// weighs its beginning and end. Where the velocity is prescribed the particles get no change of velocity from the node, and what
/// holds it exerts R_i = -F_i there, body force included; elsewhere R_i = 0. Internal forces sum to nothing, hence
///   d/dt sum m_p v_p = sum_i b_i + sum_i R_i,
/// the momentum balance of the whole, exactly for every explicit step and to the solver's tolerance for implicit ones.
///
/// Where transfers are affine the particles do get the velocity of a held node, at once: what holds it takes
/// M (v_i - v_i^k), v_i what they map to, within the step, a force M (v_i - v_i^k)/dt which is part of F.
void add_held_force(const ActiveNodes& nodes, double dt, std::span<double> force);

/// The force of the particles on a rigid body (its number) or a side of the grid (a Side): F, summed over the components it
/// holds, a component that several hold shared equally among them [N, a metre of thickness or a radian].
[[nodiscard]] std::array<double, 2> contact_force(const ActiveNodes& nodes, std::span<const double> force, std::int32_t holder);

} // namespace ductile::mpm
