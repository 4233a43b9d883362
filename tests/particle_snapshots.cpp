// SPDX-License-Identifier: GPL-3.0-or-later
// Snapshots of particles in HDF5, described for ParaView.
#include "hdf5_values.hpp"
#include "io_scratch.hpp"
#include "messages.hpp"

#include <ductile/io/particle_snapshots.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace particle_snapshots_suite {

using namespace ductile;
using namespace ductile::io;

namespace {

const std::vector<double> x{0.1, 0.2, 0.3}, y{1.0, 2.0, 3.0}, stress{5.0, -6.0, 7e-300};

void write(ParticleSnapshotWriter& writer, double time, std::int64_t step, std::size_t particles) {
    const std::array fields{ParticleField{"stress_xx", "Pa", std::span(stress).first(particles)}};
    writer.write(time, step, std::span(x).first(particles), std::span(y).first(particles), fields);
}

} // namespace

TEST_SUITE_BEGIN("particle_snapshots");

TEST_CASE("what was written is read back, with its units, whatever the number of particles") {
    const scratch::Folder folder;
    ParticleSnapshotWriter writer(folder / "fields.h5", "upsetting", {}, {{"cell_width_m", 0.25}});
    write(writer, 0.0, 0, 3);
    CHECK_FALSE(scratch::fs::exists(folder / "fields.h5")); // it has its final name at the end only
    write(writer, 0.5, 7, 2);
    writer.finish();
    const Hdf5File file = Hdf5File::open(folder / "fields.h5");
    CHECK(file.text_attribute("/", "format") == "ductile particles 1");
    CHECK(file.text_attribute("/", "program") == "upsetting");
    CHECK(file.double_attribute("/", "cell_width_m") == 0.25);
    CHECK(file.members("snapshots") == std::vector<std::string>{"000000", "000001"});
    CHECK(file.double_attribute("snapshots/000001", "time_s") == 0.5);
    CHECK(file.integer_attribute("snapshots/000001", "step") == 7);
    CHECK(file.read_doubles("snapshots/000000/stress_xx") == stress);
    CHECK(file.text_attribute("snapshots/000000/stress_xx", "units") == "Pa");
    std::vector<double> position(4);
    file.read("snapshots/000001/position", {position.data(), 2, 2, 2});
    CHECK(position == std::vector<double>{0.1, 1.0, 0.2, 2.0});
    const std::string xdmf = scratch::read(folder / "fields.xdmf");
    CHECK(contains(xdmf, "TopologyType=\"Polyvertex\" NumberOfElements=\"2\" NodesPerElement=\"1\""));
    CHECK(contains(xdmf, "fields.h5:/vertices/2<"));
    CHECK(file.read_integers("vertices/2") == std::vector<std::int64_t>{0, 1});
    CHECK(file.read_integers("vertices/3") == std::vector<std::int64_t>{0, 1, 2});
    CHECK(contains(xdmf, "fields.h5:/snapshots/000001/position"));
    CHECK(contains(xdmf, "<Time Value=\"0.5\"/>"));
}

TEST_CASE("ParaView finds vectors, tensors and other points; a continued run has the bytes of one that never stopped") {
    const scratch::Folder folder;
    const std::array fields{ParticleField{"u_x", "m", y},         ParticleField{"u_y", "m", stress},
                            ParticleField{"sigma_xx", "Pa", x},   ParticleField{"sigma_yy", "Pa", y},
                            ParticleField{"sigma_zz", "Pa", x},   ParticleField{"sigma_xy", "Pa", stress},
                            ParticleField{"alone_x", "1", stress}};
    const std::array others{PointSet{"ram <1>", std::span(x).first(2), std::span(y).first(2)},
                            PointSet{"die_x", std::span(x).first(1), std::span(y).first(1)},
                            PointSet{"die_y", std::span(x).first(1), std::span(y).first(1)}}; // not a vector
    const auto run = [&](const char* name, int first, int last, const std::optional<EarlierSnapshots>& earlier = {}) {
        ParticleSnapshotWriter writer(folder / name, "upsetting", earlier);
        for (int k = first; k < last; ++k)
            writer.write(k, k, x, y, fields, others);
    };
    { // before there were other points
        ParticleSnapshotWriter writer(folder / "old.h5", "upsetting");
        writer.write(0.0, 0, x, y, fields);
    }
    run("old.h5", 1, 2, EarlierSnapshots{folder / "old.h5", 0.5, 1});
    CHECK(contains(scratch::read(folder / "old.xdmf"),
                   "<Grid Name=\"snapshots/000000\" GridType=\"Collection\" CollectionType=\"Spatial\">"));
    run("whole.h5", 0, 3);
    run("fields.h5", 0, 2);
    run("fields.h5", 1, 3, EarlierSnapshots{folder / "fields.h5", 0.5, 1});
    CHECK(scratch::read(folder / "fields.h5") == scratch::read(folder / "whole.h5"));
    const auto [u_shape, u] = scratch::values_of(folder / "fields.h5", "views/000002/u");
    const auto [sigma_shape, sigma] = scratch::values_of(folder / "fields.h5", "views/000002/sigma");
    CHECK(u_shape == std::vector<hsize_t>{3, 3});
    REQUIRE(sigma_shape == std::vector<hsize_t>{3, 9});
    CHECK(u == std::vector<double>{y[0], stress[0], 0.0, y[1], stress[1], 0.0, y[2], stress[2], 0.0});
    CHECK(std::vector(sigma.begin() + 9, sigma.begin() + 18) ==
          std::vector<double>{x[1], stress[1], 0.0, stress[1], y[1], 0.0, 0.0, 0.0, x[1]});
    const auto [none_shape, none] = scratch::values_of(folder / "whole.h5", "none/2x3");
    CHECK(none_shape == std::vector<hsize_t>{2, 3});
    CHECK(std::ranges::all_of(none, [](double value) { return std::isnan(value); }));
    const Hdf5File file = Hdf5File::open(folder / "fields.h5");
    CHECK(file.members("views/000002") == std::vector<std::string>{"sigma", "u"});
    CHECK(file.text_attribute("views/000002/u", "units") == "m");
    const std::string xdmf = scratch::read(folder / "fields.xdmf");
    CHECK(contains(xdmf, "<Attribute Name=\"u\" AttributeType=\"Vector\" Center=\"Node\">"));
    CHECK(
        contains(xdmf, "Dimensions=\"3 9\" NumberType=\"Float\" Precision=\"8\" Format=\"HDF\">fields.h5:/views/000002/sigma<"));
    CHECK(contains(xdmf, "<Grid Name=\"snapshots/000001\" GridType=\"Collection\" CollectionType=\"Spatial\">"));
    CHECK(contains(xdmf, "<Grid Name=\"ram &lt;1&gt;\" GridType=\"Uniform\">"));
    CHECK_FALSE(contains(xdmf, "Name=\"alone\""));
    CHECK(contains(xdmf, "Dimensions=\"2 9\" NumberType=\"Float\" Precision=\"8\" Format=\"HDF\">fields.h5:/none/2x9<"));
}

TEST_CASE("a continued run keeps the snapshots up to its checkpoint") {
    const scratch::Folder folder;
    {
        ParticleSnapshotWriter first(folder / "fields.h5", "upsetting");
        for (const double time : {0.0, 1.0, 2.0})
            write(first, time, static_cast<std::int64_t>(time), 3);
    }
    ParticleSnapshotWriter second(folder / "fields.h5", "upsetting", EarlierSnapshots{folder / "fields.h5", 1.5, 2});
    write(second, 2.5, 3, 3);
    second.finish();
    const Hdf5File file = Hdf5File::open(folder / "fields.h5");
    CHECK(file.members("snapshots").size() == 3);
    CHECK(file.double_attribute("snapshots/000001", "time_s") == 1.0);
    CHECK(file.double_attribute("snapshots/000002", "time_s") == 2.5);
    CHECK(contains(scratch::read(folder / "fields.xdmf"), "<Time Value=\"1\"/>"));
}

TEST_CASE("earlier snapshots of another kind are refused; a full disk leaves the earlier ones whole") {
    const scratch::Folder folder;
    { const SnapshotWriter fields(folder / "fields.h5", "upsetting", SnapshotGrid{.cells_x = 1, .cells_y = 1}); }
    CHECK(contains(message_of<InputError>([&] {
                       ParticleSnapshotWriter(folder / "fields.h5", "upsetting", EarlierSnapshots{folder / "fields.h5", 1.0, 0});
                   }),
                   "not a file of format 'ductile particles 1'"));

    const std::vector<double> many(20'000, 1.0);
    ParticleSnapshotWriter writer(folder / "other.h5", "upsetting");
    write(writer, 0.0, 0, 3);
    {
        const scratch::FileSizeLimit limit(50'000);
        CHECK_THROWS_AS(writer.write(1.0, 1, many, many, {}), RunError);
    }
    writer.finish();
    const Hdf5File file = Hdf5File::open(folder / "other.h5");
    CHECK(file.members("snapshots").size() == 1);
    CHECK(file.read_doubles("snapshots/000000/stress_xx") == stress);
}

TEST_SUITE_END();

} // namespace particle_snapshots_suite
