// SPDX-License-Identifier: GPL-3.0-or-later
// What snapshots hold beside the state: against closed forms, and numbers worked out here.
#include "fields.hpp"
#include "hdf5_values.hpp"
#include "io_scratch.hpp"
#include "mpm_scenes.hpp"

#include <ductile/mpm/output.hpp>
#include <ductile/quasistatic/initial.hpp>
#include <ductile/quasistatic/output.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <doctest/doctest.h>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <vector>

namespace snapshot_fields_suite {

using namespace ductile;
using doctest::Approx;

namespace {

/// Rows of a 3 x 3 matrix, times another.
using Matrix = std::array<double, 9>;
double contraction(std::span<const double> a, std::span<const double> b) {
    double sum = 0.0;
    for (std::size_t k = 0; k < 9; ++k)
        sum += a[k] * b[k];
    return sum;
}
Matrix deviator(std::span<const double> a) {
    Matrix d;
    for (std::size_t k = 0; k < 9; ++k)
        d[k] = a[k] - (k % 4 == 0 ? (a[0] + a[4] + a[8]) / 3.0 : 0.0);
    return d;
}

/// The file of one snapshot.
struct GridFile {
    GridFile(const quasistatic::Scene& scene, const quasistatic::State& state) {
        const Grid& g = scene.grid;
        io::SnapshotWriter writer(folder / "fields.h5", "test", {g.cells_x, g.cells_y, g.width, g.height, 0.0, 0.0});
        quasistatic::write_snapshot(scene, *fields::space_for(scene), state, {}, {}, 0.5, 3, writer);
    }
    [[nodiscard]] scratch::Values read(const std::string& name) const { return scratch::values_of(folder / "fields.h5", name); }
    [[nodiscard]] std::vector<double> operator()(const std::string& field) const {
        return read("snapshots/000000/" + field).values;
    }
    scratch::Folder folder;
};

struct PointsFile {
    PointsFile(const mpm::Scene& scene, const mpm::Particles& start, const mpm::State& state) {
        io::ParticleSnapshotWriter writer(folder / "fields.h5", "test");
        mpm::write_snapshot(scene, start, state, writer);
    }
    [[nodiscard]] std::vector<double> operator()(const std::string& field) const {
        return scratch::values_of(folder / "fields.h5", "snapshots/000000/" + field).values;
    }
    [[nodiscard]] scratch::Values view(const std::string& field) const {
        return scratch::values_of(folder / "fields.h5", "views/000000/" + field);
    }
    scratch::Folder folder;
};

} // namespace

TEST_SUITE_BEGIN("snapshot_fields");

TEST_CASE_FIXTURE(fields::OneThread, "grid: the stress in x, y, z is that of p, s, tau, q, in SI, and so is its tensor") {
    const quasistatic::Scene scene = fields::scene_on({5, 4, 2.0, 3.0}, quasistatic::Model::full, {2e-7, 0.0});
    quasistatic::State state =
        fields::initial_state(scene, initial_internal(scene.grid, quasistatic::Uniform{0.03}, scene.law->variables()[0]));
    std::mt19937 engine(7);
    for (Field* f : {&state.cells.stress.p, &state.cells.stress.s, &state.cells.stress.tau, &state.cells.stress.q})
        fields::fill_randomly(*f, engine, -0.5, 0.5);
    const GridFile file(scene, state);
    const std::vector<double> p = file("pressure"), s = file("s"), tau = file("tau"), q = file("q"),
                              mises = file("von_mises_stress"), xx = file("stress_xx"), yy = file("stress_yy"),
                              zz = file("stress_zz"), xy = file("stress_xy");
    const scratch::Values tensor = file.read("views/000000/stress");
    REQUIRE(tensor.shape == std::vector<hsize_t>{4, 5, 9});
    for (std::size_t c = 0; c < 20; ++c) {
        const Matrix stress{xx[c], xy[c], 0.0, xy[c], yy[c], 0.0, 0.0, 0.0, zz[c]};
        for (std::size_t k = 0; k < 9; ++k)
            CHECK(tensor.values[9 * c + k] == stress[k]);
        const Matrix deviatoric = deviator(stress);
        const auto near = [](double x) { return Approx(x).scale(1e9).epsilon(1e-14); };
        CHECK(-(xx[c] + yy[c] + zz[c]) / 3.0 == near(p[c]));
        CHECK((xx[c] - yy[c]) / 2.0 == near(s[c]));
        CHECK(xy[c] == tau[c]);
        CHECK(deviatoric[8] / 2.0 == near(q[c]));
        CHECK(mises[c] == near(std::sqrt(1.5 * contraction(deviatoric, deviatoric))));
    }
    CHECK(xy[7] == state.cells.stress.tau(2, 1) * 0.85e9);
}

TEST_CASE_FIXTURE(fields::OneThread, "grid: stress_xy is a second name of tau, in a continued file, too") {
    const quasistatic::Scene scene = fields::scene_on({5, 4, 2.0, 3.0}, quasistatic::Model::full, {2e-7, 0.0});
    quasistatic::State state =
        fields::initial_state(scene, initial_internal(scene.grid, quasistatic::Uniform{0.03}, scene.law->variables()[0]));
    std::mt19937 engine(7);
    fields::fill_randomly(state.cells.stress.tau, engine, -0.5, 0.5);
    const GridFile file(scene, state);
    const std::vector<double> tau = file("tau");
    const auto check = [&] {
        const auto offset_of = [&](const char* name) {
            return io::Hdf5File::open(file.folder / "fields.h5").byte_offset(std::string("snapshots/000000/") + name);
        };
        CHECK(offset_of("stress_xy") == offset_of("tau"));
        CHECK(file("stress_xy") == tau);
        CHECK(file("tau") == tau);
        CHECK(file.read("views/000000/stress").values[1] == tau[0]);
    };
    check();
    io::SnapshotWriter(file.folder / "fields.h5", "test", {5, 4, 2.0, 3.0, 0.0, 0.0},
                       io::EarlierSnapshots{.fields = file.folder / "fields.h5", .until_s = 1.0, .count = 1});
    check();
}

TEST_CASE_FIXTURE(fields::OneThread,
                  "grid: the plastic strain rate is the law's, and makes the plastic power; none below yield") {
    for (const Law& law :
         {fields::glass_law, perzyna_law(fields::metallic_glass, {.yield_stress = 0.85e9, .reference_rate = 0.5}, Units{})}) {
        const quasistatic::Scene scene = fields::scene_on({6, 4}, quasistatic::Model::full, {2e-7, 0.0}, law);
        quasistatic::State state =
            fields::initial_state(scene, initial_internal(scene.grid, quasistatic::Uniform{0.03}, scene.law->variables()[0]));
        std::mt19937 engine(8);
        for (Field* f : {&state.cells.stress.s, &state.cells.stress.tau, &state.cells.stress.q})
            fields::fill_randomly(*f, engine, 0.1, 0.8); // on both sides of yield
        const GridFile file(scene, state);
        const std::vector<double> rate = file("plastic_strain_rate"), mises = file("von_mises_stress");
        int flowing = 0;
        double power = 0.0; // [W/m^3] times cells
        for (std::size_t c = 0; c < rate.size(); ++c) {
            const int i = static_cast<int>(c % 6), j = static_cast<int>(c / 6);
            const StressField& stress = state.cells.stress;
            const double sbar = std::sqrt(stress.s(i, j) * stress.s(i, j) + stress.tau(i, j) * stress.tau(i, j) +
                                          3.0 * stress.q(i, j) * stress.q(i, j));
            const double internal[] = {state.cells.internal[0](i, j)};
            const FlowAt flow = law->flow_at(sbar, internal);
            // D^pl/sbar sigma_0 has the magnitude sqrt(2) D^pl
            CHECK(rate[c] == Approx(std::sqrt(2.0 / 3.0) * std::sqrt(2.0) * flow.fluidity * sbar / 4.05e-6).epsilon(1e-10));
            CHECK((rate[c] > 0.0) == (sbar > flow.yield_stress));
            flowing += rate[c] > 0.0 ? 1 : 0;
            power += mises[c] * rate[c];
        }
        CHECK(flowing > 3);
        CHECK(flowing < 24);
        CellState powers = fields::cells_of(scene);
        fields::space_for(scene)->plastic_rate(state.cells, powers);
        CHECK(power * scene.grid.width * scene.grid.height / 24.0 ==
              Approx(powers.energy.dissipation * 0.85e9 / 4.05e-6).epsilon(1e-10));
    }
}

TEST_CASE_FIXTURE(fields::OneThread, "grid: the velocity of a cell is the mean of its corners, across the period, too") {
    const quasistatic::Scene scene = fields::scene_on({4, 5}, quasistatic::Model::full, {2e-7, 0.0});
    quasistatic::State state =
        fields::initial_state(scene, initial_internal(scene.grid, quasistatic::Uniform{0.03}, scene.law->variables()[0]));
    for (int j = 0; j <= 5; ++j)
        for (int i = 0; i < 4; ++i) {
            state.velocity.u(i, j) = i + 10.0 * j;
            state.velocity.v(i, j) = -2.0 * i * j;
        }
    fields::wrap(state.velocity.u);
    fields::wrap(state.velocity.v);
    const GridFile file(scene, state);
    const std::vector<double> u = file("cell_velocity_x"), v = file("cell_velocity_y");
    const double unit = 0.01 / 4.05e-6;
    for (std::size_t j = 0; j < 5; ++j)
        for (std::size_t i = 0; i < 4; ++i) {
            const double x = i < 3 ? static_cast<double>(i) + 0.5 : 1.5, y = static_cast<double>(j) + 0.5; // between 3 and 0
            CHECK(u[4 * j + i] == Approx(unit * (x + 10.0 * y)).epsilon(1e-14));
            CHECK(v[4 * j + i] == Approx(unit * -2.0 * x * y).epsilon(1e-14));
        }
    for (const auto& [vector, x, y, columns, rows] :
         {std::tuple{"velocity", file("velocity_x"), file("velocity_y"), 5, 6}, {"cell_velocity", u, v, 4, 5}}) {
        const scratch::Values view = file.read(std::string("views/000000/") + vector);
        REQUIRE(view.shape == std::vector<hsize_t>{static_cast<hsize_t>(rows), static_cast<hsize_t>(columns), 3});
        for (std::size_t c = 0; c < x.size(); ++c) {
            CHECK(view.values[3 * c] == x[c]);
            CHECK(view.values[3 * c + 1] == y[c]);
            CHECK(view.values[3 * c + 2] == 0.0);
        }
    }
}

TEST_CASE("points: displacements are those from the start, however the particles are sorted") {
    mpm_scenes::Block block = mpm_scenes::block(mpm::ShapeFunction::linear);
    mpm::Particles& particles = block.state.particles;
    const mpm::Particles start = particles;
    for (std::size_t p = 0; p < particles.size(); ++p) {
        particles.x[p] += 0.01 * particles.y[p];
        particles.y[p] -= 0.02;
    }
    std::vector<std::int32_t> order(particles.size());
    std::iota(order.rbegin(), order.rend(), 0);
    mpm::Particles::PermutationBuffers buffers;
    particles.permute(order, buffers);
    const PointsFile file(block.scene, start, block.state);
    const std::vector<double> u = file("displacement_x"), v = file("displacement_y"), places = file("position");
    for (std::size_t p = 0; p < u.size(); ++p) {
        CHECK(u[p] == Approx(0.01 * (places[2 * p + 1] + 0.02)).epsilon(1e-12));
        CHECK(v[p] == Approx(-0.02).epsilon(1e-12));
    }
    const scratch::Values view = file.view("displacement");
    REQUIRE(view.shape == std::vector<hsize_t>{u.size(), 3});
    CHECK(view.values[3 * 7] == u[7]);
    CHECK(view.values[3 * 7 + 1] == v[7]);
    CHECK(view.values[3 * 7 + 2] == 0.0);
}

TEST_CASE("points: across a periodic side the displacement goes on") {
    mpm_scenes::Block block = mpm_scenes::block(mpm::ShapeFunction::linear);
    block.scene.grid.sides.left = block.scene.grid.sides.right = mpm::SideCondition::periodic;
    const mpm::Particles start = block.state.particles;
    for (double& x : block.state.particles.x)
        x += x + 0.3 > 0.8 ? 0.3 - 0.8 : 0.3; // the grid is from 0 to 0.8
    for (const double u : PointsFile(block.scene, start, block.state)("displacement_x"))
        CHECK(u == Approx(0.3).epsilon(1e-12));
}

TEST_CASE("points: pressure, stress of von Mises and volume") {
    for (const mpm::Geometry geometry : mpm_scenes::all_geometries) {
        mpm_scenes::Block block = mpm_scenes::block(mpm::ShapeFunction::linear, geometry);
        mpm::Particles& particles = block.state.particles;
        mpm_scenes::stress_randomly(block.scene, particles, 5.0);
        particles.stress_xx[0] = particles.stress_zz[0] = particles.stress_xy[0] = 0.0; // a bar that is pulled,
        particles.stress_yy[0] = 6.0;
        particles.stress_xx[1] = particles.stress_yy[1] = particles.stress_zz[1] = 0.0; // and sheared
        particles.stress_xy[1] = -2.0;
        const PointsFile file(block.scene, particles, block.state);
        const std::vector<double> pressure = file("pressure"), mises = file("von_mises_stress"), volume = file("volume");
        CHECK(pressure[0] == -2.0);
        CHECK(mises[0] == Approx(6.0).epsilon(1e-15));
        CHECK(pressure[1] == 0.0);
        CHECK(mises[1] == Approx(2.0 * std::numbers::sqrt3).epsilon(1e-15));
        const scratch::Values tensor = file.view("stress");
        REQUIRE(tensor.shape == std::vector<hsize_t>{particles.size(), 9});
        double whole = 0.0;
        for (std::size_t p = 0; p < particles.size(); ++p) {
            const std::span<const double> stress = std::span(tensor.values).subspan(9 * p, 9);
            const Matrix written{particles.stress_xx[p],
                                 particles.stress_xy[p],
                                 0.0,
                                 particles.stress_xy[p],
                                 particles.stress_yy[p],
                                 0.0,
                                 0.0,
                                 0.0,
                                 particles.stress_zz[p]};
            CHECK(std::ranges::equal(stress, written));
            CHECK(pressure[p] == Approx(-(stress[0] + stress[4] + stress[8]) / 3.0).scale(1.0).epsilon(1e-14));
            const Matrix deviatoric = deviator(stress);
            CHECK(mises[p] == Approx(std::sqrt(1.5 * contraction(deviatoric, deviatoric))).epsilon(1e-14));
            whole += volume[p];
        }
        // of a square of 0.4 m, a metre thick; of a ring, 1 rad
        CHECK(whole == Approx(geometry == mpm::Geometry::axisymmetric ? 0.4 * 0.5 * (0.36 - 0.04) : 0.16).epsilon(1e-12));
    }
}

TEST_CASE("points: rigid bodies are where they have moved to") {
    mpm_scenes::Block block = mpm_scenes::block(mpm::ShapeFunction::linear);
    block.state.rigid_bodies.push_back(
        {.name = "ram", .velocity = {Velocity{0.1, -0.2}}, .x = {0.1, 0.2, 0.3}, .y = {0.7, 0.7, 0.8}});
    mpm::move_rigid_bodies(block.state, 0.5);
    const std::vector<double> places = PointsFile(block.scene, block.state.particles, block.state)("rigid_body_ram");
    const std::vector<double> expected{0.15, 0.6, 0.25, 0.6, 0.35, 0.7};
    REQUIRE(places.size() == 6);
    for (std::size_t k = 0; k < 6; ++k)
        CHECK(places[k] == Approx(expected[k]).epsilon(1e-14));
}

TEST_SUITE_END();

} // namespace snapshot_fields_suite
