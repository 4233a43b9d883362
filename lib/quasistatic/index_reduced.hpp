#pragma once
#include <ductile/quasistatic/combination.hpp>
#include <ductile/quasistatic/method_of_lines.hpp>
#include <ductile/quasistatic/time_stepper.hpp>

#include <array>
#include <memory>
#include <span>

namespace ductile::quasistatic {

/// What the integrators of the index-reduced method of lines share: the state, its rate, velocities to extrapolate from.
///
/// A right-hand side wants a guess of v: the line through the two latest velocities of the sequence v_{n-1}, v_n, stages of the
/// current step. The sequence is part of the state: an attempt works on a copy of its own, so a rejected step leaves no trace.
class IndexReducedStepper : public TimeStepper {
public:
    IndexReducedStepper(const Scene& scene, std::unique_ptr<EquilibriumSolver> solver, const PassOptions& passes, State state);

    [[nodiscard]] double time_scale() final;
    [[nodiscard]] double limit_step(double dt) final;
    [[nodiscard]] StepAttempt attempt(double dt, double end) final;
    void accept() final;
    [[nodiscard]] const State& state() const final { return state_; }
    [[nodiscard]] StepperCounts counts() const override;
    [[nodiscard]] PhaseSeconds phase_seconds() const final;
    [[nodiscard]] std::size_t memory_bytes() const final;
    [[nodiscard]] std::vector<std::pair<std::string, Field*>> hidden_fields() final;
    [[nodiscard]] std::vector<std::pair<std::string, double*>> hidden_numbers() override;
    void resume() final;

protected:
    /// Makes the step: leaves y_{n+1} in next(), its complete rate in next_rate(), and returns the estimated error's norm.
    virtual CombinationNorm advance(double dt) = 0;
    /// The longest step that the method holds stable when the plastic flow relaxes at `relaxation`.
    [[nodiscard]] virtual double relaxation_step(double relaxation) const = 0;
    /// The longest Courant number |u| dt/dx + |v| dt/dy of stable advection. The shortest wave of the one-sided differences of
    /// Eq. (4) decays at 4 times the Courant rate.
    [[nodiscard]] virtual double courant_number() const = 0;
    /// Called once a step of length dt and of this measure has become the state.
    virtual void step_accepted(double dt, double measure) { (void)dt, (void)measure; }
    /// Number of cell states the method itself keeps.
    [[nodiscard]] virtual int buffers() const = 0;

    /// Evaluates f at `cells`, stage time t_n + fraction dt; the velocity it found is velocity() afterwards.
    void evaluate(CellState& cells, double fraction, CellState& rate);
    [[nodiscard]] const VectorField& velocity() const { return *sequence_.back().velocity; }
    /// Of the walls at t_n + fraction dt.
    [[nodiscard]] WallVelocity wall_velocity(double fraction) const;

    [[nodiscard]] const Scene& scene() const { return scene_; }
    [[nodiscard]] CellState& start() { return state_.cells; }
    [[nodiscard]] CellState& start_rate() { return rate_; }
    [[nodiscard]] CellState& next() { return next_; }
    [[nodiscard]] CellState& next_rate() { return next_rate_; }
    [[nodiscard]] double relaxation() const { return relaxation_; } ///< of the flow at the start of the step
    [[nodiscard]] EquilibriumSolver& solver() { return *solver_; }
    [[nodiscard]] MethodOfLines& lines() { return lines_; }

private:
    struct TimedVelocity {
        double fraction = 0.0; ///< of the current step
        VectorField* velocity = nullptr;
    };
    StepAttempt attempt_step(double dt, double end);
    void provide_start_rate();
    void guess_velocity(double fraction, VectorField& guess) const;

    const Scene& scene_;
    std::unique_ptr<EquilibriumSolver> solver_;
    MethodOfLines lines_;
    State state_;
    CellState rate_, next_, next_rate_;
    VectorField earlier_velocity_;              ///< v_{n-1}
    std::array<VectorField, 3> stage_velocity_; ///< the latest of the current step, in turns
    std::vector<TimedVelocity> sequence_;       ///< in the order of time
    int stage_ = 0;
    double step_begin_ = 0.0, step_length_ = 0.0, step_end_ = 0.0; ///< of the current attempt
    double earlier_step_ = 0.0;                                    ///< t_n - t_{n-1}
    double attempt_seconds_ = 0.0;
    double measure_ = 0.0;    ///< of the current attempt
    double relaxation_ = 0.0; ///< at the start of the step
    RateReport latest_;       ///< of the latest evaluation of an attempt
    WallVelocity rate_wall_;  ///< motion of the walls that rate_ belongs to
    bool started_ = false;
};

/// How SUNDIALS integrates the method of lines.
struct SundialsOptions {
    double tolerance = 1e-4; ///< of one of its steps, in the norms of the error control
    /// ARKODE takes one step an attempt; otherwise it chooses steps itself, as CVODE and IDA always do. MRIStep takes one.
    bool fixed_steps = false;
};

/// Scheme::arkode_2 ... ida, mri. Throws InputError when `scheme` has no fixed steps, or no others, but is asked for them.
[[nodiscard]] std::unique_ptr<TimeStepper> make_sundials(Scheme scheme, const Scene& scene,
                                                         std::unique_ptr<EquilibriumSolver> solver, const PassOptions& passes,
                                                         const SundialsOptions& options, State state);

/// A stepper of one EmbeddedMethod (Scheme::ralston, bogacki_shampine, dormand_prince, chebyshev), or of two (Scheme::automatic):
/// Bogacki and Shampine's, and where the plastic flow is so stiff that it holds the steps far below what `tolerance` allows for
/// long, Runge-Kutta-Chebyshev until it no longer does.
[[nodiscard]] std::unique_ptr<TimeStepper> make_embedded(Scheme scheme, const Scene& scene,
                                                         std::unique_ptr<EquilibriumSolver> solver, const PassOptions& passes,
                                                         double tolerance, State state);

} // namespace ductile::quasistatic
