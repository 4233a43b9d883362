#include <ductile/base/error.hpp>
#include <ductile/io/snapshot_file.hpp>
#include <ductile/io/snapshots.hpp>
#include <ductile/io/xdmf.hpp>

#include <fmt/format.h>

#include <utility>

namespace ductile::io {
namespace {

std::vector<double> line(int cells, double begin, double length, double shift) {
    std::vector<double> points;
    const int count = shift == 0.0 ? cells + 1 : cells;
    for (int i = 0; i < count; ++i)
        points.push_back(begin + length * (i + shift) / cells);
    return points;
}

void write_head(Hdf5File& file, const SnapshotGrid& grid) {
    file.write("grid/x_corner", line(grid.cells_x, grid.left_m, grid.width_m, 0.0));
    file.write("grid/y_corner", line(grid.cells_y, grid.bottom_m, grid.height_m, 0.0));
    file.write("grid/x_centre", line(grid.cells_x, grid.left_m, grid.width_m, 0.5));
    file.write("grid/y_centre", line(grid.cells_y, grid.bottom_m, grid.height_m, 0.5));
    file.set_attribute("grid", "cells_x", std::int64_t{grid.cells_x});
    file.set_attribute("grid", "cells_y", std::int64_t{grid.cells_y});
    file.set_attribute("grid", "width_m", grid.width_m);
    file.set_attribute("grid", "height_m", grid.height_m);
}

void check_same_grid(const Hdf5File& file, const SnapshotGrid& grid) {
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

SnapshotWriter::SnapshotWriter(std::filesystem::path fields, const std::string& program, const SnapshotGrid& grid,
                               const std::optional<EarlierSnapshots>& earlier, const SnapshotConstants& constants)
    : grid_(grid), file_(std::make_unique<SnapshotFile>(
                       std::move(fields), program, constants, earlier,
                       SnapshotFile::Kind{.format = "ductile fields 1",
                                          .write_head = [this](Hdf5File& file) { write_head(file, grid_); },
                                          .check_head = [this](const Hdf5File& file) { check_same_grid(file, grid_); },
                                          .take_over =
                                              [this](const Hdf5File& file, const std::string& group, double time_s) {
                                                  XdmfSnapshot snapshot{.group = group, .time_s = time_s};
                                                  for (const std::string& name : file.members(group)) {
                                                      const std::string path = group + "/" + name;
                                                      const bool cell = file.text_attribute(path, "centring") == "cell";
                                                      snapshot.fields.push_back({name, file.text_attribute(path, "units"), cell});
                                                  }
                                                  snapshots_.push_back(std::move(snapshot));
                                              },
                                          .xdmf =
                                              [this](const std::string& hdf5_file) {
                                                  return xdmf_text(hdf5_file, grid_.cells_x, grid_.cells_y, snapshots_);
                                              }})) {}

SnapshotWriter::~SnapshotWriter() { file_->finish_quietly(); }

void SnapshotWriter::write(double time_s, std::int64_t step, std::span<const SnapshotField> fields) {
    std::size_t bytes = 0;
    for (const SnapshotField& field : fields) {
        const std::size_t columns =
            static_cast<std::size_t>(field.values.columns) + (needs_periodic_column(field, grid_) ? 1 : 0);
        bytes += sizeof(double) * columns * static_cast<std::size_t>(field.values.rows);
    }
    XdmfSnapshot snapshot{.time_s = time_s};
    file_->add(time_s, step, bytes, fields.size(), [&](Hdf5File& file, const std::string& group) {
        snapshot.group = group;
        for (const SnapshotField& field : fields) {
            const std::string name = group + "/" + field.name;
            const bool cell = field.centring == Centring::cell;
            file.write(name, field.values, {field.scale, field.offset, needs_periodic_column(field, grid_)});
            file.set_attribute(name, "units", field.units);
            file.set_attribute(name, "centring", std::string(cell ? "cell" : "corner"));
            snapshot.fields.push_back({field.name, field.units, cell});
        }
    });
    snapshots_.push_back(std::move(snapshot));
    file_->describe();
}

void SnapshotWriter::finish() { file_->finish(); }

std::vector<double> SnapshotWriter::times() const {
    std::vector<double> times;
    for (const XdmfSnapshot& snapshot : snapshots_)
        times.push_back(snapshot.time_s);
    return times;
}

} // namespace ductile::io
