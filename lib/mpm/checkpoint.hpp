// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/checkpoint.hpp>
#include <ductile/mpm/observation.hpp>
#include <ductile/mpm/scene.hpp>
#include <ductile/mpm/state.hpp>
#include <ductile/mpm/step_control.hpp>

namespace ductile::mpm {

/// The number of these programs' checkpoint format, raised when its content changes.
inline constexpr int checkpoint_format = 12;

/// The state a checkpoint holds; `start` is the program's own initial state. Throws InputError unless its particles are as many,
/// and a run can start from there, see check().
[[nodiscard]] State read_state(const io::CheckpointReader& checkpoint, const Scene& scene, const State& start);

/// Restores the plan of the steps and the numbers of the tally, each of which must be there.
void restore(const io::CheckpointReader& checkpoint, StepControl& control, Tally& tally);

/// Puts into a checkpoint what these two read; the views are those of the arguments.
void describe(const State& state, const StepControl& control, const Tally& tally, io::Checkpoint& content);

} // namespace ductile::mpm
