// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/summary.hpp>
#include <ductile/quasistatic/scene.hpp>
#include <ductile/quasistatic/step_control.hpp>
#include <ductile/quasistatic/time_stepper.hpp>
#include <ductile/run/recorder.hpp>

namespace ductile::quasistatic {

/// Steps `state` to the end: snapshots, history, progress, checkpoints; a signal ends the run with a checkpoint.
/// A checkpoint that the run goes on from restores the step control, the history and the counters. A run whose
/// checkpoint is at its end already only brings its files to their end: a kill may have come before that.
/// Fills in `summary`. Throws RunError when a step fails; what was written before is kept.
[[nodiscard]] io::RunStatus run(const Scene& scene, State& state, TimeStepper& stepper, StepControl& control,
                                const run::Outputs& outputs, const run::Files& files, io::RunSummary& summary);

/// The same steps to the end, and nothing else: no files, no signals.
void advance(const Scene& scene, State& state, TimeStepper& stepper, StepControl& control, double duration_s);

} // namespace ductile::quasistatic
