#pragma once
#include <ductile/mpm/state.hpp>

#include <string_view>

namespace ductile::mpm {

/// Chooses the steps: from a first one up to the target by a constant factor (the paper's 20 % ramp), shorter where a rigid body
/// would travel a cell or more (it would pass through what it is to push, without an error), half as long after a failure.
class StepControl {
public:
    struct Options {
        double target = 0.0; ///< [s]
        double first = 0.0;  ///< [s]
        double growth = 1.2; ///< at most, from step to step
        double cell_x = 0.0, cell_y = 0.0;
    };
    struct Step {
        double dt = 0.0;
        std::string_view limit = {}; ///< what limits it, for the progress line
    };

    explicit StepControl(const Options& options) : options_(options), next_(options.first) {}

    [[nodiscard]] Step next(const State& state) const;
    void accepted(const Step& step);
    /// Halves the step; false once it is 2^-30 of the target: then it is no use going on.
    [[nodiscard]] bool failed(const Step& step);

    [[nodiscard]] const Options& options() const { return options_; }
    /// What a checkpoint must hold: the length of the next step, and whether a failure limits it.
    [[nodiscard]] double planned() const { return next_; }
    [[nodiscard]] bool recovering() const { return recovering_; }
    void restore(double planned, bool recovering) {
        next_ = planned;
        recovering_ = recovering;
    }

private:
    Options options_;
    double next_;
    bool recovering_ = false;
};

} // namespace ductile::mpm
