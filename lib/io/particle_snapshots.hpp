#pragma once
#include <ductile/io/snapshots.hpp>

#include <cstdint>
#include <filesystem>
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
    /// Throws RunError when the file cannot be made, InputError when the earlier snapshots are unreadable.
    ParticleSnapshotWriter(std::filesystem::path fields, const std::string& program,
                           const std::optional<EarlierSnapshots>& earlier = {}, const SnapshotConstants& constants = {});
    ~ParticleSnapshotWriter();
    ParticleSnapshotWriter(const ParticleSnapshotWriter&) = delete;
    ParticleSnapshotWriter& operator=(const ParticleSnapshotWriter&) = delete;

    /// Adds a snapshot. It is made in a copy of the file that then takes its place: a full disk is a RunError, and the snapshots
    /// before stay intact.
    void write(double time_s, std::int64_t step, std::span<const double> x, std::span<const double> y,
               std::span<const ParticleField> fields);

    /// Renames to the final name and points the XDMF file there. Harmless when repeated.
    void finish();

private:
    struct Snapshot {
        std::string group;
        double time_s;
        std::size_t particles;
        std::vector<std::pair<std::string, std::string>> fields; ///< names and units
    };

    void copy(const EarlierSnapshots& earlier, Hdf5File& file);
    void write_xdmf_file(const std::filesystem::path& data) const;

    std::filesystem::path final_, partial_;
    std::vector<Snapshot> snapshots_;
    bool finished_ = false;
};

} // namespace ductile::io
