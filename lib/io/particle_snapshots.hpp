#pragma once
#include <ductile/io/snapshots.hpp>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace ductile::io {

/// One quantity of all particles, one value each, in the stated SI unit.
struct ParticleField {
    std::string name = {};
    std::string units = {};
    std::span<const double> values = {};
};

/// Writes snapshots of particles to `fields.h5` ("ductile particles 1") and, for ParaView, `fields.xdmf` beside it: a group
/// snapshots/NNNNNN each, with the dataset `position` (a row (x, y) [m] a particle) and one dataset a field. The number of
/// particles may differ from one to the next.
///
/// While running the file is `fields.h5.partial`, complete and closed between two snapshots; finish() (or the destructor) gives
/// it its final name.
class ParticleSnapshotWriter {
public:
    /// Throws RunError when the file cannot be made, InputError when the earlier snapshots are damaged.
    ParticleSnapshotWriter(std::filesystem::path fields, const std::string& program,
                           const std::optional<EarlierSnapshots>& earlier = {}, const SnapshotConstants& constants = {});
    ~ParticleSnapshotWriter();
    ParticleSnapshotWriter(const ParticleSnapshotWriter&) = delete;
    ParticleSnapshotWriter& operator=(const ParticleSnapshotWriter&) = delete;

    /// Adds a snapshot. Space is reserved first: a full disk is a RunError that says how much is missing, and the snapshots
    /// before stay intact.
    void write(double time_s, std::int64_t step, std::span<const double> x, std::span<const double> y,
               std::span<const ParticleField> fields);

    /// Renames to the final name and points the XDMF file there. Harmless when repeated.
    void finish();

    /// Times of the snapshots in the file, earlier ones included [s].
    [[nodiscard]] std::vector<double> times() const;
    /// What a person must know about the earlier snapshots; empty if nothing.
    [[nodiscard]] const std::string& warning() const;

private:
    std::unique_ptr<SnapshotFile> file_;
};

} // namespace ductile::io
