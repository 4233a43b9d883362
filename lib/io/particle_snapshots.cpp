#include <ductile/base/error.hpp>
#include <ductile/io/atomic_file.hpp>
#include <ductile/io/particle_snapshots.hpp>
#include <ductile/io/version.hpp>

#include <fmt/format.h>

namespace fs = std::filesystem;

namespace ductile::io {

namespace {
constexpr const char* format_name = "ductile particles 1";
} // namespace

ParticleSnapshotWriter::ParticleSnapshotWriter(fs::path fields, const std::string& program,
                                               const std::optional<EarlierSnapshots>& earlier, const SnapshotConstants& constants)
    : final_(std::move(fields)), partial_(final_) {
    partial_ += ".partial";
    AtomicFile target(partial_);
    Hdf5File file = Hdf5File::create(target.temporary_path());
    file.set_attribute("/", "format", std::string(format_name));
    file.set_attribute("/", "program", program);
    file.set_attribute("/", "version", version());
    for (const auto& [name, value] : constants)
        file.set_attribute("/", name, value);
    file.create_group("snapshots");
    if (earlier)
        copy(*earlier, file);
    file.close();
    target.commit();
    write_xdmf_file(partial_);
}

ParticleSnapshotWriter::~ParticleSnapshotWriter() {
    try {
        finish();
    } catch (const Error&) {
        // The partial file stays behind; who wants to know calls finish().
    }
}

void ParticleSnapshotWriter::copy(const EarlierSnapshots& earlier, Hdf5File& file) {
    // The partial form goes first: it began as a copy of the finished one.
    fs::path source = earlier.fields;
    source += ".partial";
    if (!fs::exists(source))
        source = earlier.fields;
    if (!fs::exists(source))
        return;
    const Hdf5File old = Hdf5File::open(source);
    if (!old.has_attribute("/", "format") || old.text_attribute("/", "format") != format_name)
        throw InputError(fmt::format("{}: this is not a file of format '{}': move it away to go on without earlier snapshots",
                                     source.string(), format_name));
    for (const std::string& member : old.members("snapshots")) {
        Snapshot snapshot{.group = "snapshots/" + member, .time_s = 0.0, .particles = 0, .fields = {}};
        snapshot.time_s = old.double_attribute(snapshot.group, "time_s");
        if (snapshot.time_s > earlier.until_s)
            break;
        for (const std::string& name : old.members(snapshot.group)) {
            const std::string path = snapshot.group + "/" + name;
            if (name == "position")
                snapshot.particles = old.shape(path).at(0);
            else
                snapshot.fields.emplace_back(name, old.text_attribute(path, "units"));
        }
        file.copy_from(old, snapshot.group);
        snapshots_.push_back(std::move(snapshot));
    }
}

void ParticleSnapshotWriter::write(double time_s, std::int64_t step, std::span<const double> x, std::span<const double> y,
                                   std::span<const ParticleField> fields) {
    Snapshot snapshot{fmt::format("snapshots/{:06}", snapshots_.size()), time_s, x.size(), {}};
    std::vector<double> position(2 * x.size());
    for (std::size_t p = 0; p < x.size(); ++p) {
        position[2 * p] = x[p];
        position[2 * p + 1] = y[p];
    }
    AtomicFile target(partial_);
    std::error_code error;
    fs::copy_file(partial_, target.temporary_path(), fs::copy_options::overwrite_existing, error);
    if (error)
        throw RunError(fmt::format("{}: cannot make room for the next snapshot ({}): free space and restart from the checkpoint",
                                   partial_.string(), error.message()));
    Hdf5File file = Hdf5File::open_for_append(target.temporary_path());
    file.create_group(snapshot.group);
    file.set_attribute(snapshot.group, "time_s", time_s);
    file.set_attribute(snapshot.group, "step", step);
    const auto count = static_cast<int>(x.size());
    file.write(snapshot.group + "/position", ArrayView{position.data(), count, 2, 2});
    file.set_attribute(snapshot.group + "/position", "units", std::string("m"));
    for (const ParticleField& field : fields) {
        const std::string name = snapshot.group + "/" + field.name;
        file.write(name, field.values);
        file.set_attribute(name, "units", field.units);
        snapshot.fields.emplace_back(field.name, field.units);
    }
    file.close();
    target.commit();
    snapshots_.push_back(std::move(snapshot));
    write_xdmf_file(partial_);
}

void ParticleSnapshotWriter::write_xdmf_file(const fs::path& data) const {
    const auto item = [&](const std::string& dimensions, const std::string& dataset) {
        return fmt::format(R"(<DataItem Dimensions="{}" NumberType="Float" Precision="8" Format="HDF">{}:/{}</DataItem>)",
                           dimensions, data.filename().string(), dataset);
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
    fs::path path = final_;
    path.replace_extension(".xdmf");
    write_text_atomically(path, text + "    </Grid>\n  </Domain>\n</Xdmf>\n");
}

void ParticleSnapshotWriter::finish() {
    if (finished_)
        return;
    finished_ = true;
    rename_durably(partial_, final_);
    write_xdmf_file(final_);
}

} // namespace ductile::io
