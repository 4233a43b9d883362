// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/mpm/discretisation.hpp>

#include <memory>

namespace ductile::mpm {

/// Loads on the edges of bodies (Scene::loads, Particles::loaded).
///
/// The middle x_m of a side goes with the velocity field around its particle as surface points do (SurfaceContact), v_m = sum
/// B_i v_i, and the side s, from end to end with the outside on its right, with the affine part of that:
///   s^L = s + dt C s,   C s = sum (s . g_i) v_i,   g_i = N_i D^-1 (x_i - x_p).
/// A pressure p acts on the deformed side, f = -p (s_y, -s_x), times the radius of the middle in axisymmetry; a traction t on the
/// area at the start, f = t A. The nodes get B_i f. Times and sides are those of the beginning of a step where its method takes
/// forces from there, of its end where implicit and quasi-static ones do, and of its middle for the midpoint rule.
///
/// Derivative of a pressure's force, with ds = dt sum (s . g_i) dv_i (half of it for the middle): -p (ds_y, -ds_x), and in
/// axisymmetry -p (s_y, -s_x) dr; it is not symmetric, and preconditioners go without it.
///
/// The work of a step is f . dt v_m, of implicit steps with the mean of both ends' forces (Ledger).
[[nodiscard]] std::unique_ptr<Discretisation> with_loads(std::unique_ptr<Discretisation> within, const Scene& scene,
                                                         bool midpoint);

} // namespace ductile::mpm
