#pragma once
#include <ductile/io/checkpoint.hpp>
#include <ductile/io/output_folder.hpp>
#include <ductile/io/output_times.hpp>
#include <ductile/io/summary.hpp>

#include <cstdint>

namespace ductile::run {

/// What became of an attempted step.
enum class Attempt {
    refused,  ///< the state is as before, and the next attempt will be another one
    accepted, ///< the state is at its end
    landed,   ///< the same, and that is the output time
};

/// A run of either carrier as the loop sees it: a state that steps lead on, and the files it leaves.
class Simulation {
public:
    virtual ~Simulation() = default;

    [[nodiscard]] virtual double time_s() const = 0;
    [[nodiscard]] virtual std::int64_t step() const = 0;
    /// One step that ends at `output_time_s` at the latest. Throws RunError when no attempt can succeed.
    [[nodiscard]] virtual Attempt attempt(double output_time_s) = 0;
    /// Takes note of an accepted state for the summary, whichever rows are written; `last`: at the end of the run.
    virtual void observe(bool last) = 0;

    virtual void row() = 0;
    virtual void snapshot(double time_s) = 0;
    /// Whether a snapshot of this time is asked for and missing: a full disk may have come between.
    [[nodiscard]] virtual bool lacks_snapshot(double time_s) const = 0;
    virtual void progress() = 0;
    /// `row_step` is the step of the last row, for read_row_step().
    virtual void checkpoint(std::int64_t row_step) = 0;
    /// Closes the files.
    virtual void finish() = 0;
    /// Fills in counts, phases, results and warnings, but for what the loop measures: wall time and that of output.
    virtual void describe(io::RunSummary& summary) = 0;
};

struct LoopOptions {
    int history_every = 1;           ///< rows: the start, every n-th step, and the end
    double checkpoint_every_s = 0.0; ///< wall time
};

/// The step of the last row in the history that goes with a checkpoint; -1 without one.
[[nodiscard]] std::int64_t read_row_step(const io::CheckpointReader* checkpoint);

/// Steps to the last output time: rows, snapshots, progress, checkpoints; a signal ends the run with a checkpoint. Where a
/// checkpoint that it goes on from is at the end already, the run only brings its files to their end: a kill may have come before
/// that. `row_step` is that of read_row_step(). Throws the RunError that ended a run, with the advice to go on from the last good
/// state, which is kept.
[[nodiscard]] io::RunStatus loop(Simulation& simulation, const io::OutputTimes& times, const LoopOptions& options,
                                 const io::OutputFolder& folder, std::int64_t row_step, io::RunSummary& summary);

} // namespace ductile::run
