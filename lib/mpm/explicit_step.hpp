// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/aligned.hpp>
#include <ductile/mpm/discretisation.hpp>
#include <ductile/mpm/state.hpp>
#include <ductile/mpm/step_energies.hpp>

#include <memory>
#include <span>

namespace ductile::mpm {

/// Which nodal unknown the equations are written for.
enum class Form {
    velocity, ///< Sec. 2
    momentum  ///< Sec. 3.2: particles are strained by the velocity that their updated velocities map to
};

/// Throws InputError for affine transfers in the momentum form: their particles take the velocity of the nodes, which another one
/// must not strain.
void check(const Scene& scene, Form form);

/// The explicit cycle of Sec. 2.3. Velocity form: with f^k of (2.2.9)-(2.2.10) at the particles' stress and b of (2.2.8),
///   v^L = v^k + dt (f^k + b)/m   (2.2.13), (2.2.15)
/// moves and strains the particles, and v^L - v^k is added to their velocities. Momentum form: the same P^L = m v^L moves them,
/// (3.2.5)-(3.2.6), but the straining velocity is the one that the updated particle velocities map to, (3.2.7):
///   v = v^k + M^-1 M_c (v^L - v^k)
/// with the consistent mass matrix M_c (2.2.6). Where the velocity is prescribed it is so in all three.
class ExplicitStep {
public:
    /// Throws InputError as check() does.
    ExplicitStep(const Scene& scene, Form form);

    /// One step of dt seconds to the time `end`. Throws RunError for a particle that has left the grid, for a node that would
    /// move farther than a cell (no number included), and for a step that would fold the grid at a particle; the state is as
    /// before then, but for the order of its particles.
    StepEnergies advance(State& state, double dt, double end);

    [[nodiscard]] const Discretisation& discretisation() const { return *discretisation_; }
    /// f^k + b of the last step, at all nodes, and what add_held_force() adds.
    [[nodiscard]] std::span<const double> force() const { return force_; }

private:
    void check_travel(const State& state, std::span<const double> velocity, double dt) const;
    void check_forecast(const State& state, const NodalMotion& motion) const;

    Scene scene_;
    Form form_;
    std::unique_ptr<Discretisation> discretisation_;
    aligned_vector<double> force_, external_, increment_, motion_, straining_;
};

/// A bound of the longest stable explicit step: 2/w with the largest frequency w of a grid whose cells all particles fill alike,
/// w^2 <= k c^2 (1/dx^2 + 1/dy^2), where c is the speed of the fastest wave. A mode that alternates from node to node along x,
/// carried by particles where the hat functions of y are 1, has w = 2 c/dx, k = 4; both directions add at a particle in a corner.
/// The modes of B-splines are fastest at a side of the grid, where their knots are repeated: k = 4.63, 5.12, 5.26, ..., 5.39 for
/// 1, 2, 3, ..., many particles a cell. Cells that a body fills in part have nodes of little mass and faster modes, which need
/// the momentum form and a safety factor.
[[nodiscard]] double stability_limit(const Scene& scene, const Particles& particles);
/// The step by the paper's measure: safety times the cell width over sqrt(E/rho) (0.48: Table I).
[[nodiscard]] double explicit_step_size(const Scene& scene, const Particles& particles, double safety);

} // namespace ductile::mpm
