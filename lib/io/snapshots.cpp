#include <ductile/base/error.hpp>
#include <ductile/io/atomic_file.hpp>
#include <ductile/io/snapshots.hpp>
#include <ductile/io/text.hpp>
#include <ductile/io/version.hpp>
#include <ductile/io/xdmf.hpp>

#include <fmt/format.h>

#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace fs = std::filesystem;

namespace ductile::io {
namespace {

constexpr const char* format_name = "ductile fields 1";
/// Room for the group, the object headers and the attributes of one field, generously.
constexpr std::size_t overhead_bytes = 16 * 1024;

std::string group_name(std::size_t number) { return fmt::format("snapshots/{:06}", number); }

std::vector<double> line(int cells, double begin, double length, double shift) {
    std::vector<double> points;
    const int count = shift == 0.0 ? cells + 1 : cells;
    for (int i = 0; i < count; ++i)
        points.push_back(begin + length * (i + shift) / cells);
    return points;
}

void write_head(Hdf5File& file, const std::string& program, const SnapshotGrid& grid, const SnapshotConstants& constants) {
    file.set_attribute("/", "format", std::string(format_name));
    file.set_attribute("/", "program", program);
    file.set_attribute("/", "version", version());
    for (const auto& [name, value] : constants)
        file.set_attribute("/", name, value);
    file.write("grid/x_corner", line(grid.cells_x, grid.left_m, grid.width_m, 0.0));
    file.write("grid/y_corner", line(grid.cells_y, grid.bottom_m, grid.height_m, 0.0));
    file.write("grid/x_centre", line(grid.cells_x, grid.left_m, grid.width_m, 0.5));
    file.write("grid/y_centre", line(grid.cells_y, grid.bottom_m, grid.height_m, 0.5));
    file.set_attribute("grid", "cells_x", std::int64_t{grid.cells_x});
    file.set_attribute("grid", "cells_y", std::int64_t{grid.cells_y});
    file.set_attribute("grid", "width_m", grid.width_m);
    file.set_attribute("grid", "height_m", grid.height_m);
    file.create_group("snapshots");
}

void check_same_grid(const Hdf5File& file, const SnapshotGrid& grid) {
    if (!file.has_attribute("/", "format") || file.text_attribute("/", "format") != format_name)
        throw InputError(fmt::format("{}: this is not a file of format '{}': move it away to go on without earlier snapshots",
                                     file.path().string(), format_name));
    const std::int64_t x = file.integer_attribute("grid", "cells_x"), y = file.integer_attribute("grid", "cells_y");
    if (x != grid.cells_x || y != grid.cells_y || file.double_attribute("grid", "width_m") != grid.width_m ||
        file.double_attribute("grid", "height_m") != grid.height_m)
        throw InputError(fmt::format("{}: the earlier snapshots are on another grid ({} x {} cells): use another --output",
                                     file.path().string(), x, y));
}

/// Rows and columns that a view may have, and whether its first column must be repeated.
bool needs_periodic_column(const SnapshotField& field, const SnapshotGrid& grid) {
    const int extra = field.centring == Centring::corner ? 1 : 0;
    const bool periodic = extra == 1 && field.values.columns == grid.cells_x;
    if (field.values.rows != grid.cells_y + extra || (field.values.columns != grid.cells_x + extra && !periodic))
        throw RunError(fmt::format("snapshot field '{}' has {} x {} values, which does not fit {} x {} cells", field.name,
                                   field.values.rows, field.values.columns, grid.cells_y, grid.cells_x));
    return periodic;
}

} // namespace

SnapshotWriter::SnapshotWriter(fs::path fields, const std::string& program, const SnapshotGrid& grid,
                               const std::optional<EarlierSnapshots>& earlier, const SnapshotConstants& constants)
    : final_(std::move(fields)), partial_(final_), grid_(grid) {
    partial_ += ".partial";
    AtomicFile target(partial_);
    Hdf5File file = Hdf5File::create(target.temporary_path());
    write_head(file, program, grid_, constants);
    if (earlier)
        copy(*earlier, file);
    file.close();
    target.commit();
    write_xdmf_file(partial_);
}

SnapshotWriter::~SnapshotWriter() {
    try {
        finish();
    } catch (const Error&) {
        // The partial file stays behind; who wants to know calls finish().
    }
}

void SnapshotWriter::copy(const EarlierSnapshots& earlier, Hdf5File& file) {
    // The partial form goes first: it began as a copy of the finished one.
    fs::path source = earlier.fields;
    source += ".partial";
    if (!fs::exists(source))
        source = earlier.fields;
    if (!fs::exists(source))
        return;
    const Hdf5File old = Hdf5File::open(source);
    check_same_grid(old, grid_);
    for (const std::string& member : old.members("snapshots")) {
        const std::string group = "snapshots/" + member;
        XdmfSnapshot snapshot{.group = group, .time_s = old.double_attribute(group, "time_s")};
        if (snapshot.time_s > earlier.until_s)
            break;
        for (const std::string& name : old.members(group)) {
            const bool cell = old.text_attribute(group + "/" + name, "centring") == "cell";
            snapshot.fields.push_back({name, old.text_attribute(group + "/" + name, "units"), cell});
        }
        file.copy_from(old, group);
        snapshots_.push_back(std::move(snapshot));
    }
}

/// Takes the space of the next snapshot from the disk before HDF5 touches the file, so that a full disk cannot damage it.
void SnapshotWriter::reserve(std::size_t bytes) const {
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
                               final_.string(), human_bytes(needed), missing, std::strerror(error), snapshots_.size()));
}

void SnapshotWriter::write(double time_s, std::int64_t step, std::span<const SnapshotField> fields) {
    std::size_t bytes = overhead_bytes;
    for (const SnapshotField& field : fields) {
        const std::size_t columns =
            static_cast<std::size_t>(field.values.columns) + (needs_periodic_column(field, grid_) ? 1 : 0);
        bytes += overhead_bytes + sizeof(double) * columns * static_cast<std::size_t>(field.values.rows);
    }
    reserve(bytes);

    XdmfSnapshot snapshot{.group = group_name(snapshots_.size()), .time_s = time_s};
    Hdf5File file = Hdf5File::open_for_append(partial_);
    file.create_group(snapshot.group);
    file.set_attribute(snapshot.group, "time_s", time_s);
    file.set_attribute(snapshot.group, "step", step);
    for (const SnapshotField& field : fields) {
        const std::string name = snapshot.group + "/" + field.name;
        const bool cell = field.centring == Centring::cell;
        file.write(name, field.values, {field.scale, field.offset, needs_periodic_column(field, grid_)});
        file.set_attribute(name, "units", field.units);
        file.set_attribute(name, "centring", std::string(cell ? "cell" : "corner"));
        snapshot.fields.push_back({field.name, field.units, cell});
    }
    file.close();
    snapshots_.push_back(std::move(snapshot));
    write_xdmf_file(partial_);
}

void SnapshotWriter::write_xdmf_file(const fs::path& data) const {
    fs::path path = final_;
    path.replace_extension(".xdmf");
    write_text_atomically(path, xdmf_text(data.filename().string(), grid_.cells_x, grid_.cells_y, snapshots_));
}

void SnapshotWriter::finish() {
    if (finished_)
        return;
    finished_ = true;
    rename_durably(partial_, final_);
    write_xdmf_file(final_);
}

std::vector<double> SnapshotWriter::times() const {
    std::vector<double> times;
    for (const XdmfSnapshot& snapshot : snapshots_)
        times.push_back(snapshot.time_s);
    return times;
}

} // namespace ductile::io
