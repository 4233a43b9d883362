// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/io/particle_snapshots.hpp>
#include <ductile/io/snapshot_file.hpp>
#include <ductile/io/xdmf.hpp>

#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

namespace ductile::io {

namespace {

/// A row (x, y) each.
std::vector<double> places_of(std::span<const double> x, std::span<const double> y) {
    std::vector<double> places(2 * x.size());
    for (std::size_t p = 0; p < x.size(); ++p) {
        places[2 * p] = x[p];
        places[2 * p + 1] = y[p];
    }
    return places;
}

} // namespace

ParticleSnapshotWriter::ParticleSnapshotWriter(std::filesystem::path fields, const std::string& program,
                                               const std::optional<EarlierSnapshots>& earlier, const SnapshotConstants& constants)
    : Snapshots(std::make_unique<SnapshotFile>(
          std::move(fields), program, constants, earlier,
          SnapshotFile::Kind{.format = "ductile particles 1", .grid = {}, .write_head = {}, .xdmf = xdmf_of_points})) {}

void ParticleSnapshotWriter::write(double time_s, std::int64_t step, std::span<const double> x, std::span<const double> y,
                                   std::span<const ParticleField> fields, std::span<const PointSet> others) {
    std::vector<std::vector<double>> places{places_of(x, y)};
    std::vector<SnapshotDataset> datasets{{.name = "position", .units = "m", .shape = {x.size(), 2}}};
    for (const PointSet& points : others) {
        places.push_back(places_of(points.x, points.y));
        datasets.push_back({.name = points.name, .units = "m", .shape = {points.x.size(), 2}});
    }
    for (const ParticleField& field : fields)
        datasets.push_back({.name = field.name, .units = field.units, .shape = {field.values.size()}});
    file().add(time_s, step, std::move(datasets), [&](Hdf5File& file, const std::string& path, std::size_t d) {
        if (d < places.size())
            file.write(path, ArrayView{places[d].data(), static_cast<int>(places[d].size() / 2), 2, 2});
        else
            file.write(path, fields[d - places.size()].values);
    });
}

} // namespace ductile::io
