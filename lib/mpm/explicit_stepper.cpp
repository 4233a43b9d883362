// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/timer.hpp>
#include <ductile/mpm/time_stepper.hpp>

namespace ductile::mpm {

namespace {

class ExplicitStepper final : public TimeStepper {
public:
    ExplicitStepper(const Scene& scene, Form form) : step_(scene, form) {}

    StepOutcome attempt(State& state, double dt, double end) override {
        Timer timer;
        const StepEnergies energies = step_.advance(state, dt, end);
        seconds_ += timer.seconds();
        return {.accepted = true, .energies = energies};
    }
    [[nodiscard]] const Discretisation& discretisation() const override { return step_.discretisation(); }
    [[nodiscard]] std::span<const double> force() override { return step_.force(); }
    [[nodiscard]] SolverCounts counts() const override { return {}; }
    [[nodiscard]] PhaseSeconds phase_seconds() const override { return {{"steps", seconds_}}; }
    [[nodiscard]] std::size_t memory_bytes() const override { return step_.discretisation().memory_bytes(); }

private:
    ExplicitStep step_;
    double seconds_ = 0.0;
};

} // namespace

std::unique_ptr<TimeStepper> make_explicit_stepper(const Scene& scene, Form form) {
    return std::make_unique<ExplicitStepper>(scene, form);
}

} // namespace ductile::mpm
