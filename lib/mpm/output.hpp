// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/checkpoint.hpp>
#include <ductile/io/particle_snapshots.hpp>
#include <ductile/mpm/run.hpp>

#include <array>
#include <string>
#include <vector>

namespace ductile::mpm {

/// What history.csv tells of a step beside the state it led to.
struct LastStep {
    double dt = 0.0; ///< [s]
    double smallest_determinant = 1.0, newton_iterations = 0.0, linear_iterations = 0.0;
    std::vector<std::array<double, 2>> contact_forces = {}; ///< see Observation

    /// Puts it into a checkpoint; the view is its own.
    void describe(io::Checkpoint& content) const;
    /// Throws InputError for forces on another number of rigid bodies.
    void restore(const io::CheckpointReader& checkpoint);
};

/// The columns of history.csv, and their values after a step.
[[nodiscard]] std::vector<std::string> history_columns(const Problem& problem);
void append_row(const Problem& problem, const Observation& seen, const LastStep& last, const Ledger& ledger,
                std::vector<double>& row);

/// Writes the particles of a state, and what follows from them, and the points of its rigid bodies. Displacements are those from
/// `start`, along x on a periodic grid the shortest that lead to the same place. Volumes are of a metre of thickness or a radian.
void write_snapshot(const Scene& scene, const Particles& start, const State& state, io::ParticleSnapshotWriter& snapshots);

} // namespace ductile::mpm
