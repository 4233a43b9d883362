// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/run/recorder.hpp>

namespace ductile::run {

/// Steps to the last output time: rows, snapshots, progress, checkpoints; a signal ends the run with a checkpoint. Where a
/// checkpoint that it goes on from is at the end already, the run only brings its files to their end: a kill may have come before
/// that. Fills in `summary`. Throws the RunError that ended a run, with the advice to go on from the last good state, which is
/// kept.
[[nodiscard]] io::RunStatus loop(Simulation& simulation, const Outputs& outputs, const Files& files, io::RunSummary& summary);

} // namespace ductile::run
