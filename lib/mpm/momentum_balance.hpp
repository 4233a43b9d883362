// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/mpm/discretisation.hpp>
#include <ductile/mpm/explicit_step.hpp>
#include <ductile/mpm/state.hpp>
#include <ductile/mpm/step_energies.hpp>

#include <span>

namespace ductile::mpm {

enum class ImplicitMethod {
    paper,       ///< (2.4.1) with weight mu on the force at the end; strain and motion from v^L
    midpoint,    ///< force, strain and motion from the middle of the step: keeps energy; second order
    quasi_static ///< no inertia: the force at the end vanishes; a lone particle can leave motions of its nodes without resistance
};

struct ImplicitScheme {
    ImplicitMethod method = ImplicitMethod::paper;
    Form form = Form::velocity;
    double mu = 1.0; ///< of the paper's method; from 0 (explicit) to 1 (fully implicit)
};

/// The nonlinear system of one implicit step, with the particles where they are at its beginning.
///
/// Velocity form, unknown u = v^L, (2.4.12):
///   F(u) = M (u - v^k) - dt [(1 - mu) f^k + mu f(sigma(w)) + b],   w = v^k + kappa (u - v^k)
/// with the stress sigma(w) that the velocity w strains the particles to. kappa = 1 but for the midpoint rule, kappa = 1/2, whose
/// force f(sigma(w)) alone, mu = 1, is that of the middle: of the mean stress of both ends, on the configuration there
/// (point_update.hpp). In a scene without finite rotation that is mu = 1/2. Quasi-static: mu = kappa = 1 without the term
/// M (u - v^k).
/// Momentum form, unknown u = P^L, (3.2.4):
///   F(u) = u - P^k - dt [...],   w = v^k + kappa M^-1 M_c M^-1 (u - P^k),
/// where M_c is the consistent mass matrix: lumped M^-1 M_c M^-1 is what (3.2.6) and (3.2.7) make of a momentum.
/// Components whose velocity is prescribed have F = 0, and stay out of J: Krylov vectors are zero there, always.
/// f, the stress and J are functions of u alone: nothing here changes a particle.
class MomentumBalance {
public:
    /// Throws InputError for mu outside [0, 1], for a quasi-static momentum form or affine transfer, which has no momentum, and
    /// as check() does.
    MomentumBalance(const Scene& scene, const ImplicitScheme& scheme);

    /// Takes the particles and the step.
    void prepare(State& state, double dt);
    [[nodiscard]] std::size_t size() const { return guess_.size(); }
    /// v^k or P^k, with prescribed components at the values of the step.
    [[nodiscard]] std::span<const double> initial_guess() const { return guess_; }
    /// What the paper divides F by from Table IV on: Y dx dy dt, Y the largest of Young's moduli.
    [[nodiscard]] double paper_scale() const;

    void residual(std::span<const double> u, std::span<double> f);
    /// The same, and the norm of the impulses of the forces that act in a step with this u, as large as they are before they
    /// cancel:
    ///   dt [(1 - mu) |f|^k + mu |f(sigma(w))| + |b|]
    /// at all nodes, held ones included, where |f| sums the magnitudes of the particles' forces. A load twice as large makes it
    /// twice as large; it does not vanish at rest, nor where a body is in equilibrium.
    [[nodiscard]] double residual_and_forces(std::span<const double> u, std::span<double> f);
    /// What arithmetic leaves of a residual that should be nothing, by order of magnitude: ten units of round-off in
    /// (1 + (2 c dt/h)^2) M v^k, the momentum and what straining by it does to a stiffness of at most 4 M (c/h)^2.
    [[nodiscard]] double round_off() const;
    /// Fixes the u of jacobian_times().
    void linearise(std::span<const double> u);
    /// js = J s: J = M + mu kappa dt^2 K, or I + mu kappa dt^2 K M^-1 M_c M^-1, with the consistent tangent.
    void jacobian_times(std::span<const double> s, std::span<double> js);

    /// The change of velocity that strains the particles by a change of u: kappa times it, or kappa M^-1 M_c M^-1 times it.
    void straining_change(std::span<const double> change, std::span<double> result);

    /// The nodes' part of the end of the step; it refers to memory of this object.
    [[nodiscard]] NodalMotion motion(std::span<const double> u);
    /// Makes the step with the particles of prepare(); returns what passed in it.
    [[nodiscard]] StepEnergies advance(const NodalMotion& motion, Particles& particles);

    /// (1 - mu) f^k + mu f^L + b, and what add_held_force() adds, with the stress of the particles that advance() has moved.
    void force_at_end(std::span<double> force);

    [[nodiscard]] const Discretisation& discretisation() const { return *discretisation_; }
    [[nodiscard]] Discretisation& discretisation() { return *discretisation_; }
    [[nodiscard]] const ActiveNodes& nodes() const { return discretisation_->nodes(); }
    [[nodiscard]] const ImplicitScheme& scheme() const { return scheme_; }
    /// mu kappa dt, the factor of dt K in J.
    [[nodiscard]] double stiffness_factor() const { return scheme_.mu * kinematic_weight_ * dt_; }
    [[nodiscard]] const Particles& particles() const { return state_->particles; }

private:
    [[nodiscard]] bool momentum() const { return scheme_.form == Form::momentum; }
    [[nodiscard]] bool inertia() const { return scheme_.method != ImplicitMethod::quasi_static; }
    /// change_ = u - guess, and in velocity_ the velocity that strains the particles then.
    void find_straining_velocity(std::span<const double> u);
    void evaluate(std::span<const double> u, std::span<double> f, std::span<double> magnitudes);

    Scene scene_;
    ImplicitScheme scheme_;
    double kinematic_weight_ = 1.0;
    std::unique_ptr<Discretisation> discretisation_;
    const State* state_ = nullptr;
    double dt_ = 0.0;
    double largest_wave_speed_ = 0.0;
    aligned_vector<double> guess_, known_, change_, velocity_, work_, motion_, increment_, last_, body_force_, felt_;
    aligned_vector<double> magnitudes_, known_magnitudes_; // of internal forces; of dt [(1 - mu) f^k + b]
};

} // namespace ductile::mpm
