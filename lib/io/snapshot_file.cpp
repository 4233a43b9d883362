// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/atomic_file.hpp>
#include <ductile/io/checksum.hpp>
#include <ductile/io/snapshot_file.hpp>
#include <ductile/io/snapshot_meshes.hpp>
#include <ductile/io/text.hpp>
#include <ductile/io/version.hpp>

#include <fmt/format.h>

#include <cstring>
#include <fcntl.h>
#include <limits>
#include <numeric>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace fs = std::filesystem;

namespace ductile::io {

namespace {
/// Room for the group, the object headers, the attributes and the record of one dataset, generously.
constexpr std::size_t overhead_bytes = 16 * 1024;
} // namespace

SnapshotFile::SnapshotFile(fs::path final_path, const std::string& program, const SnapshotConstants& constants,
                           const std::optional<EarlierSnapshots>& earlier, Kind kind)
    : final_(std::move(final_path)), partial_(final_), kind_(std::move(kind)) {
    partial_ += ".partial";
    AtomicFile target(partial_);
    path_ = target.temporary_path();
    write_head(program, constants);
    if (earlier)
        take_over(*earlier);
    target.commit();
    path_ = partial_;
    describe();
}

void SnapshotFile::write_head(const std::string& program, const SnapshotConstants& constants) {
    Hdf5File file = Hdf5File::create(path_, index_block_bytes);
    file.set_attribute("/", "format", kind_.format);
    file.set_attribute("/", "program", program);
    file.set_attribute("/", "version", version());
    for (const auto& [name, value] : constants)
        file.set_attribute("/", name, value);
    if (kind_.write_head)
        kind_.write_head(file);
    file.create_group("snapshots");
    add_record(file, index_record(fmt::format("{}; {}", kind_.format, kind_.grid), nullptr, {}));
    file.close();
    write_index_block(path_, newest_);
}

/// Writes the earlier snapshots anew, from their values alone.
void SnapshotFile::take_over(const EarlierSnapshots& earlier) {
    // The partial form goes first: it began with all that the checkpoint knows of the finished one.
    fs::path source = earlier.fields;
    source += ".partial";
    if (!fs::exists(source))
        source = earlier.fields;
    if (!fs::exists(source)) {
        if (earlier.count > 0)
            warning_ =
                fmt::format("{} begins after the checkpoint: the file with the {} earlier snapshots is gone; put it back and "
                            "restart again to have them",
                            final_.string(), earlier.count);
        return;
    }
    const SnapshotIndex index = read_index(source);
    const std::string format = index.head.substr(0, index.head.find("; "));
    if (format != kind_.format)
        throw InputError(fmt::format("{}: this is not a file of format '{}': move it away to go on without earlier snapshots",
                                     source.string(), kind_.format));
    if (index.head != fmt::format("{}; {}", kind_.format, kind_.grid))
        throw InputError(fmt::format("{}: the earlier snapshots are on another grid ({}, now {}): use another --output",
                                     source.string(), index.head.substr(format.size() + 2), kind_.grid));
    for (const StoredSnapshot& old : index.snapshots)
        if (old.time_s <= earlier.until_s) {
            StoredSnapshot copy = old;
            append(std::move(copy), [&](Hdf5File& file, const std::string& path, std::size_t d) {
                const std::vector<double> values = read_values(source, old, old.datasets[d]);
                const std::vector<std::size_t>& shape = old.datasets[d].shape;
                if (shape.size() == 1)
                    file.write(path, values);
                else
                    file.write(path, ArrayView{values.data(), static_cast<int>(shape[0]), static_cast<int>(shape[1]),
                                               static_cast<std::ptrdiff_t>(shape[1])});
            });
        }
    if (snapshots_.size() < earlier.count)
        throw InputError(
            fmt::format("{}: it has {} snapshots up to the checkpoint, which knows of {}: put the file back as it was, "
                        "or move it away to go on without them",
                        source.string(), snapshots_.size(), earlier.count));
    if (index.torn)
        warning_ = fmt::format("{}: the snapshot that was being written when the run stopped is left out, the {} before it are "
                               "kept; it is taken again if its time is after the checkpoint's",
                               final_.string(), snapshots_.size());
}

/// What pictures are made of beside the values.
void SnapshotFile::write_meshes(Hdf5File& file, const StoredSnapshot& snapshot) {
    for (const CompositeField& field : composites_of(snapshot)) {
        std::vector<std::string> parts;
        for (const std::string& part : field.parts)
            parts.push_back(part.empty() ? part : snapshot.group + "/" + part);
        const std::string path = view_path(snapshot, field);
        file.write_view(path, parts, field.like->shape);
        file.set_attribute(path, "units", field.like->units);
    }
    for (const SnapshotDataset& dataset : snapshot.datasets) {
        if (!is_point_set(dataset))
            continue;
        std::vector<std::int64_t> numbers(dataset.shape.front());
        std::iota(numbers.begin(), numbers.end(), std::int64_t{0});
        if (const std::string path = vertices_path(numbers.size()); !file.contains(path))
            file.write(path, numbers);
        if (&dataset == &snapshot.datasets.front())
            continue;
        for (const std::size_t components : {1, 3, 9})
            if (const std::string path = no_field_path(numbers.size(), components); !file.contains(path))
                file.write_constant(path, std::numeric_limits<double>::quiet_NaN(),
                                    components == 1 ? std::vector{numbers.size()} : std::vector{numbers.size(), components});
    }
}

/// Takes the space of the next snapshot from the disk before HDF5 touches the file, so that a full disk cannot damage it.
void SnapshotFile::reserve(std::size_t bytes) const {
    const int file = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC);
    struct stat status {};
    int error = file < 0 || ::fstat(file, &status) != 0 ? errno : 0;
    if (error == 0) {
        error = ::posix_fallocate(file, status.st_size, static_cast<off_t>(bytes));
        if (error != 0 && ::ftruncate(file, status.st_size) != 0)
            error = errno;
    }
    if (file >= 0)
        ::close(file);
    if (error == 0)
        return;
    std::error_code unknown;
    const auto free = static_cast<double>(fs::space(path_.parent_path(), unknown).available);
    const auto needed = static_cast<double>(bytes);
    const std::string missing = !unknown && free < needed ? fmt::format(", {} are missing", human_bytes(needed - free)) : "";
    throw RunError(
        fmt::format("{}: no room for the next snapshot, which needs {}{} ({}): check free space and whether the folder "
                    "is still there; earlier snapshots kept: {}",
                    final_.string(), human_bytes(needed), missing, std::strerror(error), snapshots_.size()));
}

void SnapshotFile::add_record(Hdf5File& file, const std::string& record) {
    const std::string name = fmt::format("index/{:06}", snapshots_.size());
    file.write_bytes(name, record);
    file.flush();
    newest_ = {.offset = file.byte_offset(name), .bytes = record.size(), .checksum = checksum(record)};
}

void SnapshotFile::append(StoredSnapshot snapshot,
                          const std::function<void(Hdf5File& file, const std::string& path, std::size_t dataset)>& write) {
    std::size_t bytes = overhead_bytes;
    for (const SnapshotDataset& dataset : snapshot.datasets)
        bytes += (dataset.same_as.empty() ? sizeof(double) * dataset.values() : 0) + overhead_bytes +
                 (is_point_set(dataset) ? sizeof(std::int64_t) * dataset.shape.front() + 4 * overhead_bytes : 0);
    bytes += overhead_bytes * composites_of(snapshot).size();
    reserve(bytes);
    snapshot.group = fmt::format("snapshots/{:06}", snapshots_.size());
    Hdf5File file = Hdf5File::open_for_append(path_);
    file.create_group(snapshot.group);
    file.set_attribute(snapshot.group, "time_s", snapshot.time_s);
    file.set_attribute(snapshot.group, "step", snapshot.step);
    for (std::size_t d = 0; d < snapshot.datasets.size(); ++d) {
        const SnapshotDataset& dataset = snapshot.datasets[d];
        const std::string path = snapshot.group + "/" + dataset.name;
        if (!dataset.same_as.empty()) {
            file.link(path, snapshot.group + "/" + dataset.same_as);
            continue;
        }
        write(file, path, d);
        file.set_attribute(path, "units", dataset.units);
        if (!dataset.centring.empty())
            file.set_attribute(path, "centring", dataset.centring);
    }
    write_meshes(file, snapshot);
    file.flush();
    for (SnapshotDataset& dataset : snapshot.datasets) {
        dataset.offset = file.byte_offset(snapshot.group + "/" + dataset.name);
        dataset.checksum = checksum(path_, dataset.offset, sizeof(double) * dataset.values());
    }
    snapshots_.push_back(std::move(snapshot));
    try {
        add_record(file, index_record({}, &snapshots_.back(), newest_));
        file.close();
        write_index_block(path_, newest_);
    } catch (...) {
        snapshots_.pop_back();
        throw;
    }
}

void SnapshotFile::add(double time_s, std::int64_t step, std::vector<SnapshotDataset> datasets,
                       const std::function<void(Hdf5File& file, const std::string& path, std::size_t dataset)>& write) {
    append({.time_s = time_s, .step = step, .datasets = std::move(datasets)}, write);
    if (16 * (snapshots_.size() - described_) >= snapshots_.size())
        describe();
}

void SnapshotFile::describe() {
    fs::path path = final_;
    path.replace_extension(".xdmf");
    write_text_atomically(path, kind_.xdmf((finished_ ? final_ : partial_).filename().string(), snapshots_));
    described_ = snapshots_.size();
}

void SnapshotFile::finish() {
    if (finished_)
        return;
    rename_durably(partial_, final_);
    finished_ = true;
    path_ = final_;
    describe();
}

void SnapshotFile::finish_quietly() noexcept {
    try {
        finish();
    } catch (const Error&) {
        // who wants to know calls finish()
    }
}

} // namespace ductile::io
