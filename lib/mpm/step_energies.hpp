// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace ductile::mpm {

/// The energies that pass in a step [J, a metre of thickness or a radian].
///
/// A step changes the velocity of nodes by dv, M dv = dt F, F = (1 - mu) f^k + mu f^L + b, with the lumped mass M; it strains the
/// particles by a velocity w; and it adds dv to theirs, which makes their kinetic energy K and their internal energy U = sum m e
/// of (2.2.16) obey
///   dK + dU = R + B - N,
///   R = -dt sum over held nodes of F . w       the work of what holds them (contact_force() on a body, times its way, negative),
///   B = dt sum of b . w                        that of body forces,
///   N = (w - v^k) . M dv - dv . M_c dv/2 + L   what the method itself takes away, or adds where it is negative,
/// with the consistent mass M_c (sum m |dv|^2 over the particles is dv . M_c dv) and L = ParticleEnergies::of_lag. It is exact
/// for explicit steps (mu = 0), and to the solver's tolerance for implicit ones. In the velocity form w - v^k = kappa dv:
///   N = kappa dv . M dv - dv . M_c dv/2 + L,
/// kappa = 1 for explicit and implicit steps, 1/2 for the midpoint rule, which so loses dv . (M - M_c) dv/2 alone; in the
/// momentum form w - v^k = kappa M^-1 M_c dv, and N = (kappa - 1/2) dv . M_c dv + L. Without inertia K and dv stay out, N = L.
///
/// Affine transfers let the particles' velocities, and with them K, jump to the nodes' (Discretisation): the same balance with
/// R = -dt sum over held nodes of (F + add_held_force()) . w is N = sum w . M (v^L - v) - dK + L, v what the particles map to.
///
/// Rigid bodies with surfaces hold no nodes: SurfaceContact says what their work W is, and what of it friction D takes and
/// contacts keep, P: dK + dU + dP + D = R + W + B - N.
///
/// U is not a function of the stress: the elastic energy sum V sigma : C^-1 : sigma/2 and what plastic flow dissipates differ
/// from it by what Jaumann's rate makes of a change of volume, -(elastic energy) per volume and volume change.
struct StepEnergies {
    double body_work = 0.0;    ///< B
    double dissipated = 0.0;   ///< by plastic flow: stress in the middle of the step times plastic strain
    double of_method = 0.0;    ///< N
    double of_change = 0.0;    ///< dv . M_c dv/2: how much of a motion the step has changed; without inertia none
    double surface_work = 0.0; ///< of rigid bodies by their surfaces, instead of R
    double load_work = 0.0;    ///< of loads on edges: another W
    double friction = 0.0;     ///< dissipated by slipping over them
    double in_contact = 0.0;   ///< growth of the energy stored in contacts
};

} // namespace ductile::mpm
