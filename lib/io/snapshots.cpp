// SPDX-License-Identifier: GPL-3.0-or-later
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

/// The grid as a mesh of quadrilaterals: the places of its corners, row by row, and of each cell its corners, anticlockwise.
void write_mesh(Hdf5File& file, const std::vector<double>& x, const std::vector<double>& y) {
    std::vector<double> corners;
    std::vector<std::int64_t> corners_of_cells;
    const auto columns = static_cast<std::int64_t>(x.size()), rows = static_cast<std::int64_t>(y.size());
    for (std::int64_t j = 0; j < rows; ++j)
        for (std::int64_t i = 0; i < columns; ++i) {
            corners.insert(corners.end(), {x[static_cast<std::size_t>(i)], y[static_cast<std::size_t>(j)]});
            if (const std::int64_t first = j * columns + i; i + 1 < columns && j + 1 < rows)
                corners_of_cells.insert(corners_of_cells.end(), {first, first + 1, first + columns + 1, first + columns});
        }
    file.write("grid/corners", ArrayView{corners.data(), static_cast<int>(columns * rows), 2, 2});
    file.write("grid/corners_of_cells", corners_of_cells);
}

void write_head(Hdf5File& file, const SnapshotGrid& grid) {
    const bool equal = grid.y_corner_m.empty();
    const std::vector<double> x = line(grid.cells_x, grid.left_m, grid.width_m, 0.0),
                              y = equal ? line(grid.cells_y, grid.bottom_m, grid.height_m, 0.0) : grid.y_corner_m;
    file.write("grid/x_corner", x);
    file.write("grid/y_corner", y);
    write_mesh(file, x, y);
    file.write("grid/x_centre", line(grid.cells_x, grid.left_m, grid.width_m, 0.5));
    file.write("grid/y_centre", equal ? line(grid.cells_y, grid.bottom_m, grid.height_m, 0.5) : grid.y_centre_m);
    file.set_attribute("grid", "cells_x", std::int64_t{grid.cells_x});
    file.set_attribute("grid", "cells_y", std::int64_t{grid.cells_y});
    file.set_attribute("grid", "width_m", grid.width_m);
    file.set_attribute("grid", "height_m", grid.height_m);
}

std::string words(const SnapshotGrid& grid) {
    return fmt::format("{} x {} cells{} on {} x {} m", grid.cells_x, grid.cells_y,
                       grid.y_corner_m.empty() ? "" : fmt::format(" with rows at {:.6g}", fmt::join(grid.y_corner_m, ", ")),
                       grid.width_m, grid.height_m);
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
                             .xdmf =
                                 [grid](const std::string& hdf5_file, std::span<const StoredSnapshot> stored) {
                                     return xdmf_of_cells(hdf5_file, grid.cells_x, grid.cells_y, stored);
                                 }})),
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
                            .shape = {rows, columns},
                            .same_as = field.same_as});
    }
    file().add(time_s, step, std::move(datasets), [&](Hdf5File& file, const std::string& path, std::size_t d) {
        const SnapshotField& field = fields[d];
        file.write(path, field.values, {field.scale, field.offset, needs_periodic_column(field, grid_)});
    });
}

} // namespace ductile::io
