// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/quasistatic/rate_system.hpp>
#include <ductile/sundials/cvode.hpp>
#include <ductile/time/flat_stages.hpp>

#include <functional>

namespace ductile::quasistatic {

namespace {

class Cvode final : public CellMethod {
public:
    Cvode(RateSystem& system, CvodeFormulas formulas, double tolerance)
        : system_(system), stages_(system, {.tolerance = tolerance, .poll = end_if_interrupted}),
          force_(system.space().make_velocity()),
          cvode_([this](double t, std::span<const double> y, std::span<double> rate) { stages_.rate(t, y, rate); },
                 stages_.size(), options(formulas)) {}

    [[nodiscard]] double advance(const time::Step<CellState>& step) override {
        const std::span<double> values = stages_.begin(step);
        cvode_.integrate(values, 0.0, step.dt, {}, stages_.dense(step));
        system_.unpack(values, step.next);
        return stages_.finish(step);
    }
    [[nodiscard]] time::InnerCounts inner_counts() const override { return {cvode_.counts().steps, cvode_.counts().rejected}; }
    [[nodiscard]] int buffers() const override { return stages_.buffers; }

private:
    [[nodiscard]] sundials::CvodeOptions options(CvodeFormulas formulas) {
        sundials::CvodeOptions options{.method = sundials::CvodeMethod::adams,
                                       .solver = sundials::CvodeSolver::fixed_point,
                                       .relative_tolerance = 0.0,
                                       .absolute_tolerance = stages_.component_tolerance()};
        if (formulas == CvodeFormulas::adams)
            return options;
        options.method = sundials::CvodeMethod::bdf;
        options.solver = sundials::CvodeSolver::krylov;
        options.projection = [this](double t, std::span<const double> y, std::span<double> correction) {
            system_.unpack(y, stages_.stage());
            system_.put_into_equilibrium(stages_.stage(), t / system_.step_length(), force_);
            system_.pack(stages_.stage(), correction);
            std::ranges::transform(correction, y, correction.begin(), std::minus<>());
        };
        return options;
    }

    RateSystem& system_;
    time::FlatStages<CellState> stages_;
    VectorField force_; ///< room to work in
    sundials::CvodeIntegrator cvode_;
};

} // namespace

std::unique_ptr<CellMethod> make_cvode(RateSystem& system, CvodeFormulas formulas, double tolerance) {
    return std::make_unique<Cvode>(system, formulas, tolerance);
}

} // namespace ductile::quasistatic
