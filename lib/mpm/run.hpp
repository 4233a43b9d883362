#pragma once
#include <ductile/io/checkpoint.hpp>
#include <ductile/io/output_folder.hpp>
#include <ductile/io/program.hpp>
#include <ductile/io/summary.hpp>
#include <ductile/mpm/monitor.hpp>
#include <ductile/mpm/observation.hpp>
#include <ductile/mpm/scene.hpp>
#include <ductile/mpm/state.hpp>
#include <ductile/mpm/step_control.hpp>
#include <ductile/mpm/time_stepper.hpp>

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

/// When a run ends and what it writes on the way.
struct RunOptions {
    double duration_s = 0.0;              ///< a step ends there, and the run
    std::vector<double> snapshots_s = {}; ///< a step ends at each, and a snapshot is taken; later ones than the end are left out
    int history_every = 1;                ///< rows of history.csv: the start, every n-th step, and the end
    Monitor::Options monitor = {};
};

/// The number of these programs' checkpoint format, raised when its content changes.
inline constexpr int checkpoint_format = 5;

/// The state a checkpoint holds; `start` is the program's own initial state. Throws InputError unless its particles are as many.
[[nodiscard]] State read_state(const io::CheckpointReader& checkpoint, const State& start);

/// Steps to the end, each ending at the next output time at most: snapshots, history, progress, checkpoints; a signal ends the
/// run with a checkpoint. A step that fails is tried again with half its length. `checkpoint` (or null) is what the run goes on
/// from; where it is at the end already, the run only brings its files to their end: a kill may have come before that. Fills in
/// `summary`. Throws InputError for a state that no run can start from, see check(), and RunError when steps keep
/// failing or are too short to change the time; what was written before is kept.
[[nodiscard]] io::RunStatus run(const Problem& problem, State& state, TimeStepper& stepper, StepControl& control,
                                const RunOptions& options, const io::Program& program, const io::OutputFolder& folder,
                                const io::CheckpointReader* checkpoint, io::RunSummary& summary);

} // namespace ductile::mpm
