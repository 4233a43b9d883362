#pragma once
#include <ductile/io/checkpoint.hpp>
#include <ductile/io/output_folder.hpp>
#include <ductile/io/program.hpp>
#include <ductile/io/summary.hpp>
#include <ductile/mpm/scene.hpp>
#include <ductile/mpm/state.hpp>
#include <ductile/mpm/step_control.hpp>
#include <ductile/mpm/time_stepper.hpp>

#include <functional>
#include <string>
#include <vector>

namespace ductile::mpm {

/// A number that a scene is about, one more column of history.csv; the name carries the unit.
struct Observable {
    std::string name;
    std::function<double(const State& state, const TimeStepper& stepper)> value;
};

/// A scene with what its program wants to see of it.
struct Problem {
    Scene scene = {};
    State start = {};
    std::vector<Observable> observables = {};
    /// The curve for the terminal: names of two columns, and their labels.
    std::string curve_x = {}, curve_y = {}, label_x = {}, label_y = {};
    /// Results for summary.json from the finished history; keys carry units.
    std::function<void(const io::HistoryTable& history, nlohmann::ordered_json& extra)> conclude = {};
};

/// When a run ends and what it writes on the way.
struct RunOptions {
    double duration_s = 0.0;              ///< steps are taken until the time is this or later
    std::vector<double> snapshots_s = {}; ///< a snapshot is taken at the first step that reaches such a time
    int history_every = 1;                ///< rows of history.csv: every n-th step
};

/// The number of these programs' checkpoint format, raised when its content changes.
inline constexpr int checkpoint_format = 3;

/// The state a checkpoint holds; `start` is the program's own initial state. Throws InputError unless its particles are as many.
[[nodiscard]] State read_state(const io::CheckpointReader& checkpoint, const State& start);

/// Steps to the end: snapshots, history, progress, checkpoints; a signal ends the run with a checkpoint. A step that fails is
/// tried again with half its length. `checkpoint` (or null) is what the run goes on from. Fills in `summary`. Throws RunError
/// when steps keep failing; what was written before is kept.
[[nodiscard]] io::RunStatus run(const Problem& problem, State& state, TimeStepper& stepper, StepControl& control,
                                const RunOptions& options, const io::Program& program, const io::OutputFolder& folder,
                                const io::CheckpointReader* checkpoint, io::RunSummary& summary);

} // namespace ductile::mpm
