// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/sundials/erk.hpp>
#include <ductile/time/flat_stages.hpp>

namespace ductile::time {

/// An explicit Runge-Kutta method of ARKODE.
template <class Vector> class Arkode final : public Method<Vector> {
public:
    /// `options` says which; tolerances and the length of fixed steps are set here.
    Arkode(System<Vector>& system, const InnerSteps& steps, sundials::ErkOptions options = {})
        : system_(system), stages_(system, steps),
          erk_([this](double t, std::span<const double> y, std::span<double> rate) { stages_.rate(t, y, rate); }, stages_.size(),
               complete(std::move(options), steps)) {}

    [[nodiscard]] double advance(const Step<Vector>& step) override {
        const std::span<double> values = stages_.begin(step);
        erk_.integrate(values, 0.0, step.dt, {}, stages_.dense(step));
        system_.unpack(values, step.next);
        return stages_.finish(step);
    }
    [[nodiscard]] InnerCounts inner_counts() const override { return {erk_.counts().steps, erk_.counts().rejected}; }
    [[nodiscard]] int buffers() const override { return stages_.buffers; }

private:
    [[nodiscard]] sundials::ErkOptions complete(sundials::ErkOptions options, const InnerSteps& steps) const {
        options.relative_tolerance = 0.0;
        options.absolute_tolerance = stages_.component_tolerance();
        if (steps.fixed) // longer than any step: one inner step a step
            options.fixed_step = std::numeric_limits<double>::max();
        return options;
    }

    System<Vector>& system_;
    FlatStages<Vector> stages_;
    sundials::ErkIntegrator erk_;
};

} // namespace ductile::time
