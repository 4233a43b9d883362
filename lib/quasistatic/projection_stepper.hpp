// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/quasistatic/projection.hpp>
#include <ductile/quasistatic/time_stepper.hpp>

#include <memory>
#include <optional>

namespace ductile::quasistatic {

/// Tolerances A and R of the pointwise integration, in natural units: F dt^2 (Sec. 8.1, fixed steps) or F h^2 (Sec. 8.2, adaptive
/// steps; h^2 = dx dy), not below 1e-16 and 1e-17.
struct PointwiseTolerance {
    enum class Scale { step, cell };
    Scale scale = Scale::step;
    double factor = 1e-7; ///< F_RK2(1): 1e-7 with steps, 0.1 with cells

    [[nodiscard]] Rk21Options options(const Grid& grid, double dt) const;
};

/// Where the predictor takes spin, advection and its velocity: at t_n as in the paper, or in the middle of the step.
enum class Transport { frozen, extrapolated };

/// The projection schemes of Lu & Rycroft: one global step is a predictor followed by the projection.
///   euler, substepped (Sec. 4.2): v_{n+1} = (affine wall motion) + phi;
///   incremental (Sec. 5.2):       q <- q + phi, v_{n+1} = q (Eqs. 31, 32; v and q are one array).
/// With Transport::extrapolated the predictor sees, instead of the fields at t_n and of v_n (which is the velocity in the middle
/// of step n), linear extrapolations to the middle of the new step of length dt, with dt_n, dt_{n-1} the steps before:
///   sigma_n + dt/(2 dt_n) (sigma_n - sigma_{n-1}),  q = v_n + (dt + dt_n)/(dt_n + dt_{n-1}) (v_n - v_{n-1}),
/// so that spin and advection, frozen over a step, are right to second order. The first step has no past and is the paper's.
/// Walls that change their velocity shift q by an affine field first; the wall velocity of a step is its mean over the step.
/// Walls under force control move such that the mean of sigma_{n+1} is the traction at the end of the step (walls.hpp): the
/// affine field that takes belongs to the correction.
///
/// The error of a step (StepAttempt::error) is estimated from what the step finds anyway, in the norm (59), as a sum of
/// - what the pointwise integration leaves, where it integrates: sqrt(10) E (A + R) of the worst substep, E by (B.2): an error of
///   E (A + R) in the mean of five components, all of it in tau, has the norm sqrt(2) sqrt(5) E (A + R);
/// - what joins the stress after plastic flow was integrated without it, as far as any cell flows: the flow would have relaxed
///   the more of it the faster it is, so that it is an error of its own size where dt times the relaxation rate is large, and
///   less where steps are short. incremental: dt C : D(phi), of norm sqrt(2) mu Q* (its pressure is the smaller part); the
///   others: the whole of dt C : D(v), that and dt C : D_w of the walls, but where no cell flowed yet no more than what is
///   beyond yield now;
/// - in the full model with frozen transport, the spin of a stress that changes during the step by the walls' dt C : D_w, which
///   they turn by omega dt meanwhile: omega dt |dt C : D_w|/2.
/// euler takes no substeps; its error is the half of dt^2 d^2(sigma, chi)/dt^2, the difference of two increments:
///   e = |dy_n - (dt_n/dt_{n-1}) dy_{n-1}| dt_n/(dt_n + dt_{n-1}),  dy_n = y_n - y_{n-1},
/// looked at where the increment dt C : D(v) is long enough to matter; its first step is judged as those of substepped are.
class ProjectionStepper final : public TimeStepper {
public:
    /// Owns the space and all buffers.
    ProjectionStepper(const Scene& scene, Predictor predictor, const PointwiseTolerance& pointwise, std::unique_ptr<Space> space,
                      Transport transport = Transport::frozen);

    [[nodiscard]] std::string_view scheme() const override;
    [[nodiscard]] Space& space() const override { return *space_; }
    void adopt(State& state) const override;
    StepAttempt attempt(State& state, double dt, double end, const Judge& judge, const Within& within) override;
    [[nodiscard]] bool leaves_velocity_of_middle() const override { return true; }
    [[nodiscard]] double frozen_transport(State& state) override;
    [[nodiscard]] StepperCounts counts() const override;
    [[nodiscard]] PhaseSeconds phase_seconds() const override;
    [[nodiscard]] std::size_t memory_bytes() const override;

private:
    /// Of walls under force control, if nothing flowed.
    [[nodiscard]] WallVelocity elastic_walls(const WallRates& told) const;
    StepAttempt make_step(State& state, double dt, double end, const Judge& judge);
    [[nodiscard]] double estimate_error(State& state, double dt, const WallVelocity& wall, double measure,
                                        const Rk21Counts& counts);
    [[nodiscard]] double change_of_increment(State& state, double dt);
    void accept(State& state, double dt, double end);
    [[nodiscard]] bool freezes_transport() const { return scene_.model == Model::full && !extrapolated(); }
    [[nodiscard]] bool extrapolated() const { return transport_ == Transport::extrapolated; }

    Scene scene_;
    Predictor predictor_;
    PointwiseTolerance pointwise_;
    std::unique_ptr<Space> space_;
    Transport transport_;
    Projection projection_;
    CellState next_;
    CellState middle_; ///< with Transport::extrapolated sigma in the middle of the step, with frozen transport room for its error
    VectorField base_velocity_;            ///< v_n with the walls' new velocity, where that differs, or extrapolated
    std::optional<State> before_, within_; ///< the state before a step, and what a shorter one makes of it
    VectorField correction_;               ///< force, then phi, then the new velocity
    long long substeps_ = 0, rejected_substeps_ = 0;
    double predictor_seconds_ = 0.0, velocity_seconds_ = 0.0;
};

} // namespace ductile::quasistatic
