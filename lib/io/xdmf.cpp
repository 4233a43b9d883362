#include <ductile/io/xdmf.hpp>

#include <fmt/format.h>

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

std::string data_item(const std::string& dimensions, const std::string& file, const std::string& dataset) {
    return fmt::format(R"(<DataItem Dimensions="{}" NumberType="Float" Precision="8" Format="HDF">{}:/{}</DataItem>)", dimensions,
                       escaped(file), escaped(dataset));
}

} // namespace

std::string xdmf_text(const std::string& hdf5_file, int cells_x, int cells_y, std::span<const XdmfSnapshot> snapshots) {
    const std::string x = data_item(fmt::format("{}", cells_x + 1), hdf5_file, "grid/x_corner");
    const std::string y = data_item(fmt::format("{}", cells_y + 1), hdf5_file, "grid/y_corner");
    const std::string corners = fmt::format("{} {}", cells_y + 1, cells_x + 1), cells = fmt::format("{} {}", cells_y, cells_x);
    std::string text = R"(<?xml version="1.0" ?>
<Xdmf Version="3.0">
  <Domain>
    <Grid Name="snapshots" GridType="Collection" CollectionType="Temporal">
)";
    for (const XdmfSnapshot& snapshot : snapshots) {
        text += fmt::format(R"(      <Grid Name="{}" GridType="Uniform">
        <Time Value="{}"/>
        <Topology TopologyType="2DRectMesh" Dimensions="{}"/>
        <Geometry GeometryType="VXVY">
          {}
          {}
        </Geometry>
)",
                            snapshot.group, snapshot.time_s, corners, x, y);
        for (const XdmfField& field : snapshot.fields)
            text += fmt::format(R"(        <Attribute Name="{}" AttributeType="Scalar" Center="{}">
          <Information Name="units" Value="{}"/>
          {}
        </Attribute>
)",
                                escaped(field.name), field.at_cells ? "Cell" : "Node", escaped(field.units),
                                data_item(field.at_cells ? cells : corners, hdf5_file, snapshot.group + "/" + field.name));
        text += "      </Grid>\n";
    }
    return text + "    </Grid>\n  </Domain>\n</Xdmf>\n";
}

} // namespace ductile::io
