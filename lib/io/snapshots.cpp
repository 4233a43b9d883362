#include <ductile/base/error.hpp>
#include <ductile/io/snapshot_file.hpp>
#include <ductile/io/snapshots.hpp>
#include <ductile/io/xdmf.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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

std::string words(const SnapshotGrid& grid) {
    return fmt::format("{} x {} cells on {} x {} m", grid.cells_x, grid.cells_y, grid.width_m, grid.height_m);
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

std::string xdmf(const std::string& hdf5_file, const SnapshotGrid& grid, std::span<const StoredSnapshot> stored) {
    std::vector<XdmfSnapshot> snapshots;
    for (const StoredSnapshot& snapshot : stored) {
        snapshots.push_back({.group = snapshot.group, .time_s = snapshot.time_s});
        for (const SnapshotDataset& field : snapshot.datasets)
            snapshots.back().fields.push_back({field.name, field.units, field.centring == "cell"});
    }
    return xdmf_text(hdf5_file, grid.cells_x, grid.cells_y, snapshots);
}

} // namespace

bool lacks(const std::vector<double>& present, const std::vector<double>& wanted, double time_s) {
    const auto is_now = [&](double time) { return std::abs(time - time_s) <= 1e-9 * std::abs(time_s); };
    const bool asked = std::any_of(wanted.begin(), wanted.end(), is_now);
    return asked && (present.empty() || (present.back() < time_s && !is_now(present.back())));
}

Snapshots::Snapshots(std::unique_ptr<SnapshotFile> file) : file_(std::move(file)) {}

Snapshots::~Snapshots() { file_->finish_quietly(); }

void Snapshots::finish() { file_->finish(); }

std::vector<double> Snapshots::times() const {
    std::vector<double> times;
    for (const StoredSnapshot& snapshot : file_->snapshots())
        times.push_back(snapshot.time_s);
    return times;
}

const std::string& Snapshots::warning() const { return file_->warning(); }

SnapshotWriter::SnapshotWriter(std::filesystem::path fields, const std::string& program, const SnapshotGrid& grid,
                               const std::optional<EarlierSnapshots>& earlier, const SnapshotConstants& constants)
    : Snapshots(std::make_unique<SnapshotFile>(
          std::move(fields), program, constants, earlier,
          SnapshotFile::Kind{.format = "ductile fields 1",
                             .grid = words(grid),
                             .write_head = [grid](Hdf5File& file) { write_head(file, grid); },
                             .xdmf = [grid](const std::string& hdf5_file,
                                            std::span<const StoredSnapshot> stored) { return xdmf(hdf5_file, grid, stored); }})),
      grid_(grid) {}

void SnapshotWriter::write(double time_s, std::int64_t step, std::span<const SnapshotField> fields) {
    std::vector<SnapshotDataset> datasets;
    for (const SnapshotField& field : fields) {
        const std::size_t rows = static_cast<std::size_t>(field.values.rows),
                          columns =
                              static_cast<std::size_t>(field.values.columns) + (needs_periodic_column(field, grid_) ? 1 : 0);
        datasets.push_back({.name = field.name,
                            .units = field.units,
                            .centring = field.centring == Centring::cell ? "cell" : "corner",
                            .shape = {rows, columns}});
    }
    file().add(time_s, step, std::move(datasets), [&](Hdf5File& file, const std::string& path, std::size_t d) {
        const SnapshotField& field = fields[d];
        file.write(path, field.values, {field.scale, field.offset, needs_periodic_column(field, grid_)});
    });
}

} // namespace ductile::io
