// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/quasistatic/state.hpp>
#include <ductile/quasistatic/time_stepper.hpp>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace ductile::quasistatic {

/// What a run knows about its own accuracy, from every step and whatever rows it writes: the largest estimated error of a step
/// (StepAttempt::error) and the largest residual of equilibrium (Space::equilibrium_residual, looked at every few steps and
/// at the end), under force control the largest speed of the walls, which nobody prescribes, and the ledger of energy.
///
/// Schemes that freeze spin and advection over a step (TimeStepper::frozen_transport) are off by what that adds up to, which no
/// plastic flow relaxes and no single step shows: the sum of dt^2 |[spin - advection]^2 y|/2, looked at as often. It exceeds what
/// is delivered by three where advection is all there is to it (cells a hundred times as high as wide, 0.1 of one a step).
///
/// Errors of steps add up where the solution does not forget them, and grow where it localises; a single one of 0.1 s_Y is no
/// answer any more, one of 0.01 must be known to whoever reads the numbers. The projection leaves a residual of round-off, or
/// with the stiffness (S.20) one of up to 3e-4 where fields are smooth (16 cells a side, less on finer grids), which changes
/// nothing; 2 % of cellwise noise in chi make it 0.06 and the stress 2 % wrong.
///
/// A space that does not show a band gives it another width and place, and flow that localises amplifies that: what the finest
/// scales hold of the plastic strain rate, at any time, tells, where what they hold of the fields at the end does not (six scenes
/// on up to 16 spaces of both kinds, verification/space.py: runs above 0.16 were 8e-3 to 1e-1 of the yield stress wrong, runs
/// below it at most 1.1e-2).
///
/// What the elastic energy has grown by should be what the walls have done less what plastic flow has dissipated (EnergyFlow).
/// Work and dissipation are integrated as the state is: Runge-Kutta methods and SUNDIALS count them with their stages, so that
/// without transport the difference is the error of the integration, of its order; projection schemes count both with the stress
/// in the middle of the step (that of the predictor, where flow is concerned), which leaves their order. In the full model what
/// differences make of advection comes on top: it falls with the cells.
class AccuracyWatch {
public:
    static constexpr double largest_error = 0.1;      ///< a step whose estimated error exceeds it ends the run
    static constexpr double doubtful_error = 0.01;    ///< above it the summary warns
    static constexpr double doubtful_residual = 1e-3; ///< above it the summary warns
    static constexpr double doubtful_energy = 0.01;   ///< of the work; above it the summary warns
    static constexpr double doubtful_move = 1e-4; ///< edge_corrections(); above it the summary warns: localised flow amplifies it
    static constexpr double unresolved = 0.015;   ///< at the end, of Space::unresolved; above it the summary warns
    static constexpr double unresolved_flow = 0.16; ///< ever, of Space::unresolved_flow; above it the summary warns
    static constexpr int residual_interval = 64;    ///< steps from one look at the residual to the next
    static constexpr int flow_interval = 16;        ///< from one look at the flow to the next

    AccuracyWatch(const Scene& scene, const Space& space);

    /// A run begins with this state.
    void begin(const State& state);
    /// Takes note of an attempted step of length dt from `time`. Throws RunError (figure, time, what to change) where its
    /// estimated error exceeds largest_error; the stepper then still has the state before it.
    void judge(const StepAttempt& attempt, double time, double dt);
    /// Takes note of an accepted state, unless it is none of those that are looked at. Throws RunError where walls under force
    /// control outrun shear waves.
    void observe(State& state, bool last, TimeStepper& stepper);

    /// Edges of elements have moved, after which equilibrium took a change of stress of this share of itself.
    void edges_moved(double correction) {
        ++edge_moves_;
        edge_corrections_ += correction;
    }
    [[nodiscard]] double edge_moves() const { return edge_moves_; }
    /// The sum of all.
    [[nodiscard]] double edge_corrections() const { return edge_corrections_; }

    /// Elastic energy that nothing accounts for, of the domain.
    [[nodiscard]] double energy_error(double elastic_energy, const EnergyFlow& passed) const {
        return elastic_energy - elastic_energy_ - passed.work + passed.dissipation;
    }
    /// The same, of the work that walls have done or taken, or of the energy at the start if that is more.
    [[nodiscard]] double relative_energy_error(double elastic_energy, const EnergyFlow& passed) const;

    /// The largest seen of Space::unresolved_flow, either way.
    [[nodiscard]] double worst_flow() const { return std::max(flow_.x, flow_.y); }

    /// Sentences for the end of the run, with figures and what to change.
    [[nodiscard]] std::vector<std::string> warnings() const;
    /// That of a ledger that does not close, or does because what advection and what the steps leave open cancel; none otherwise.
    [[nodiscard]] std::optional<std::string> ledger_warning(double elastic_energy, const EnergyFlow& passed) const;

    /// The numbers that a checkpoint must hold.
    [[nodiscard]] std::vector<std::pair<std::string, double*>> hidden_numbers();

private:
    void observe_walls(const State& state);
    void observe_flow(const State& state);

    Unresolved unresolved_; // at the end
    Scene scene_;
    const Space& space_;
    VectorField force_; // room for the residual
    Field rate_;        // and for the flow
    double error_ = 0.0, error_time_ = 0.0, error_step_ = 0.0;
    double residual_ = 0.0, residual_time_ = 0.0;
    double frozen_ = 0.0, frozen_before_ = 0.0; // sum of errors by frozen transport, and frozen_transport() at the last look
    double time_ = 0.0, squares_ = 0.0;         // of the last step, and the squares of the steps' lengths since that look
    double wall_speed_ = 0.0, wall_speed_time_ = 0.0; // under force control
    double elastic_energy_ = 0.0;                     // at the start
    double work_ = 0.0, work_magnitude_ = 0.0;        // at the last step, and the sum of magnitudes of all steps
    double edge_moves_ = 0.0, edge_corrections_ = 0.0;
    Unresolved flow_;                              // the largest so far
    double flow_x_time_ = 0.0, flow_y_time_ = 0.0; // when it was
};

} // namespace ductile::quasistatic
