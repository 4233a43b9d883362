// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: what the writers of fields and of particles share.
#include <ductile/io/snapshot_index.hpp>
#include <ductile/io/snapshots.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace ductile::io {

/// An HDF5 file of snapshots (groups snapshots/NNNNNN with the attributes time_s and step, and their index, see
/// snapshot_index.hpp), views/NNNNNN with their vectors and tensors, vertices and none with what draws points (see
/// snapshot_meshes.hpp), and the XDMF file beside it.
///
/// While running the file has the ending .partial; it is complete and closed between two snapshots, so that others may read it
/// and a killed run leaves it behind. finish() gives it its final name. The XDMF file, which can only be written whole, is
/// written when a sixteenth of the snapshots is missing in it, and at the end: of many snapshots that is seldom.
class SnapshotFile {
public:
    /// What a kind of snapshots brings along.
    struct Kind {
        std::string format;
        std::string grid;                               ///< what earlier snapshots must share, in words; may be empty
        std::function<void(Hdf5File& file)> write_head; ///< may be empty
        /// The XDMF text.
        std::function<std::string(const std::string& hdf5_file, std::span<const StoredSnapshot> snapshots)> xdmf;
    };

    /// Throws RunError when the file cannot be made, InputError when the earlier snapshots are damaged or of another format.
    SnapshotFile(std::filesystem::path final_path, const std::string& program, const SnapshotConstants& constants,
                 const std::optional<EarlierSnapshots>& earlier, Kind kind);
    SnapshotFile(const SnapshotFile&) = delete;
    SnapshotFile& operator=(const SnapshotFile&) = delete;

    /// Adds a snapshot, whose datasets (their names, units, centring and shape) `write` makes by their path in the file. Space is
    /// reserved first: a full disk is a RunError that says how much is missing, and the snapshots before stay intact.
    void add(double time_s, std::int64_t step, std::vector<SnapshotDataset> datasets,
             const std::function<void(Hdf5File& file, const std::string& path, std::size_t dataset)>& write);

    [[nodiscard]] std::span<const StoredSnapshot> snapshots() const { return snapshots_; }
    /// What a person must know about the earlier snapshots; empty if nothing.
    [[nodiscard]] const std::string& warning() const { return warning_; }

    /// Renames to the final name and points the XDMF file there. Harmless when repeated. Throws RunError.
    void finish();
    /// For destructors: the partial file stays behind where that fails.
    void finish_quietly() noexcept;

private:
    void write_head(const std::string& program, const SnapshotConstants& constants);
    void take_over(const EarlierSnapshots& earlier);
    void append(StoredSnapshot snapshot,
                const std::function<void(Hdf5File& file, const std::string& path, std::size_t dataset)>& write);
    void add_record(Hdf5File& file, const std::string& record);
    static void write_meshes(Hdf5File& file, const StoredSnapshot& snapshot);
    void reserve(std::size_t bytes) const;
    void describe();

    std::filesystem::path final_, partial_, path_; ///< path_: where the file is now
    Kind kind_;
    std::vector<StoredSnapshot> snapshots_;
    std::size_t described_ = 0; ///< snapshots in the XDMF file
    RecordPlace newest_;
    std::string warning_;
    bool finished_ = false;
};

} // namespace ductile::io
