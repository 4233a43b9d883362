// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/summary.hpp>
#include <ductile/mpm/monitor.hpp>
#include <ductile/mpm/observation.hpp>
#include <ductile/mpm/scene.hpp>
#include <ductile/mpm/state.hpp>
#include <ductile/mpm/step_control.hpp>
#include <ductile/mpm/time_stepper.hpp>
#include <ductile/run/recorder.hpp>

#include <string>
#include <vector>

namespace ductile::mpm {

/// A scene with what its program wants to see of it.
struct Problem {
    Scene scene = {};
    State start = {};
    std::vector<Observable> observables = {};
    /// The curve for the terminal: names of two columns, and their labels.
    std::string curve_x = {}, curve_y = {}, label_x = {}, label_y = {};
    Conclusions conclusions = {};
};

/// Steps to the end, each ending at the next output time at most: snapshots, history, progress, checkpoints; a signal ends the
/// run with a checkpoint. A step that fails is tried again with half its length. Where a checkpoint that the
/// run goes on from is at the end already, it only brings its files to their end: a kill may have come before that. Fills in
/// `summary`. Throws InputError for a state that no run can start from, see check(), and RunError when steps keep
/// failing or are too short to change the time; what was written before is kept.
[[nodiscard]] io::RunStatus run(const Problem& problem, State& state, TimeStepper& stepper, StepControl& control,
                                const run::Outputs& outputs, const Monitor::Options& monitor, const run::Files& files,
                                io::RunSummary& summary);

} // namespace ductile::mpm
