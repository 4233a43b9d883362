// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/snapshots.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

namespace ductile::io {

/// One quantity of all particles, one value each, in the stated SI unit.
struct ParticleField {
    std::string name = {};
    std::string units = {};
    std::span<const double> values = {};
};

/// Other points, which have a place alone: those of a rigid body.
struct PointSet {
    std::string name = {};
    std::span<const double> x = {}, y = {}; ///< [m]
};

/// Snapshots of particles: "ductile particles 1", a group snapshots/NNNNNN each, with the dataset `position` (a row (x, y) [m] a
/// particle), a dataset of the same kind for each set of other points, and one dataset a field. The number of particles may
/// differ from one to the next.
class ParticleSnapshotWriter final : public Snapshots {
public:
    /// Throws RunError when the file cannot be made, InputError when the earlier snapshots are damaged.
    ParticleSnapshotWriter(std::filesystem::path fields, const std::string& program,
                           const std::optional<EarlierSnapshots>& earlier = {}, const SnapshotConstants& constants = {});

    /// Adds a snapshot. Space is reserved first: a full disk is a RunError that says how much is missing, and the snapshots
    /// before stay intact.
    void write(double time_s, std::int64_t step, std::span<const double> x, std::span<const double> y,
               std::span<const ParticleField> fields, std::span<const PointSet> others = {});
};

} // namespace ductile::io
