#include <ductile/io/particle_snapshots.hpp>
#include <ductile/io/snapshot_file.hpp>

#include <fmt/format.h>

#include <utility>

namespace ductile::io {

namespace {

std::string xdmf(const std::string& hdf5_file, std::span<const StoredSnapshot> snapshots) {
    const auto item = [&](const std::string& dimensions, const std::string& dataset) {
        return fmt::format(R"(<DataItem Dimensions="{}" NumberType="Float" Precision="8" Format="HDF">{}:/{}</DataItem>)",
                           dimensions, hdf5_file, dataset);
    };
    std::string text = R"(<?xml version="1.0" ?>
<Xdmf Version="3.0">
  <Domain>
    <Grid Name="snapshots" GridType="Collection" CollectionType="Temporal">
)";
    for (const StoredSnapshot& snapshot : snapshots) {
        const std::size_t particles = snapshot.datasets.front().shape.front();
        text += fmt::format("      <Grid Name=\"{0}\" GridType=\"Uniform\">\n        <Time Value=\"{1}\"/>\n"
                            "        <Topology TopologyType=\"Polyvertex\" NumberOfElements=\"{2}\"/>\n"
                            "        <Geometry GeometryType=\"XY\">{3}</Geometry>\n",
                            snapshot.group, snapshot.time_s, particles,
                            item(fmt::format("{} 2", particles), snapshot.group + "/position"));
        for (const SnapshotDataset& field : std::span(snapshot.datasets).subspan(1))
            text += fmt::format("        <Attribute Name=\"{0}\" AttributeType=\"Scalar\" Center=\"Node\">\n"
                                "          <Information Name=\"units\" Value=\"{1}\"/>\n          {2}\n        </Attribute>\n",
                                field.name, field.units, item(fmt::format("{}", particles), snapshot.group + "/" + field.name));
        text += "      </Grid>\n";
    }
    return text + "    </Grid>\n  </Domain>\n</Xdmf>\n";
}

} // namespace

ParticleSnapshotWriter::ParticleSnapshotWriter(std::filesystem::path fields, const std::string& program,
                                               const std::optional<EarlierSnapshots>& earlier, const SnapshotConstants& constants)
    : Snapshots(std::make_unique<SnapshotFile>(
          std::move(fields), program, constants, earlier,
          SnapshotFile::Kind{.format = "ductile particles 1", .grid = {}, .write_head = {}, .xdmf = xdmf})) {}

void ParticleSnapshotWriter::write(double time_s, std::int64_t step, std::span<const double> x, std::span<const double> y,
                                   std::span<const ParticleField> fields) {
    std::vector<double> position(2 * x.size());
    for (std::size_t p = 0; p < x.size(); ++p) {
        position[2 * p] = x[p];
        position[2 * p + 1] = y[p];
    }
    std::vector<SnapshotDataset> datasets{{.name = "position", .units = "m", .shape = {x.size(), 2}}};
    for (const ParticleField& field : fields)
        datasets.push_back({.name = field.name, .units = field.units, .shape = {field.values.size()}});
    file().add(time_s, step, std::move(datasets), [&](Hdf5File& file, const std::string& path, std::size_t d) {
        if (d == 0)
            file.write(path, ArrayView{position.data(), static_cast<int>(x.size()), 2, 2});
        else
            file.write(path, fields[d - 1].values);
    });
}

} // namespace ductile::io
