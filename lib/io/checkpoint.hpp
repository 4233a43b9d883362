// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/error.hpp>
#include <ductile/io/array_view.hpp>
#include <ductile/io/hdf5.hpp>
#include <ductile/io/history.hpp>
#include <ductile/io/option_values.hpp>
#include <ductile/io/output_folder.hpp>
#include <ductile/io/snapshots.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace ductile::io {

/// Everything a run needs to go on bitwise as if it had never stopped. Names may contain slashes ("stress/p").
/// Doubles keep every bit. Views and spans are only looked at while the file is written.
struct Checkpoint {
    std::string program = {};
    int format = 1;          ///< the program's own number, raised whenever the meaning of its content changes
    std::string config = {}; ///< TOML text of all options, from Program::config_text()
    std::map<std::string, double> scalars = {};
    std::map<std::string, std::int64_t> counters = {};
    std::map<std::string, std::string> texts = {};
    std::vector<std::pair<std::string, ArrayView>> arrays = {};
    std::vector<std::pair<std::string, std::span<const double>>> vectors = {};
    std::vector<std::pair<std::string, std::span<const std::int64_t>>> integer_vectors = {};
    std::size_t snapshots = 0;               ///< how many there are in fields.h5
    std::optional<HistoryMark> history = {}; ///< the rows themselves stay in history.csv
};

/// Writes atomically, sealed by a checksum over every byte: on RunError an earlier checkpoint of this name is untouched.
void write_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint);

/// A failure that ends a run, with the advice to go on from the checkpoint there is, if there is one; `write` is to write that of
/// the state before the failure, and may fail.
[[nodiscard]] RunError with_checkpoint(const Error& failure, const std::filesystem::path& checkpoint,
                                       const std::function<void()>& write);

/// Reads a checkpoint; every mismatch is an InputError that says what was found, where, and what to do. HDF5, which may crash on
/// damaged files, sees the file only once its seal is found intact.
class CheckpointReader {
public:
    /// Checks that the file is a checkpoint of this program; `format` is checked by the second form.
    CheckpointReader(const std::filesystem::path& path, const std::string& program);
    CheckpointReader(const std::filesystem::path& path, const std::string& program, int format);

    [[nodiscard]] const std::filesystem::path& path() const { return file_.path(); }
    [[nodiscard]] std::string config() const;
    [[nodiscard]] double scalar(const std::string& name) const;
    [[nodiscard]] std::int64_t counter(const std::string& name) const;
    [[nodiscard]] std::string text(const std::string& name) const;
    [[nodiscard]] bool has_array(const std::string& name) const;
    /// Fills the view, whose shape must be that of the stored array.
    void read_array(const std::string& name, const MutableArrayView& values) const;
    [[nodiscard]] std::vector<double> vector(const std::string& name) const;
    [[nodiscard]] std::vector<std::int64_t> integer_vector(const std::string& name) const;
    /// The snapshots that a run which stays in the checkpoint's folder goes on with; `until_s` is the time of the checkpoint.
    [[nodiscard]] std::optional<EarlierSnapshots> snapshots(const OutputFolder& folder, double until_s) const;
    /// What the run goes on with of the history beside the checkpoint.
    [[nodiscard]] EarlierHistory history() const;

    /// Compares the counters "cells_x" and "cells_y" with the grid of the run and names --cells when they differ.
    void require_cells(const CellCount& run) const;

private:
    Hdf5File file_;
};

} // namespace ductile::io
