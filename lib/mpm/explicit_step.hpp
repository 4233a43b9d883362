#pragma once
#include <ductile/base/aligned.hpp>
#include <ductile/mpm/discretisation.hpp>
#include <ductile/mpm/state.hpp>

#include <array>
#include <memory>

namespace ductile::mpm {

/// Which nodal unknown the equations are written for.
enum class Form {
    velocity, ///< Sec. 2
    momentum  ///< Sec. 3.2: particles are strained by the velocity that their updated velocities map to
};

/// The explicit cycle of Sec. 2.3. Velocity form: with f^k of (2.2.9)-(2.2.10) at the particles' stress and b of (2.2.8),
///   v^L = v^k + dt (f^k + b)/m   (2.2.13), (2.2.15)
/// moves and strains the particles, and v^L - v^k is added to their velocities. Momentum form: the same P^L = m v^L moves them,
/// (3.2.5)-(3.2.6), but the straining velocity is the one that the updated particle velocities map to, (3.2.7):
///   v = v^k + M^-1 M_c (v^L - v^k)
/// with the consistent mass matrix M_c (2.2.6). Where the velocity is prescribed it is so in all three.
class ExplicitStep {
public:
    ExplicitStep(const Scene& scene, Form form);

    /// One step of dt seconds. Throws RunError for a particle that has left the grid, and for a node that would move farther than
    /// a cell (no number included); the state is as before then, but for the order of its particles.
    void advance(State& state, double dt);

    [[nodiscard]] const Discretisation& discretisation() const { return *discretisation_; }

private:
    void check_travel(const State& state, std::span<const double> velocity, double dt) const;
    void check_leaving(const State& state, const NodalMotion& motion) const;

    const Scene& scene_;
    Form form_;
    std::unique_ptr<Discretisation> discretisation_;
    aligned_vector<double> force_, external_, increment_, motion_, straining_;
};

/// The longest stable explicit step by the paper's measure: safety times the cell width over sqrt(E/rho) (0.48: Table I).
[[nodiscard]] double explicit_step_size(const Scene& scene, const Particles& particles, double safety);

/// The force of the particles on rigid body number `body`: minus what that body exerts on its nodes, the sum of the internal
/// forces there, at the instant of discretisation.prepare() with the particles' present stress.
[[nodiscard]] std::array<double, 2> contact_force(const Discretisation& discretisation, const Particles& particles, int body);

} // namespace ductile::mpm
