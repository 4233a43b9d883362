#pragma once
// Private: what the writers of fields and of particles share.
#include <ductile/io/snapshots.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

namespace ductile::io {

/// An HDF5 file of snapshots (groups snapshots/NNNNNN with the attributes time_s and step) and the XDMF file beside it.
///
/// While running the file has the ending .partial; it is complete and closed between two snapshots, so that others may read it
/// and a killed run leaves it behind. finish() gives it its final name.
class SnapshotFile {
public:
    /// What a kind of snapshots brings along.
    struct Kind {
        std::string format;
        std::function<void(Hdf5File& file)> write_head;       ///< may be empty
        std::function<void(const Hdf5File& file)> check_head; ///< of earlier snapshots; may be empty
        std::function<void(const Hdf5File& file, const std::string& group, double time_s)> take_over; ///< an earlier snapshot
        std::function<std::string(const std::string& hdf5_file)> xdmf;                                ///< of all snapshots so far
    };

    /// Throws RunError when the file cannot be made, InputError when the earlier snapshots are unreadable or of another format.
    SnapshotFile(std::filesystem::path final_path, const std::string& program, const SnapshotConstants& constants,
                 const std::optional<EarlierSnapshots>& earlier, Kind kind);
    SnapshotFile(const SnapshotFile&) = delete;
    SnapshotFile& operator=(const SnapshotFile&) = delete;

    /// Adds a snapshot of about so many bytes in so many datasets, which `fill` writes below its group. Space is reserved first:
    /// a full disk is a RunError that says how much is missing, and the snapshots before stay intact. Call describe() afterwards.
    void add(double time_s, std::int64_t step, std::size_t bytes, std::size_t datasets,
             const std::function<void(Hdf5File& file, const std::string& group)>& fill);
    /// Writes the XDMF file anew.
    void describe() const;

    /// Renames to the final name and points the XDMF file there. Harmless when repeated. Throws RunError.
    void finish();
    /// For destructors: the partial file stays behind where that fails.
    void finish_quietly() noexcept;

private:
    void copy(const EarlierSnapshots& earlier, Hdf5File& file);
    void reserve(std::size_t bytes) const;

    std::filesystem::path final_, partial_;
    Kind kind_;
    std::size_t count_ = 0;
    bool finished_ = false;
};

} // namespace ductile::io
