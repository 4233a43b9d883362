// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/time/method.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

namespace ductile::time {

/// Two methods, the estimates of both of which fall with dt^3: a common one, and one for stiff flow that takes over where this
/// would go as far as `tolerance` of the error of a step allows with many times fewer right-hand sides, and gives back where it
/// no longer helps. State and rate are all that a step leaves, so that nothing is lost when one hands over to the other.
template <class Vector> class Switching final : public Method<Vector> {
public:
    struct Named {
        std::string name;
        std::unique_ptr<Method<Vector>> method;
    };
    Switching(Named common, Named stiff, double tolerance)
        : methods_{std::move(common), std::move(stiff)}, tolerance_(tolerance) {}

    [[nodiscard]] double advance(const Step<Vector>& step) override { return in_use(step.memory).advance(step); }

    [[nodiscard]] bool interpolates() const override {
        return methods_[0].method->interpolates() && methods_[1].method->interpolates();
    }
    void interpolate(const Step<Vector>& step, double fraction, Vector& y) const override {
        in_use(step.memory).interpolate(step, fraction, y);
    }

    [[nodiscard]] std::vector<std::string> memory() const override {
        return {methods_[1].name + "_in_use", "steps_for_a_change", "steps_" + methods_[0].name, "steps_" + methods_[1].name};
    }

    void accept(double dt, double error, double relaxation, std::span<double> memory) const override {
        double &stiff_in_use = memory[0], &steps_for_a_change = memory[1];
        ++memory[stiff_in_use == 0.0 ? 2 : 3];
        steps_for_a_change = speaks_for_the_other(stiff_in_use != 0.0, dt, error, relaxation) ? steps_for_a_change + 1.0 : 0.0;
        if (steps_for_a_change < patience)
            return;
        stiff_in_use = 1.0 - stiff_in_use;
        steps_for_a_change = 0.0;
    }

    [[nodiscard]] std::vector<std::pair<std::string, long long>> steps_by_method(std::span<const double> memory) const override {
        // what a damaged file makes of a count is none
        const auto whole = [](double count) { return count >= 0.0 && count < 9e15 ? static_cast<long long>(count) : 0; };
        return {{methods_[0].name, whole(memory[2])}, {methods_[1].name, whole(memory[3])}};
    }

    [[nodiscard]] double relaxation_step(double relaxation, std::span<const double> memory) const override {
        return in_use(memory).relaxation_step(relaxation, {});
    }
    [[nodiscard]] double courant_number(std::span<const double> memory) const override {
        return in_use(memory).courant_number({});
    }
    [[nodiscard]] int buffers() const override { return methods_[0].method->buffers() + methods_[1].method->buffers(); }

private:
    /// Steps in a row that must speak for the other method before it takes over.
    static constexpr int patience = 20;
    /// The stabilised method takes over where it would make the same way with so many times fewer right-hand sides, and gives
    /// back where a step has so few stages that it could be the other's.
    static constexpr double worthwhile = 8.0, few_stages = 3.0;

    [[nodiscard]] Method<Vector>& in_use(std::span<const double> memory) const {
        return *methods_[memory[0] == 0.0 ? 0 : 1].method;
    }

    [[nodiscard]] bool speaks_for_the_other(bool stiff_in_use, double dt, double error, double relaxation) const {
        const Method<Vector>&common = *methods_[0].method, &stiff = *methods_[1].method;
        const double stable = common.relaxation_step(relaxation, {});
        if (stiff_in_use)
            return stiff.evaluations(dt, relaxation) <= few_stages && dt <= stable;
        // what the error would allow: both estimates fall with dt^3
        const double accurate =
            std::min(dt * std::cbrt(tolerance_ / std::max(error, 1e-6 * tolerance_)), stiff.relaxation_step(relaxation, {}));
        return common.evaluations(stable, relaxation) / stable > worthwhile * stiff.evaluations(accurate, relaxation) / accurate;
    }

    std::array<Named, 2> methods_;
    double tolerance_; ///< of the error of a step
};

} // namespace ductile::time
