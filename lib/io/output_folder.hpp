// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <filesystem>
#include <optional>

namespace ductile::io {

/// The folder one run writes into, claimed for it alone as long as this object lives.
///
/// A new run never destroys an earlier one: a folder with its files is first moved to the next free name with a number
/// (`<folder>.1`, `<folder>.2`). A run continued from a checkpoint in that same folder keeps the folder.
class OutputFolder {
public:
    /// Makes the folder (and its parents) and checks that files can be written. `restart` is the checkpoint the run goes on
    /// from, empty for a new run. Throws InputError naming the folder: not a folder, unwritable, in use by another run.
    explicit OutputFolder(const std::filesystem::path& folder, const std::filesystem::path& restart = {});

    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    /// True when the run goes on in the folder of its checkpoint.
    [[nodiscard]] bool continued() const { return continued_; }
    /// Where an earlier run's folder went, if there was one.
    [[nodiscard]] const std::optional<std::filesystem::path>& earlier_run_moved_to() const { return moved_to_; }

    [[nodiscard]] std::filesystem::path summary() const { return path_ / "summary.json"; }
    [[nodiscard]] std::filesystem::path history() const { return path_ / "history.csv"; }
    [[nodiscard]] std::filesystem::path work_precision() const { return path_ / "work_precision.csv"; }
    [[nodiscard]] std::filesystem::path fields() const { return path_ / "fields.h5"; }
    [[nodiscard]] std::filesystem::path checkpoint() const { return path_ / "checkpoint.h5"; }

private:
    struct Lock {
        int descriptor = -1;
        Lock() = default;
        ~Lock();
        Lock(const Lock&) = delete;
        Lock& operator=(const Lock&) = delete;
        void release();
    };

    void claim();
    void move_aside(const std::filesystem::path& restart);

    std::filesystem::path path_;
    bool continued_ = false;
    std::optional<std::filesystem::path> moved_to_;
    Lock lock_;
};

} // namespace ductile::io
