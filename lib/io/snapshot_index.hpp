// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: how a file of snapshots survives a writer that is killed.
//
// HDF5 changes its own book-keeping in place while a snapshot is appended, so a process killed there may leave a file that no
// HDF5 library opens. The values of earlier snapshots, however, never move. Hence a second way to them, without HDF5:
//   - after the values of snapshot k a dataset index/k is written, a record (JSON) that says of each dataset of the snapshot
//     its name, units, centring, shape, its place in the file and the checksum of its bytes, and where record k - 1 is;
//   - only when the file is closed, and whole, the user block (its first 512 bytes, which HDF5 leaves alone) is made to point
//     at record k, with the record's checksum, the length of the file, and a checksum of the block.
// A torn snapshot is one that the user block does not know. A continued run reads the file in this way alone.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace ductile::io {

/// A dataset of a snapshot, of doubles.
struct SnapshotDataset {
    std::string name = {};
    std::string units = {};
    std::string centring = {};           ///< of a field on a grid; empty for particles
    std::vector<std::size_t> shape = {}; ///< one or two extents
    std::uint64_t offset = 0;            ///< of its values in the file
    std::uint32_t checksum = 0;          ///< of their bytes
    std::string same_as = {};            ///< the dataset of this snapshot that it is a second name of; or empty

    [[nodiscard]] std::size_t values() const;
};

struct StoredSnapshot {
    std::string group = {}; ///< "snapshots/NNNNNN"
    double time_s = 0.0;
    std::int64_t step = 0;
    std::vector<SnapshotDataset> datasets = {};
};

/// A stretch of the file and the checksum of its bytes; without bytes: none.
struct RecordPlace {
    std::uint64_t offset = 0;
    std::uint64_t bytes = 0;
    std::uint32_t checksum = 0;
};

/// What the index of a file says.
struct SnapshotIndex {
    std::string head = {}; ///< what describes the file as a whole: compared, not read
    std::vector<StoredSnapshot> snapshots = {};
    bool torn = false; ///< another snapshot was being written when the writer ended
};

inline constexpr std::size_t index_block_bytes = 512;

/// The record of the head (number 0, `snapshot` null) or of a snapshot.
[[nodiscard]] std::string index_record(const std::string& head, const StoredSnapshot* snapshot, const RecordPlace& previous);
/// Points the user block at the newest record of the closed file. Throws RunError.
void write_index_block(const std::filesystem::path& path, const RecordPlace& newest);
/// Throws InputError that names the file when it has no index or the index is damaged.
[[nodiscard]] SnapshotIndex read_index(const std::filesystem::path& path);
/// The values of a dataset. Throws InputError that names file and dataset when they do not fit their checksum.
[[nodiscard]] std::vector<double> read_values(const std::filesystem::path& path, const StoredSnapshot& snapshot,
                                              const SnapshotDataset& dataset);

} // namespace ductile::io
