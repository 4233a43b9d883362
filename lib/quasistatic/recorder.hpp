#pragma once
#include <ductile/io/checkpoint.hpp>
#include <ductile/io/history.hpp>
#include <ductile/io/output_folder.hpp>
#include <ductile/io/program.hpp>
#include <ductile/io/progress.hpp>
#include <ductile/io/snapshots.hpp>
#include <ductile/quasistatic/accuracy_watch.hpp>
#include <ductile/quasistatic/run.hpp>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace ductile::quasistatic {

/// What history.csv tells of a step beside the state it led to.
struct LastStep {
    double dt = 0.0;
    double measure = 0.0; ///< StepAttempt::measure
};

/// Everything a run writes, in SI: snapshots, history, progress line, checkpoints.
class Recorder {
public:
    /// `checkpoint` (or null) is what the run goes on from, `start_s` its time.
    Recorder(const Scene& scene, const RunOptions& options, const io::Program& program, const io::OutputFolder& folder,
             const io::CheckpointReader* checkpoint, double start_s);

    /// `time_s` is that of the state, as it was asked for.
    void snapshot(const State& state, double time_s);
    void row(const State& state, const LastStep& last);
    void progress(const State& state, const StepControl::Step& step);
    void checkpoint(TimeStepper& stepper, StepControl& control, AccuracyWatch& watch,
                    const std::map<std::string, std::int64_t>& counters, const LastStep& last);
    /// The strain-stress curve of the whole run, for the terminal.
    [[nodiscard]] std::string curve();
    /// What a person must know about what an earlier run left.
    [[nodiscard]] std::vector<std::string> warnings() const;
    /// Whether the options ask for a snapshot at this time that is not in the file: a full disk may have come between.
    [[nodiscard]] bool lacks_snapshot(double time_s) const;
    void finish();

private:
    const Scene& scene_;
    const RunOptions& options_;
    const io::Program& program_;
    const io::OutputFolder& folder_;
    VectorField force_; // room for the residual of equilibrium
    io::SnapshotWriter snapshots_;
    io::History history_;
    io::Progress progress_;
};

/// Restores what a checkpoint holds besides the state: what is known of the accuracy so far; step control and the stepper's
/// hidden values, unless they belong to another scheme or step control than the run's (then the run goes on from the bare state).
void restore_hidden(const io::CheckpointReader& checkpoint, TimeStepper& stepper, StepControl& control, AccuracyWatch& watch);

/// That of the checkpoint's state.
[[nodiscard]] LastStep read_last_step(const io::CheckpointReader& checkpoint);

} // namespace ductile::quasistatic
