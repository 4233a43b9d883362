#pragma once
#include <ductile/equilibrium/solver.hpp>
#include <ductile/quasistatic/predictor.hpp>
#include <ductile/quasistatic/projection.hpp>
#include <ductile/quasistatic/scene.hpp>

#include <memory>

namespace ductile::quasistatic {

struct StepReport {
    double projection_measure = 0.0; ///< Q* of the step, see Projection::apply
    Rk21Counts substeps;
};

/// Wall seconds by phase since construction.
struct PhaseSeconds {
    double predictor = 0.0; ///< sources, pointwise integration, divergence
    double solve = 0.0;     ///< elliptic solve
    double update = 0.0;    ///< stress and velocity corrections
};

/// The projection schemes of Lu & Rycroft: one global step is a predictor followed by the projection.
///   euler, substepped (Sec. 4.2): v_{n+1} = (affine wall motion) + phi;
///   incremental (Sec. 5.2):       q <- q + phi, v_{n+1} = q (Eqs. 31, 32; v and q are one array).
/// Walls that change their velocity shift q by an affine field first; the wall velocity of a step is its mean over the step.
class ProjectionStepper {
public:
    /// Keeps references to `scene`; owns the solver and all buffers. `state` is the state to go on from.
    ProjectionStepper(const Scene& scene, Predictor predictor, std::unique_ptr<EquilibriumSolver> solver, State state);

    /// One step of length dt > 0 to the time `end` (which may differ from the sum by round-off: steps land on targets). `options`
    /// are the tolerances of the pointwise integration. Throws RunError (where, when, what to change) when the result is not
    /// finite.
    StepReport step(double dt, double end, const Rk21Options& options);

    [[nodiscard]] const State& state() const { return state_; }
    [[nodiscard]] PhaseSeconds phase_seconds() const;
    [[nodiscard]] long long elliptic_solves() const { return projection_.solves(); }
    /// Bytes of state, buffers and solver.
    [[nodiscard]] std::size_t memory_bytes() const;

private:
    const Scene& scene_;
    Predictor predictor_;
    std::unique_ptr<EquilibriumSolver> solver_;
    Projection projection_;
    State state_;
    CellState next_;
    VectorField correction_; // force, then phi, then the new velocity
    double predictor_seconds_ = 0.0, velocity_seconds_ = 0.0;
};

} // namespace ductile::quasistatic
