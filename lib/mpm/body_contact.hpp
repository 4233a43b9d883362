// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/mpm/discretisation.hpp>

#include <memory>

namespace ductile::mpm {

/// Contact of bodies that do not share the nodes' velocity (Scene::field_of_body) with each other: the points on the edge of one
/// (Particles::surface) touch the sides between those of another, and the other way round.
///
/// Gap. A side goes from a to b with what is outside on its right; L is its length, e its direction, n = (e_y, -e_x). Of a point
/// c
///   xi = (c - a).e/L,   g = (c - a).n,
/// negative within the body. The change of places makes, with dd = dc - (1 - xi) da - xi db and dr = db - da,
///   dg = n.dd,   dn = -(n.dr/L) e,   dxi = (e.dd + (g/L) n.dr)/L.
/// Where a reentrant corner is nearest, xi is 0 or 1, n the line to it, g minus its length, and dn = (e.dd/g) e, dxi = 0; other
/// corners are nearest to what is outside only. Sides touch a point if they face the edge that it is on
/// and are less than a cell away from it when it is within.
/// Where an edge ends (at a side of the grid that cuts a body) its last side goes on for as long again.
///
/// Force. The energy of a touch is phi = k max(-g, 0)^2/2: c gets F = f_n n + T t, a gets -(1 - xi) F, b gets -xi F, with t = e;
/// the normal part keeps momentum and, as phi does not change in a rotation, its moment; what the tangential part adds to that is
/// T g. Friction is that of SurfaceContact with the way over the side, s = (dx_c - (1 - xi) dx_a - xi dx_b).t, and so is when
/// methods take the forces, and what they are there; points go as in SurfaceContact, which moves them.
///
/// Stiffness. Both bodies' layers give way, one after the other: a point of A on B has k = k_c alpha_B/(2 (alpha_A + alpha_B)),
/// k_c being that of the point and alpha the materials' stiffnesses; the points of both together make 1/k = 1/k_A + 1/k_B. As
/// both move, they are as fast as one on a rigid surface, and explicit steps bear them.
///
/// Derivative, from the changes above, of the end and of where the method takes the force (half of them for the middle):
///   dF = df_n n + f_n dn + dT t - T (dn.t) n,   on a: -(1 - xi) dF + dxi F,   on b: -xi dF - dxi F,
///   dT = -k ds sticking,   sign(T) mu df_n slipping,   ds = t.dd + rel.dt + (dx_a - dx_b).t dxi.
/// Symmetric without friction, for steps whose force is that at their end. Preconditioners take the touching parts of each body
/// without dn and dxi, and not what couples the bodies.
///
/// Energy (StepEnergies): of the bodies together, what is stored and rubbed as for rigid ones; nothing comes from outside.
[[nodiscard]] std::unique_ptr<Discretisation> with_body_contact(std::unique_ptr<Discretisation> within, const Scene& scene,
                                                                bool midpoint);

/// How deep surface points of bodies lie within others where they do most [m]; zero where none does.
[[nodiscard]] double deepest_body_contact(const Particles& particles, const Scene& scene);

} // namespace ductile::mpm
