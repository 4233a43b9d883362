// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/checkpoint.hpp>
#include <ductile/quasistatic/accumulation.hpp>
#include <ductile/quasistatic/accuracy_watch.hpp>
#include <ductile/quasistatic/state.hpp>
#include <ductile/quasistatic/step_control.hpp>
#include <ductile/quasistatic/time_stepper.hpp>

namespace ductile::quasistatic {

/// The number of this program's checkpoint format, raised when its content changes.
inline constexpr int checkpoint_format = 14;

/// The state a checkpoint holds. Throws InputError when it has another grid or another internal variable.
[[nodiscard]] State read_state(const io::CheckpointReader& checkpoint, const Scene& scene, Space& space);

/// Restores what a checkpoint holds besides: what is known of the accuracy so far; step control and the memory of the state,
/// unless they belong to another scheme or step control than the run's (then the run goes on from the bare state).
void restore(const io::CheckpointReader& checkpoint, const Scene& scene, const TimeStepper& stepper, State& state,
             StepControl& control, AccuracyWatch& watch);

/// Restores what has accumulated. Returns false, and changes nothing, where the checkpoint does not hold it.
[[nodiscard]] bool restore(const io::CheckpointReader& checkpoint, Accumulation& accumulation);

/// Puts into a checkpoint what these three read; the views are those of the state and of what has accumulated.
void describe(const Scene& scene, State& state, StepControl& control, AccuracyWatch& watch, io::Checkpoint& content);
void describe(Accumulation& accumulation, io::Checkpoint& content);

} // namespace ductile::quasistatic
