// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/io/snapshot_meshes.hpp>
#include <ductile/io/xdmf.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>
#include <vector>

namespace ductile::io {
namespace {

std::string escaped(const std::string& text) {
    std::string safe;
    for (const char c : text) {
        if (c == '&')
            safe += "&amp;";
        else if (c == '<')
            safe += "&lt;";
        else if (c == '>')
            safe += "&gt;";
        else if (c == '"')
            safe += "&quot;";
        else
            safe += c;
    }
    return safe;
}

/// Writes the description of one file.
class Writer {
public:
    /// `several`: a snapshot may have more than one mesh. XDMFReader wants all snapshots to be alike in that.
    Writer(const std::string& hdf5_file, bool several) : file_(escaped(hdf5_file)), several_(several) {}

    void begin_snapshot(const StoredSnapshot& snapshot) {
        const std::string time = fmt::format("<Time Value=\"{}\"/>", snapshot.time_s);
        if (several_)
            text_ += fmt::format("      <Grid Name=\"{}\" GridType=\"Collection\" CollectionType=\"Spatial\">\n        {}\n",
                                 snapshot.group, time);
        time_ = several_ ? "" : fmt::format("        {}\n", time);
    }
    void end_snapshot() { text_ += several_ ? "      </Grid>\n" : ""; }

    void begin_mesh(const std::string& name, std::string_view topology, const std::string& elements,
                    const std::string& geometry) {
        text_ += fmt::format("      <Grid Name=\"{}\" GridType=\"Uniform\">\n{}        <Topology {}>\n          {}\n"
                             "        </Topology>\n        <Geometry GeometryType=\"XY\">\n          {}\n        </Geometry>\n",
                             escaped(name), time_, topology, elements, geometry);
    }
    void end_mesh() { text_ += "      </Grid>\n"; }

    [[nodiscard]] std::string integers(std::size_t count, const std::string& dataset) const {
        return item(fmt::format("{}", count), "Int", dataset);
    }
    [[nodiscard]] std::string numbers(const std::vector<std::size_t>& shape, const std::string& dataset) const {
        return item(fmt::format("{}", fmt::join(shape, " ")), "Float", dataset);
    }

    void fields(const StoredSnapshot& snapshot) {
        for (const SnapshotDataset& field : snapshot.datasets)
            if (!is_point_set(field))
                attribute(field.name, "Scalar", field, numbers(field.shape, snapshot.group + "/" + field.name));
        for (const CompositeField& field : composites_of(snapshot)) {
            std::vector<std::size_t> shape = field.like->shape;
            shape.push_back(field.parts.size());
            attribute(field.name, type_of(field), *field.like, numbers(shape, view_path(snapshot, field)));
        }
    }

    /// The same fields of points that have none.
    void no_fields(const StoredSnapshot& snapshot, std::size_t points) {
        for (const SnapshotDataset& field : snapshot.datasets)
            if (!is_point_set(field))
                attribute(field.name, "Scalar", field, numbers({points}, no_field_path(points, 1)));
        for (const CompositeField& field : composites_of(snapshot))
            attribute(field.name, type_of(field), *field.like,
                      numbers({points, field.parts.size()}, no_field_path(points, field.parts.size())));
    }

    [[nodiscard]] std::string text() const {
        return R"(<?xml version="1.0" ?>
<Xdmf Version="3.0">
  <Domain>
    <Grid Name="snapshots" GridType="Collection" CollectionType="Temporal">
)" + text_ + "    </Grid>\n  </Domain>\n</Xdmf>\n";
    }

private:
    static const char* type_of(const CompositeField& field) { return field.parts.size() == 3 ? "Vector" : "Tensor"; }
    [[nodiscard]] std::string item(const std::string& dimensions, const char* type, const std::string& dataset) const {
        return fmt::format(R"(<DataItem Dimensions="{}" NumberType="{}" Precision="8" Format="HDF">{}:/{}</DataItem>)",
                           dimensions, type, file_, escaped(dataset));
    }
    void attribute(const std::string& name, const char* type, const SnapshotDataset& like, const std::string& values) {
        text_ += fmt::format("        <Attribute Name=\"{}\" AttributeType=\"{}\" Center=\"{}\">\n"
                             "          <Information Name=\"units\" Value=\"{}\"/>\n          {}\n        </Attribute>\n",
                             escaped(name), type, like.centring == "cell" ? "Cell" : "Node", escaped(like.units), values);
    }

    std::string file_, text_, time_;
    bool several_;
};

} // namespace

std::string xdmf_of_cells(const std::string& hdf5_file, int cells_x, int cells_y, std::span<const StoredSnapshot> snapshots) {
    Writer writer(hdf5_file, false);
    const std::size_t columns = static_cast<std::size_t>(cells_x), rows = static_cast<std::size_t>(cells_y);
    for (const StoredSnapshot& snapshot : snapshots) {
        writer.begin_snapshot(snapshot);
        writer.begin_mesh(snapshot.group, fmt::format("TopologyType=\"Quadrilateral\" NumberOfElements=\"{}\"", rows * columns),
                          writer.integers(4 * rows * columns, "grid/corners_of_cells"),
                          writer.numbers({(rows + 1) * (columns + 1), 2}, "grid/corners"));
        writer.fields(snapshot);
        writer.end_mesh();
        writer.end_snapshot();
    }
    return writer.text();
}

std::string xdmf_of_points(const std::string& hdf5_file, std::span<const StoredSnapshot> snapshots) {
    Writer writer(hdf5_file, std::ranges::any_of(snapshots, [](const StoredSnapshot& snapshot) {
                      return std::ranges::count_if(snapshot.datasets, is_point_set) > 1;
                  }));
    for (const StoredSnapshot& snapshot : snapshots) {
        writer.begin_snapshot(snapshot);
        for (const SnapshotDataset& places : snapshot.datasets) {
            if (!is_point_set(places))
                continue;
            const std::size_t points = places.shape.front();
            const bool has_fields = &places == &snapshot.datasets.front();
            writer.begin_mesh(has_fields ? "particles" : places.name,
                              fmt::format("TopologyType=\"Polyvertex\" NumberOfElements=\"{}\" NodesPerElement=\"1\"", points),
                              writer.integers(points, vertices_path(points)),
                              writer.numbers(places.shape, snapshot.group + "/" + places.name));
            if (has_fields)
                writer.fields(snapshot);
            else
                writer.no_fields(snapshot, points);
            writer.end_mesh();
        }
        writer.end_snapshot();
    }
    return writer.text();
}

} // namespace ductile::io
