// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

/// Plane tensors by components, for V = double (one point) or Pack (a batch).
namespace ductile {

/// (grad v)_ij = dv_i/dx_j: ux = du/dx, uy = du/dy, vx = dv/dx, vy = dv/dy.
template <class V> struct VelocityGradient { V ux, uy, vx, vy; };

/// A stress or a stress rate in the components of Eq. (1):
///   sigma_xx = -p + s - q, sigma_yy = -p - s - q, sigma_xy = tau, sigma_zz = -p + 2 q.
template <class V> struct StressComponents { V p, s, tau, q; };

} // namespace ductile
