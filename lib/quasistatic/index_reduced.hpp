// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/quasistatic/rate_system.hpp>
#include <ductile/quasistatic/time_stepper.hpp>

#include <functional>
#include <memory>
#include <optional>

namespace ductile::quasistatic {

/// Makes the method of a stepper on its system.
using MakeCellMethod = std::function<std::unique_ptr<CellMethod>(RateSystem& system)>;

/// A one-step method on the index-reduced method of lines. The memory of its states: the complete rate and what the
/// walls were told for it, the velocity and the step before, the relaxation rate, and what the method remembers.
class IndexReducedStepper final : public TimeStepper {
public:
    IndexReducedStepper(std::string scheme, const Scene& scene, std::unique_ptr<Space> space, const PassOptions& passes,
                        const MakeCellMethod& make_method);

    [[nodiscard]] std::string_view scheme() const override { return scheme_; }
    [[nodiscard]] Space& space() const override { return *space_; }
    void adopt(State& state) const override;
    [[nodiscard]] double time_scale(State& state) override;
    [[nodiscard]] double limit_step(State& state, double dt) override;
    void renew(State& state) override;
    StepAttempt attempt(State& state, double dt, double end, const Judge& judge, const Within& within) override;
    [[nodiscard]] StepperCounts counts() const override;
    [[nodiscard]] PhaseSeconds phase_seconds() const override;
    [[nodiscard]] std::size_t memory_bytes() const override;
    [[nodiscard]] std::vector<std::pair<std::string, long long>> steps_by_method(const State& state) const override;

private:
    void provide_rate(State& state);
    /// Shows `cells` at a fraction of the current step, with the velocity that belongs to them.
    void show(const State& state, double fraction, double time, const Within& within);
    void accept(State& state, double dt, double end, double error);

    std::string scheme_;
    Scene scene_;
    std::unique_ptr<Space> space_;
    RateSystem system_;
    std::unique_ptr<CellMethod> method_;
    CellState next_, next_rate_;
    std::optional<State> within_;          ///< the state that is shown within a step
    std::optional<CellState> rate_within_; ///< room to work in for its velocity
    std::vector<double> fractions_;        ///< of the step: the times within
    std::vector<CellState> passed_;        ///< there, where the method does not interpolate
    double attempt_seconds_ = 0.0;
};

} // namespace ductile::quasistatic
