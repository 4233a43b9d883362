// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/mpm/discretisation.hpp>

#include <memory>

namespace ductile::mpm {

/// Contact of the points on the surfaces of bodies (Particles::surface) with the surfaces of rigid ones (RigidBody::surface).
///
/// Kinematics. A point c goes with the velocity field around its particle: with the offset r from it, and D of Discretisation,
///   v_c = sum B_i v_i,   B_i = N_i (1 + r_x (x_i - x_p)/D_xx) (1 + r_y (y_i - y_p)/D_yy),   r^L = r + dt sum (B_i - N_i) v_i.
/// sum B_i = 1 and sum B_i x_i = x_c: the force f_c on it, which the nodes get as B_i f_c, keeps momentum and its moment. Of hat
/// functions B_i is N_i where the point is, as long as that is in the particle's cell: a uniform pressure on points a particle
/// apart makes a uniform stress (without the product of both factors, 9 % off). B_i is about as large as some N_i, so that a node
/// with little mass is not torn away (with r . grad N_i it is).
///
/// Normal force. With the gap g from the rigid surface, negative within the body, and the normal n out of it,
///   f_n = k max(-g, 0) n,   the derivative of the energy phi = k max(-g, 0)^2/2:
/// a penalty (verification/contact.py compares it with others). k is that of a layer as thick as a particle, of the material or
/// stiffer (add_surface()), on the point's share of the surface: under a pressure p points lie p/modulus particles deep, which is
/// nothing for metals, and reported. There is no tension.
///
/// Friction (Coulomb), with the tangent t = (-n_y, n_x): the point's way s over the surface in a step turns the tangential force
/// of its beginning into
///   T^L = T - k s,   then between -mu f_n and mu f_n:   stick, elastic to k, or slip.
/// s = (dt v_c - d) . t with the displacement d of the rigid body where the point is: it moves and turns as prescribed.
///
/// When. Explicit steps take the force where they begin. Implicit and quasi-static ones take that at the end, with n and t there;
/// those of the midpoint rule n and t in the middle, and
///   f_n = -(phi(g^L) - phi(g))/(g^L - g),
/// so that over a plane surface the normal force gains and loses no energy, neither on entering nor on leaving. T^L it takes,
/// too, and not the mean of T and T^L: after a step that only enters or leaves, f_n is less than the mean of both ends', and a
/// mean T would be more than mu f_n: a block that jumps a little from step to step sticks to its slope.
///
/// Derivative, dx = dt dv_c; a rigid surface of curvature c has dn = c t (t . dx), dt = -c n (t . dx):
///   df = -k n (n . dx) + f_n c t (t . dx) + dT t - T c n (t . dx),
///   dT = -k (1 - c (dt v_c - d) . n) (t . dx)  sticking,   sign(T) mu df_n  slipping: not symmetric.
/// With the midpoint rule dn and dt are half of that.
///
/// Energy (StepEnergies): what a rigid body does is f_c . d, of implicit steps with the mean of both ends' forces (Ledger); of it
/// dphi + d(T^2)/(2 k) is stored, -T^L (s - (T - T^L)/k) goes into friction, and what is left is the method's.
///
/// Everything else is the work of the discretisation within. The rigid bodies given to prepare() must stay until advance().
[[nodiscard]] std::unique_ptr<Discretisation> with_surface_contact(std::unique_ptr<Discretisation> within, const Scene& scene,
                                                                   bool midpoint);

} // namespace ductile::mpm
