#pragma once
#include <ductile/io/history.hpp>
#include <ductile/io/particle_snapshots.hpp>
#include <ductile/io/progress.hpp>
#include <ductile/mpm/run.hpp>

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace ductile::mpm {

/// What history.csv tells of a step beside the state it led to.
struct LastStep {
    double dt = 0.0; ///< [s]
    StepOutcome outcome = {};
    std::vector<std::array<double, 2>> contact_forces = {}; ///< see Observation
};

/// Everything a run writes, in SI: snapshots, history, progress line, checkpoints.
class Recorder {
public:
    /// `checkpoint` (or null) is what the run goes on from, `start_s` its time.
    Recorder(const Problem& problem, const RunOptions& options, const io::Program& program, const io::OutputFolder& folder,
             const io::CheckpointReader* checkpoint, double start_s);

    void snapshot(const State& state);
    void row(const State& state, const LastStep& last);
    void progress(const State& state, const StepControl::Step& step);
    void checkpoint(const State& state, const StepControl& control, const Tally& tally,
                    const std::map<std::string, std::int64_t>& counters, const LastStep& last);
    /// The problem's curve of the whole run, for the terminal.
    [[nodiscard]] std::string curve();
    /// What a person must know about what an earlier run left.
    [[nodiscard]] std::vector<std::string> warnings() const;
    /// Whether the options ask for a snapshot at this time that is not in the file: a full disk may have come between.
    [[nodiscard]] bool lacks_snapshot(double time_s) const;
    void finish();

private:
    const Problem& problem_;
    const RunOptions& options_;
    const io::Program& program_;
    const io::OutputFolder& folder_;
    io::ParticleSnapshotWriter snapshots_;
    io::History history_;
    io::Progress progress_;
};

/// That of the checkpoint's state. Throws InputError for forces on another number of rigid bodies.
[[nodiscard]] LastStep read_last_step(const io::CheckpointReader& checkpoint, std::size_t rigid_bodies);

} // namespace ductile::mpm
