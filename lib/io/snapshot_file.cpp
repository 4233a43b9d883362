#include <ductile/base/error.hpp>
#include <ductile/io/atomic_file.hpp>
#include <ductile/io/snapshot_file.hpp>
#include <ductile/io/text.hpp>
#include <ductile/io/version.hpp>

#include <fmt/format.h>

#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace fs = std::filesystem;

namespace ductile::io {

namespace {
/// Room for the group, the object headers and the attributes of one dataset, generously.
constexpr std::size_t overhead_bytes = 16 * 1024;
} // namespace

SnapshotFile::SnapshotFile(fs::path final_path, const std::string& program, const SnapshotConstants& constants,
                           const std::optional<EarlierSnapshots>& earlier, Kind kind)
    : final_(std::move(final_path)), partial_(final_), kind_(std::move(kind)) {
    partial_ += ".partial";
    AtomicFile target(partial_);
    Hdf5File file = Hdf5File::create(target.temporary_path());
    file.set_attribute("/", "format", kind_.format);
    file.set_attribute("/", "program", program);
    file.set_attribute("/", "version", version());
    for (const auto& [name, value] : constants)
        file.set_attribute("/", name, value);
    if (kind_.write_head)
        kind_.write_head(file);
    file.create_group("snapshots");
    if (earlier)
        copy(*earlier, file);
    file.close();
    target.commit();
    describe();
}

void SnapshotFile::copy(const EarlierSnapshots& earlier, Hdf5File& file) {
    // The partial form goes first: it began as a copy of the finished one.
    fs::path source = earlier.fields;
    source += ".partial";
    if (!fs::exists(source))
        source = earlier.fields;
    if (!fs::exists(source))
        return;
    const Hdf5File old = Hdf5File::open(source);
    if (!old.has_attribute("/", "format") || old.text_attribute("/", "format") != kind_.format)
        throw InputError(fmt::format("{}: this is not a file of format '{}': move it away to go on without earlier snapshots",
                                     source.string(), kind_.format));
    if (kind_.check_head)
        kind_.check_head(old);
    for (const std::string& member : old.members("snapshots")) {
        const std::string group = "snapshots/" + member;
        const double time_s = old.double_attribute(group, "time_s");
        if (time_s > earlier.until_s)
            break;
        kind_.take_over(old, group, time_s);
        file.copy_from(old, group);
        ++count_;
    }
}

/// Takes the space of the next snapshot from the disk before HDF5 touches the file, so that a full disk cannot damage it.
void SnapshotFile::reserve(std::size_t bytes) const {
    const int file = ::open(partial_.c_str(), O_WRONLY | O_CLOEXEC);
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
    const auto free = static_cast<double>(fs::space(partial_.parent_path(), unknown).available);
    const auto needed = static_cast<double>(bytes);
    const std::string missing = !unknown && free < needed ? fmt::format(", {} are missing", human_bytes(needed - free)) : "";
    throw RunError(fmt::format("{}: no room for the next snapshot, which needs {}{} ({}): free space and restart from the "
                               "checkpoint; earlier snapshots kept: {}",
                               final_.string(), human_bytes(needed), missing, std::strerror(error), count_));
}

void SnapshotFile::add(double time_s, std::int64_t step, std::size_t bytes, std::size_t datasets,
                       const std::function<void(Hdf5File& file, const std::string& group)>& fill) {
    reserve(bytes + overhead_bytes * (datasets + 1));
    const std::string group = fmt::format("snapshots/{:06}", count_);
    Hdf5File file = Hdf5File::open_for_append(partial_);
    file.create_group(group);
    file.set_attribute(group, "time_s", time_s);
    file.set_attribute(group, "step", step);
    fill(file, group);
    file.close();
    ++count_;
}

void SnapshotFile::describe() const {
    fs::path path = final_;
    path.replace_extension(".xdmf");
    write_text_atomically(path, kind_.xdmf((finished_ ? final_ : partial_).filename().string()));
}

void SnapshotFile::finish() {
    if (finished_)
        return;
    rename_durably(partial_, final_);
    finished_ = true;
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
