#include <ductile/io/particle_snapshots.hpp>
#include <ductile/io/snapshot_file.hpp>

#include <fmt/format.h>

#include <utility>

namespace ductile::io {

ParticleSnapshotWriter::ParticleSnapshotWriter(std::filesystem::path fields, const std::string& program,
                                               const std::optional<EarlierSnapshots>& earlier, const SnapshotConstants& constants)
    : file_(std::make_unique<SnapshotFile>(
          std::move(fields), program, constants, earlier,
          SnapshotFile::Kind{.format = "ductile particles 1",
                             .write_head = {},
                             .check_head = {},
                             .take_over =
                                 [this](const Hdf5File& file, const std::string& group, double time_s) {
                                     Snapshot snapshot{.group = group, .time_s = time_s};
                                     for (const std::string& name : file.members(group)) {
                                         const std::string path = group + "/" + name;
                                         if (name == "position")
                                             snapshot.particles = file.shape(path).at(0);
                                         else
                                             snapshot.fields.emplace_back(name, file.text_attribute(path, "units"));
                                     }
                                     snapshots_.push_back(std::move(snapshot));
                                 },
                             .xdmf = [this](const std::string& hdf5_file) { return xdmf(hdf5_file); }})) {}

ParticleSnapshotWriter::~ParticleSnapshotWriter() { file_->finish_quietly(); }

void ParticleSnapshotWriter::write(double time_s, std::int64_t step, std::span<const double> x, std::span<const double> y,
                                   std::span<const ParticleField> fields) {
    std::vector<double> position(2 * x.size());
    for (std::size_t p = 0; p < x.size(); ++p) {
        position[2 * p] = x[p];
        position[2 * p + 1] = y[p];
    }
    Snapshot snapshot{.time_s = time_s, .particles = x.size()};
    const std::size_t bytes = sizeof(double) * x.size() * (fields.size() + 2);
    file_->add(time_s, step, bytes, fields.size() + 1, [&](Hdf5File& file, const std::string& group) {
        snapshot.group = group;
        file.write(group + "/position", ArrayView{position.data(), static_cast<int>(x.size()), 2, 2});
        file.set_attribute(group + "/position", "units", std::string("m"));
        for (const ParticleField& field : fields) {
            const std::string name = group + "/" + field.name;
            file.write(name, field.values);
            file.set_attribute(name, "units", field.units);
            snapshot.fields.emplace_back(field.name, field.units);
        }
    });
    snapshots_.push_back(std::move(snapshot));
    file_->describe();
}

std::string ParticleSnapshotWriter::xdmf(const std::string& hdf5_file) const {
    const auto item = [&](const std::string& dimensions, const std::string& dataset) {
        return fmt::format(R"(<DataItem Dimensions="{}" NumberType="Float" Precision="8" Format="HDF">{}:/{}</DataItem>)",
                           dimensions, hdf5_file, dataset);
    };
    std::string text = R"(<?xml version="1.0" ?>
<Xdmf Version="3.0">
  <Domain>
    <Grid Name="snapshots" GridType="Collection" CollectionType="Temporal">
)";
    for (const Snapshot& snapshot : snapshots_) {
        text += fmt::format("      <Grid Name=\"{0}\" GridType=\"Uniform\">\n        <Time Value=\"{1}\"/>\n"
                            "        <Topology TopologyType=\"Polyvertex\" NumberOfElements=\"{2}\"/>\n"
                            "        <Geometry GeometryType=\"XY\">{3}</Geometry>\n",
                            snapshot.group, snapshot.time_s, snapshot.particles,
                            item(fmt::format("{} 2", snapshot.particles), snapshot.group + "/position"));
        for (const auto& [name, units] : snapshot.fields)
            text += fmt::format("        <Attribute Name=\"{0}\" AttributeType=\"Scalar\" Center=\"Node\">\n"
                                "          <Information Name=\"units\" Value=\"{1}\"/>\n          {2}\n        </Attribute>\n",
                                name, units, item(fmt::format("{}", snapshot.particles), snapshot.group + "/" + name));
        text += "      </Grid>\n";
    }
    return text + "    </Grid>\n  </Domain>\n</Xdmf>\n";
}

void ParticleSnapshotWriter::finish() { file_->finish(); }

} // namespace ductile::io
