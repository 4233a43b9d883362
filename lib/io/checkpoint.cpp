// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/atomic_file.hpp>
#include <ductile/io/checkpoint.hpp>
#include <ductile/io/checksum.hpp>
#include <ductile/io/version.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>

namespace ductile::io {
namespace {

/// Version of the file's own layout.
constexpr std::string_view layout = "ductile checkpoint 3";

Hdf5File open_sealed(const std::filesystem::path& path) {
    require_file(path);
    check_seal(path);
    return Hdf5File::open(path);
}

/// A count of a run: one that cannot be would overflow sooner or later.
std::int64_t count_in(const Hdf5File& file, const std::filesystem::path& path, const std::string& group,
                      const std::string& name) {
    const std::int64_t count = file.integer_attribute(group, name);
    if (count < -1 || count > std::int64_t{1} << 53) // -1: none yet
        throw InputError(
            fmt::format("{}: '{}' is {}, which no run counts to: use another checkpoint", path.string(), name, count));
    return count;
}

std::string in_group(std::string_view group, const std::string& name) { return fmt::format("{}/{}", group, name); }

} // namespace

void write_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint) {
    AtomicFile target(path);
    Hdf5File file = Hdf5File::create(target.temporary_path());
    file.set_attribute("/", "format", std::string(layout));
    file.set_attribute("/", "program", checkpoint.program);
    file.set_attribute("/", "version", version());
    file.set_attribute("/", "program_format", std::int64_t{checkpoint.format});
    file.set_attribute("/", "snapshots", static_cast<std::int64_t>(checkpoint.snapshots));
    file.write("config", checkpoint.config);
    file.create_group("scalars");
    for (const auto& [name, value] : checkpoint.scalars)
        file.set_attribute("scalars", name, value);
    file.create_group("counters");
    for (const auto& [name, value] : checkpoint.counters)
        file.set_attribute("counters", name, value);
    file.create_group("texts");
    for (const auto& [name, value] : checkpoint.texts)
        file.set_attribute("texts", name, value);
    for (const auto& [name, view] : checkpoint.arrays)
        file.write(in_group("arrays", name), view);
    for (const auto& [name, values] : checkpoint.vectors)
        file.write(in_group("vectors", name), values);
    for (const auto& [name, values] : checkpoint.integer_vectors)
        file.write(in_group("integer_vectors", name), values);
    if (checkpoint.history) {
        file.create_group("history");
        file.set_attribute("history", "columns", checkpoint.history->columns);
        file.set_attribute("history", "rows", checkpoint.history->rows);
        file.set_attribute("history", "bytes", checkpoint.history->bytes);
        file.set_attribute("history", "checksum", checkpoint.history->checksum);
    }
    file.close();
    seal(target.temporary_path());
    target.commit();
}

RunError with_checkpoint(const Error& failure, const std::filesystem::path& checkpoint, const std::function<void()>& write) {
    const char* which = "the last good state";
    try {
        write();
    } catch (const Error&) {
        which = "an earlier state";
    }
    std::error_code unknown;
    if (!std::filesystem::exists(checkpoint, unknown))
        return RunError(failure.what());
    return RunError(fmt::format("{}; {} is in {}, to go on from", failure.what(), which, checkpoint.string()));
}

CheckpointReader::CheckpointReader(const std::filesystem::path& path, const std::string& program) : file_(open_sealed(path)) {
    if (!file_.has_attribute("/", "format") || file_.text_attribute("/", "format") != layout)
        throw InputError(fmt::format("{}: this is not a checkpoint ('{}'): give --restart the checkpoint.h5 of an earlier run",
                                     path.string(), layout));
    const std::string found = file_.text_attribute("/", "program");
    if (found != program)
        throw InputError(fmt::format("{}: this checkpoint was written by {}, not by {}: restart it with {}", path.string(), found,
                                     program, found));
}

CheckpointReader::CheckpointReader(const std::filesystem::path& path, const std::string& program, int format)
    : CheckpointReader(path, program) {
    const std::int64_t found = file_.integer_attribute("/", "program_format");
    if (found != format)
        throw InputError(
            fmt::format("{}: this checkpoint has format {} (written by ductile {}), this program reads format {}: use "
                        "that version, or start a new run",
                        path.string(), found, file_.text_attribute("/", "version"), format));
}

std::string CheckpointReader::config() const { return file_.read_text("config"); }

double CheckpointReader::scalar(const std::string& name) const { return file_.double_attribute("scalars", name); }

std::int64_t CheckpointReader::counter(const std::string& name) const { return count_in(file_, path(), "counters", name); }

std::string CheckpointReader::text(const std::string& name) const { return file_.text_attribute("texts", name); }

bool CheckpointReader::has_array(const std::string& name) const { return file_.contains(in_group("arrays", name)); }

void CheckpointReader::read_array(const std::string& name, const MutableArrayView& values) const {
    const std::string object = in_group("arrays", name);
    if (file_.contains(object)) {
        const std::vector<std::size_t> found = file_.shape(object);
        if (found != std::vector{static_cast<std::size_t>(values.rows), static_cast<std::size_t>(values.columns)})
            throw InputError(fmt::format("{}: the checkpoint's '{}' has {} values (rows x columns), the run has {} x {}: use the "
                                         "options it was written with, or another checkpoint",
                                         path().string(), name, fmt::join(found, " x "), values.rows, values.columns));
    }
    file_.read(object, values);
}

std::vector<double> CheckpointReader::vector(const std::string& name) const {
    return file_.read_doubles(in_group("vectors", name));
}

std::vector<std::int64_t> CheckpointReader::integer_vector(const std::string& name) const {
    return file_.read_integers(in_group("integer_vectors", name));
}

std::optional<EarlierSnapshots> CheckpointReader::snapshots(const OutputFolder& folder, double until_s) const {
    if (!folder.continued())
        return std::nullopt;
    return EarlierSnapshots{.fields = folder.fields(),
                            .until_s = until_s,
                            .count = static_cast<std::size_t>(count_in(file_, path(), "/", "snapshots"))};
}

EarlierHistory CheckpointReader::history() const {
    return {.csv = path().parent_path() / "history.csv",
            .mark = {.columns = file_.text_attribute("history", "columns"),
                     .rows = count_in(file_, path(), "history", "rows"),
                     .bytes = count_in(file_, path(), "history", "bytes"),
                     .checksum = file_.integer_attribute("history", "checksum")}};
}

void CheckpointReader::require_cells(const CellCount& run) const {
    const std::int64_t x = counter("cells_x"), y = counter("cells_y");
    if (x != run.x || y != run.y)
        throw InputError(
            fmt::format("checkpoint {} holds a grid of {} x {} cells, the run has {} x {}: use --cells {}x{} or another "
                        "checkpoint",
                        path().string(), x, y, run.x, run.y, x, y));
}

} // namespace ductile::io
