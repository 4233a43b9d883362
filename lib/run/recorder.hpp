// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/history.hpp>
#include <ductile/io/output_folder.hpp>
#include <ductile/io/program.hpp>
#include <ductile/run/simulation.hpp>

namespace ductile::run {

/// When a run ends and what it writes on the way.
struct Outputs {
    double duration_s = 0.0;                        ///< a step ends there, and the run
    std::vector<double> snapshots_s = {};           ///< a snapshot is taken at each; later ones than the end are left out
    int snapshot_cells_x = 0, snapshot_cells_y = 0; ///< of a grid: equal cells that fields are interpolated to; 0: its own
    std::vector<double> rows_s = {};                ///< rows of history.csv: at these times, and the end; none:
    int history_every = 1;                          ///< at the start, every n-th step, and the end
};

/// Where a run comes from and goes to.
struct Files {
    const io::Program& program;
    const io::OutputFolder& folder;
    const io::CheckpointReader* checkpoint = nullptr; ///< what the run goes on from, or null
};

/// Everything a run writes: history, snapshots, progress line, checkpoints. All files are as they were until it is made.
class Recorder {
public:
    /// Throws InputError where the checkpoint lacks a counter of the simulation, or what it goes on with is damaged.
    Recorder(Simulation& simulation, const Outputs& outputs, const Files& files);

    /// A row of history.csv for the state as it is.
    void row();
    /// The step of the last row; -1 before the first.
    [[nodiscard]] std::int64_t row_step() const { return row_step_; }
    void snapshot(double time_s) { simulation_.snapshot(time_s); }
    /// Whether a snapshot of this time is asked for and missing: a full disk may have come between.
    [[nodiscard]] bool lacks_snapshot(double time_s) const { return io::lacks(snapshots_.times(), outputs_.snapshots_s, time_s); }
    void progress() { progress_.update(simulation_.progress()); }
    void checkpoint();
    /// Closes the files.
    void finish();
    /// What the simulation and the files have to say, and the curve for the terminal.
    void describe(io::RunSummary& summary);

private:
    [[nodiscard]] Counters total() const;
    [[nodiscard]] std::string curve();

    Simulation& simulation_;
    const Outputs& outputs_;
    Files files_;
    std::int64_t row_step_;
    io::Snapshots& snapshots_;
    io::History history_;
    io::Progress progress_;
    std::vector<double> values_; // of a row
};

} // namespace ductile::run
