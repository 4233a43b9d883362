// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/timer.hpp>
#include <ductile/mpm/explicit_step.hpp>
#include <ductile/mpm/momentum_balance.hpp>
#include <ductile/mpm/newton.hpp>
#include <ductile/mpm/preconditioner.hpp>
#include <ductile/mpm/step_energies.hpp>

#include <memory>
#include <span>
#include <string>

namespace ductile::mpm {

/// Why a step was not accepted.
enum class StepFailure { none, no_convergence, folded_grid, far_particle, leaving_particle };

/// What an attempted step came to.
struct StepOutcome {
    bool accepted = false;
    StepFailure failure = StepFailure::none;
    std::string reason = {};           ///< why it was not, in words
    double smallest_determinant = 1.0; ///< of the deformation of the step at any particle
    int newton_iterations = 0;
    int linear_iterations = 0;
    StepEnergies energies = {};
};

/// A time integrator of material points.
class TimeStepper {
public:
    virtual ~TimeStepper() = default;
    /// One step of dt seconds to the time `end` (which may differ from the sum by round-off: steps land on output times). Either
    /// it is accepted and `state` is at its end, or `state` is as before (but for the order of its particles in memory) and the
    /// outcome says why. Throws RunError where a shorter step is no help.
    virtual StepOutcome attempt(State& state, double dt, double end) = 0;

    /// As of the beginning of the last step.
    [[nodiscard]] virtual const Discretisation& discretisation() const = 0;
    /// The force F on the nodes in the last accepted step, as contact_force() takes it: f + b as the step weighs its beginning
    /// and end. Valid until the next attempt; the particles must be where that step left them.
    [[nodiscard]] virtual std::span<const double> force() = 0;
    [[nodiscard]] virtual SolverCounts counts() const = 0;
    /// Since construction.
    [[nodiscard]] virtual PhaseSeconds phase_seconds() const = 0;
    [[nodiscard]] virtual std::size_t memory_bytes() const = 0;
};

[[nodiscard]] std::unique_ptr<TimeStepper> make_explicit_stepper(const Scene& scene, Form form);

/// Which nonlinear solver an implicit step uses.
enum class SolverKind { newton_cg, newton_gmres, kinsol_gmres, kinsol_fgmres, kinsol_bicgstab, kinsol_cg };

/// What |F| is measured by.
enum class ResidualScale {
    forces,        ///< the forces that act in the step: MomentumBalance::residual_and_forces()
    stiffness,     ///< Y dx dy dt, Tables IV-VI of the paper
    stiffness_rms, ///< the same for the root mean square of F
    none           ///< nothing, Tables I-III
};

struct ImplicitOptions {
    ImplicitScheme scheme = {};
    SolverKind solver = SolverKind::newton_gmres;
    NewtonOptions newton = {};
    PreconditionerKind preconditioner = PreconditionerKind::diagonal;
    ResidualScale scale = ResidualScale::forces;
    /// Newton's loop even where the scene is linear, as the paper counts it.
    bool always_newton = false;
};

/// The implicit step of Sec. 2.4 and 3.2: prepares the particles' weights, solves MomentumBalance for the nodes, refuses results
/// that fold the grid (the determinant of the step's deformation gradient is not positive at a particle: the Lagrangian limit),
/// move a particle by more than two cells, or take it out of the grid, and only then moves the particles. Throws InputError for a
/// combination that cannot work.
[[nodiscard]] std::unique_ptr<TimeStepper> make_implicit_stepper(const Scene& scene, const ImplicitOptions& options);

} // namespace ductile::mpm
