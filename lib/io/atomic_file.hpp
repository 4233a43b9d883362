// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <cstdint>
#include <filesystem>
#include <string_view>

namespace ductile::io {

/// A file that appears whole or not at all: write to temporary_path(), close, then commit().
/// Without commit() the temporary file is removed and an earlier file of the final name stays as it was.
class AtomicFile {
public:
    explicit AtomicFile(std::filesystem::path final_path);
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    [[nodiscard]] const std::filesystem::path& temporary_path() const { return temporary_; }
    /// Brings the data to the disk and renames. Throws RunError; then the earlier file is untouched.
    void commit();

private:
    std::filesystem::path final_, temporary_;
    bool committed_ = false;
};

/// Writes a whole text file atomically. Throws RunError.
void write_text_atomically(const std::filesystem::path& path, std::string_view text);

/// Makes a file of the first so many bytes of another. Throws RunError.
void copy_beginning(const std::filesystem::path& from, const std::filesystem::path& to, std::uint64_t bytes);

/// Renames on one file system and brings the new name to the disk. Throws RunError.
void rename_durably(const std::filesystem::path& from, const std::filesystem::path& to);

} // namespace ductile::io
