// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/quasistatic/scene.hpp>

namespace ductile::quasistatic {

/// The constraint of every scheme: projects a predicted stress onto discrete equilibrium, orthogonally in the elastic energy.
///
///   K phi = -B^T sigma*/dt  (Eq. 50 with homogeneous walls),
///   sigma_{n+1} = sigma* + dt C : (D(phi) + D_w)  (Eqs. 17, 33),
/// where D_w is the uniform velocity gradient of walls that move as the predictor did not know: as they do when it left C : D out
/// (first-order schemes; the affine velocity field carries the wall data exactly and B^T of a uniform stress is zero inside), and
/// when it had C : D(q) in, not at all, or by what force control finds. With K = B^T C B the result satisfies B^T sigma = 0 to
/// round-off.
class Projection {
public:
    Projection(const Scene& scene, Space& space);

    /// `force` holds -B^T sigma*/dt on entry and the velocity correction phi on exit; `cells` goes from sigma* to sigma_{n+1}.
    /// Returns the size of the projection, Q* (below). Throws RunError when the stress is not finite.
    ///
    /// Q* is the dimensionless elastic strain of the correction sigma_P = dt C : D(phi):
    ///   Q*^2 = 1/|Omega| integral of (sbar_P^2/mu^2 + p_P^2/(K mu)) dA  = <sigma_P, sigma_P>/(|Omega| mu), Eq. (19).
    /// The paper's (51)-(55) equals sqrt(6 K/|Omega|) Q*, in whatever units K and |Omega| are counted.
    double apply(VectorField& force, const WallVelocity& wall, double dt, CellState& cells);
    /// Q* of the walls' dt C : D_w, which is orthogonal to the rest.
    [[nodiscard]] double measure_of(const WallVelocity& wall, double dt) const;

    [[nodiscard]] double solve_seconds() const { return solve_seconds_; }
    [[nodiscard]] double update_seconds() const { return update_seconds_; }
    [[nodiscard]] long long solves() const { return solves_; }

private:
    Scene scene_;
    Space& space_;
    double solve_seconds_ = 0.0, update_seconds_ = 0.0;
    long long solves_ = 0;
};

/// Takes the part of a stress that is out of equilibrium away; walls under a traction bring it to that of `time`. Returns the
/// root mean square of the change over that of the stress.
double put_into_equilibrium(const Scene& scene, Space& space, double time, CellState& cells);

} // namespace ductile::quasistatic
