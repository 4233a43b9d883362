#pragma once
#include <ductile/io/checkpoint.hpp>
#include <ductile/io/output_folder.hpp>
#include <ductile/io/program.hpp>
#include <ductile/io/summary.hpp>
#include <ductile/quasistatic/scene.hpp>
#include <ductile/quasistatic/step_control.hpp>
#include <ductile/quasistatic/time_stepper.hpp>

#include <vector>

namespace ductile::quasistatic {

/// When a run ends and what it writes on the way; times in SI.
struct RunOptions {
    double duration_s = 0.0;
    std::vector<double> snapshots_s; ///< in any order; those beyond the end are left out
    int history_every = 1;           ///< rows of history.csv: every n-th step
};

/// The number of this program's checkpoint format, raised when its content changes.
inline constexpr int checkpoint_format = 6;

/// The state a checkpoint holds. Throws InputError when it has another grid or another internal variable.
[[nodiscard]] State read_state(const io::CheckpointReader& checkpoint, const Scene& scene);

/// Steps `stepper` to the end: snapshots, history, progress, checkpoints; a signal ends the run with a checkpoint.
/// `checkpoint` (or null) is what the run goes on from: it restores the step control, the history and the counters. A run whose
/// checkpoint is at its end already only brings its files to their end: a kill may have come before that.
/// Fills in `summary`. Throws RunError when a step fails; what was written before is kept.
[[nodiscard]] io::RunStatus run(const Scene& scene, TimeStepper& stepper, StepControl& control, const RunOptions& options,
                                const io::Program& program, const io::OutputFolder& folder,
                                const io::CheckpointReader* checkpoint, io::RunSummary& summary);

} // namespace ductile::quasistatic
