// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/quasistatic/rate_system.hpp>
#include <ductile/sundials/mri.hpp>
#include <ductile/time/flat_stages.hpp>

namespace ductile::quasistatic {

namespace {

/// Multirate: slow is what the elliptic solve and transport contribute, fast the plastic flow.
class Mri final : public CellMethod {
public:
    Mri(RateSystem& system, double tolerance)
        : system_(system), stages_(system, {.tolerance = tolerance, .fixed = true, .poll = end_if_interrupted}),
          force_(system.space().make_velocity()), pointwise_{.absolute_tolerance = tolerance,
                                                             .relative_tolerance = tolerance,
                                                             .exact_components = 1},
          plastic_(system.make()),
          mri_({.components = stages_.size(),
                .slow = [this](double t, std::span<const double> y, std::span<double> rate) { slow(t, y, rate); },
                .fast =
                    [this](double, std::span<const double> y, std::span<double> rate) {
                        system_.unpack(y, stages_.stage());
                        system_.space().plastic_rate(stages_.stage(), plastic_);
                        system_.pack(plastic_, rate);
                    },
                .advance_fast = [this](double duration, std::span<const double> forcing,
                                       std::span<double> y) { relax_cells(duration, forcing, y); }}) {}

    [[nodiscard]] double advance(const time::Step<CellState>& step) override {
        const std::span<double> values = stages_.begin(step);
        mri_.integrate(values, 0.0, step.dt);
        system_.unpack(values, step.next);
        system_.put_into_equilibrium(step.next, 1.0, force_); // splitting leaves the constraint by its error
        return stages_.finish(step);
    }
    [[nodiscard]] bool interpolates() const override { return true; }
    void interpolate(const time::Step<CellState>& step, double fraction, CellState& y) const override {
        system_.combine(time::cubic_within(step, fraction), y);
    }
    [[nodiscard]] time::InnerCounts inner_counts() const override { return {mri_.counts().steps, mri_.counts().rejected}; }
    [[nodiscard]] int buffers() const override { return stages_.buffers; }

private:
    void slow(double t, std::span<const double> y, std::span<double> rate) {
        if (t == 0.0) {
            system_.unpack(y, stages_.stage());
            system_.combine(std::array{Space::Term{&stages_.start_rate(), 1.0}}, stages_.stage_rate());
        } else if (!stages_.evaluate(t, y)) {
            std::ranges::fill(rate, std::numeric_limits<double>::quiet_NaN());
            return;
        }
        system_.space().plastic_rate(stages_.stage(), plastic_);
        system_.combine(std::array{Space::Term{&stages_.stage_rate(), 1.0}, Space::Term{&plastic_, -1.0}}, stages_.stage_rate());
        system_.pack(stages_.stage_rate(), rate);
    }

    void relax_cells(double duration, std::span<const double> forcing, std::span<double> y) {
        system_.unpack(y, stages_.stage());
        system_.unpack(forcing, stages_.stage_rate());
        const Rk21Counts counts = system_.space().relax(stages_.stage_rate(), duration, pointwise_, stages_.stage());
        system_.count_substeps(counts);
        if (counts.failed)
            std::ranges::fill(y, std::numeric_limits<double>::quiet_NaN());
        else
            system_.pack(stages_.stage(), y);
    }

    RateSystem& system_;
    time::FlatStages<CellState> stages_;
    VectorField force_; ///< room to work in
    Rk21Options pointwise_;
    CellState plastic_;
    sundials::MriIntegrator mri_;
};

} // namespace

std::unique_ptr<CellMethod> make_mri(RateSystem& system, double tolerance) { return std::make_unique<Mri>(system, tolerance); }

} // namespace ductile::quasistatic
