// SPDX-License-Identifier: GPL-3.0-or-later
// What scenes are made of: histories of velocity, shapes, particles and fields from files.
#include "capture.hpp"
#include "fields.hpp"
#include "io_scratch.hpp"
#include "messages.hpp"

#include <ductile/io/hdf5.hpp>
#include <ductile/io/output_times.hpp>
#include <ductile/material/linear_elastic.hpp>
#include <ductile/material/von_mises.hpp>
#include <ductile/mpm/discretisation.hpp>
#include <ductile/mpm/particle_file.hpp>
#include <ductile/mpm/step_control.hpp>
#include <ductile/quasistatic/initial_file.hpp>
#include <ductile/quasistatic/projection.hpp>
#include <ductile/scene/history.hpp>
#include <ductile/scene/shape.hpp>

#include <array>
#include <cmath>
#include <doctest/doctest.h>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

namespace scene_parts_suite {

using namespace ductile;

namespace {

using Motion = History<Velocity>;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Two points, 0.15 m above the left lower corner's cell, on a grid of 0.1 m.
const mpm::Grid grid{.cells_x = 10, .cells_y = 10, .width = 1.0, .height = 1.0};
mpm::State moved_by(const Motion& motion) {
    mpm::State state;
    state.rigid_bodies.push_back({.name = "platen", .velocity = motion, .x = {0.15, 0.25}, .y = {0.95, 0.95}});
    return state;
}

std::string shape_error(const std::string& toml) {
    return message_of<InputError>([&] { (void)read_shape(io::read_config("shape = " + toml, "scene.toml").children.front()); });
}

} // namespace

TEST_SUITE_BEGIN("scene_parts");

TEST_CASE("a history is linear between knots, jumps at two of one time, and is constant outside") {
    const Motion motion({{1.0, {0.0, 2.0}}, {3.0, {4.0, 2.0}}, {3.0, {-1.0, 0.0}}, {5.0, {-1.0, 8.0}}});
    CHECK(motion.after(0.0) == Velocity{0.0, 2.0});
    CHECK(motion.after(2.0) == Velocity{2.0, 2.0});
    CHECK(motion.before(3.0) == Velocity{4.0, 2.0});
    CHECK(motion.after(3.0) == Velocity{-1.0, 0.0});
    CHECK(motion.after(9.0) == Velocity{-1.0, 8.0});
    CHECK(motion.slope(2.0) == Velocity{2.0, 0.0});
    CHECK(motion.slope(3.0) == Velocity{0.0, 4.0});
    CHECK(motion.slope(0.5) == Velocity{});
    CHECK(motion.slope(5.0) == Velocity{});
    CHECK(motion.mean(2.0, 4.0).u == doctest::Approx(0.5 * (3.0 - 1.0)));
    CHECK(motion.mean(2.0, 4.0).v == doctest::Approx(0.5 * (2.0 + 2.0)));
    CHECK(motion.mean(3.0, 3.0) == motion.after(3.0));
    CHECK(motion.displacement(3.0).u == doctest::Approx(4.0));
    CHECK(motion.next_knot(1.0) == 3.0);
    CHECK(motion.next_knot(5.0) == infinity);
    CHECK(motion.largest([](const Velocity& v) { return std::abs(v.u); }, 0.0) == 4.0);
    CHECK(motion.largest([](const Velocity& v) { return std::abs(v.u); }, 3.0) == 1.0);

    const Motion constant(Velocity{1.0 / 3.0, -0.1});
    CHECK(constant.mean(-1.0, 0.3) == Velocity{1.0 / 3.0, -0.1}); // to the last bit
    CHECK(contains(message_of<InputError>([] { (void)Motion(Velocity{0.0, std::nan("")}); }), "must be finite"));
    CHECK(contains(message_of<InputError>([] { (void)Motion({{1.0, {}}, {0.5, {}}}); }), "knot 2: time 0.5 lies before"));
    CHECK(contains(message_of<InputError>([] { (void)Motion({{1.0, {}}, {1.0, {}}, {1.0, {}}}); }), "three knots at time 1"));
}

TEST_CASE("steps of points end at the knots of a history, exactly, and go on as if there were none") {
    mpm::State state = moved_by(Motion({{0.0, {0.0, -0.01}}, {0.25, {0.0, -0.01}}, {0.25, {0.0, 0.01}}}));
    mpm::StepControl control({.target = 0.1, .first = 0.1, .grid = grid});
    std::vector<double> ends;
    for (bool lands = false; !lands;) {
        const mpm::StepControl::Step step = control.next(state, 0.5);
        move_rigid_bodies(state, step.dt);
        state.time = step.end;
        ends.push_back(state.time);
        lands = step.lands;
        control.accepted(step, 1, {});
        CHECK((step.limit == mpm::StepLimit::history_knot) == (state.time == 0.25));
    }
    REQUIRE(ends.size() == 6);
    CHECK(ends[2] == 0.25); // the jump
    CHECK(ends[3] == doctest::Approx(0.3));
    CHECK(ends[5] == 0.5);
    CHECK(state.rigid_bodies[0].y[0] == doctest::Approx(0.95).epsilon(1e-14)); // there and back

    // a knot at an output time makes no sliver of a step
    mpm::State other = moved_by(Motion({{0.0, {0.0, -0.01}}, {0.2 + 1e-15, {0.0, -0.01}}, {0.2 + 1e-15, {}}}));
    mpm::StepControl whole({.target = 0.2, .first = 0.2, .grid = grid});
    const mpm::StepControl::Step step = whole.next(other, 0.2);
    CHECK(step.lands);
    other.time = step.end;
    whole.accepted(step, 1, {});
    CHECK(whole.next(other, 1.0).dt == doctest::Approx(0.2));
}

TEST_CASE(
    "an accelerated body is stopped where it reaches new nodes and after a cell's way; a body that turns back counts both ways") {
    const double acceleration = -2.0;
    mpm::State state = moved_by(Motion({{0.0, {}}, {10.0, {0.0, 10.0 * acceleration}}}));
    const mpm::NewNodes down = time_to_new_nodes(state.rigid_bodies[0], 0.0, grid, 0.0, 0.0);
    CHECK(down.time == doctest::Approx(std::sqrt(2.0 * 0.05 / 2.0))); // 0.05 m to the cell below
    CHECK(down.interval == doctest::Approx(std::sqrt(2.0 * 0.1 / 2.0)));
    mpm::StepControl control({.target = 5.0, .first = 5.0, .grid = grid});
    const mpm::StepControl::Step step = control.next(state, 100.0);
    CHECK(step.limit == mpm::StepLimit::rigid_travel);
    CHECK(0.5 * 2.0 * step.dt * step.dt == doctest::Approx(0.099));

    // upwards at 0.1 m/s, and back: it comes 0.0025 m high only, and leaves its cell below
    mpm::State turning = moved_by(Motion({{0.0, {0.0, 0.1}}, {10.0, {0.0, 0.1 + 10.0 * acceleration}}}));
    const double expected = (0.1 + std::sqrt(0.01 + 2.0 * 2.0 * 0.05)) / 2.0;
    CHECK(time_to_new_nodes(turning.rigid_bodies[0], 0.0, grid, 0.0, 0.0).time == doctest::Approx(expected));
    CHECK(time_to_new_nodes(moved_by(Motion()).rigid_bodies[0], 0.0, grid, 0.0, 0.0).time == infinity);
}

TEST_CASE("rigid bodies move and hold nodes with the mean of their history over the step") {
    mpm::Scene scene{.grid = grid, .materials = {{linear_elastic_law(elasticity_from_young(1.0, 0.0))}}};
    mpm::State state = moved_by(Motion({{0.0, {1.0, 0.0}}, {0.4, {3.0, 0.0}}}));
    add_body(state.particles, {.shape = rectangle(0.1, 0.8, 0.3, 1.0), .density = 1.0}, scene);
    const auto discretisation = make_discretisation(scene);
    discretisation->prepare(state.particles, state.rigid_bodies, 0.1, 0.2);
    REQUIRE(!discretisation->nodes().holds.empty());
    for (const mpm::Hold& hold : discretisation->nodes().holds)
        CHECK(discretisation->nodes().velocity[static_cast<std::size_t>(hold.component)] ==
              doctest::Approx(hold.component % 2 == 0 ? 2.0 : 0.0));
    state.time = 0.1;
    move_rigid_bodies(state, 0.2);
    CHECK(state.rigid_bodies[0].x[0] == doctest::Approx(0.15 + 0.2 * 2.0));
}

TEST_CASE("shapes: polygon, union and difference, in a program and as a file writes them") {
    const Shape triangle = polygon({{0.0, 0.0}, {2.0, 0.0}, {0.0, 1.0}});
    CHECK(triangle(0.5, 0.5));
    CHECK_FALSE(triangle(1.5, 0.5));
    CHECK_FALSE(triangle(-0.1, 0.5));
    const Shape notched = polygon({{0.0, 0.0}, {4.0, 0.0}, {4.0, 2.0}, {2.0, 1.0}, {0.0, 2.0}});
    CHECK(notched(0.2, 1.6));
    CHECK_FALSE(notched(2.0, 1.2));
    CHECK(notched(2.0, 0.8));
    const Shape ring = disk(0.0, 0.0, 2.0) - disk(0.0, 0.0, 1.0);
    CHECK(ring(1.5, 0.0));
    CHECK_FALSE(ring(0.5, 0.0));
    const Shape both = ring | rectangle(-0.5, -0.5, 0.5, 0.5);
    CHECK(both(0.4, 0.4));
    CHECK_FALSE(both(0.9, 0.0));
    CHECK_FALSE(Shape()(0.0, 0.0));

    const auto area = [](const Shape& shape) {
        int count = 0;
        for (int j = 0; j < 400; ++j)
            for (int i = 0; i < 400; ++i)
                count += shape(-2.0 + 0.01 * (i + 0.5), -2.0 + 0.01 * (j + 0.5)) ? 1 : 0;
        return 1e-4 * count;
    };
    CHECK(area(both) == doctest::Approx(3.0 * std::numbers::pi + 1.0).epsilon(1e-3));
    for (const Shape& shape : {triangle, notched, ring, both}) {
        const Shape again = read_shape(io::read_config("shape = " + shape.toml(), "").children.front());
        CHECK(again.toml() == shape.toml());
        CHECK(area(again) == area(shape));
    }
    // each knows where it can be
    const auto edges = [](const Shape& shape) {
        const Box& b = shape.box();
        return std::array{b.left, b.bottom, b.right, b.top};
    };
    CHECK(edges(triangle) == std::array{0.0, 0.0, 2.0, 1.0});
    CHECK(edges(ring) == std::array{-2.0, -2.0, 2.0, 2.0});
    CHECK(edges(disk(1.0, 0.0, 0.5) | triangle) == std::array{0.0, -0.5, 2.0, 1.0});
    CHECK(edges(triangle - disk(1.0, 0.0, 5.0)) == edges(triangle));
    CHECK(edges([](double x, double) { return x > 0.0; })[2] == infinity);

    // three parts are taken one after the other
    const Shape left = read_shape(
        io::read_config("s = {difference = [{rectangle = [0, 0, 3, 1]}, {disk = [1, 0.5, 0.2]}, {disk = [2, 0.5, 0.2]}]}", "")
            .children.front());
    CHECK_FALSE(left(1.0, 0.5));
    CHECK_FALSE(left(2.0, 0.5));
    CHECK(left(1.5, 0.5));

    // thousands are no deeper than two
    std::string disks;
    for (int k = 0; k < 5000; ++k)
        disks += fmt::format("{}{{disk = [{}, 0, 0.4]}}", k > 0 ? ", " : "", k);
    const Shape row = read_shape(io::read_config("s = {union = [" + disks + "]}", "").children.front());
    CHECK(row(4999.0, 0.0));
    CHECK_FALSE(row(0.5, 0.0));
    CHECK(read_shape(io::read_config("s = " + row.toml(), "").children.front()).toml() == row.toml());

    CHECK(contains(shape_error("{circle = [0, 0, 1]}"), "there is no shape 'circle'; there are rectangle, disk"));
    CHECK(contains(shape_error("{disc = [0, 0, 1]}"), "did you mean disk?"));
    CHECK(contains(shape_error("{disk = [0, 0]}"), "must be 3 numbers"));
    CHECK(contains(shape_error("{disk = [0, 0, -1]}"), "no positive radius"));
    CHECK(contains(shape_error("{rectangle = [1, 0, 0, 1]}"), "[left, bottom, right, top]"));
    CHECK(contains(shape_error("{polygon = [[0, 0], [1, 1]]}"), "three corners"));
    CHECK(contains(shape_error("{polygon = [0, 1, 2]}"), "must be 2 numbers"));
    CHECK(contains(shape_error("{union = [{disk = [0, 0, 1]}]}"), "two shapes"));
    CHECK(contains(shape_error("3"), "must be a table"));
}

TEST_CASE("particles from CSV and from HDF5 have what the file says, and the rest from the body") {
    const scratch::Folder folder;
    scratch::write(folder / "a.csv", "x,y,volume,velocity_y,stress_xx,internal\n0.1,0.2,1e-4,3,7,0.5\n0.3,0.4,2e-4,-3,8,0.25\n");
    io::Hdf5File file = io::Hdf5File::create(folder / "a.h5");
    for (const auto& [name, values] : {std::pair<std::string, std::vector<double>>{"x", {0.1, 0.3}},
                                       {"y", {0.2, 0.4}},
                                       {"volume", {1e-4, 2e-4}},
                                       {"velocity_y", {3.0, -3.0}},
                                       {"stress_xx", {7.0, 8.0}},
                                       {"internal", {0.5, 0.25}}})
        file.write(name, std::span<const double>(values));
    file.close();
    const Law metal = von_mises_law(elasticity_from_young(1000.0, 0.3), {.yield_stress = 6.0});
    mpm::Scene scene{.grid = grid, .materials = {{linear_elastic_law(elasticity_from_young(1.0, 0.0))}, {metal}}};
    const mpm::Body body{.shape = {}, .material = 1, .density = 10.0, .velocity_x = 2.0, .velocity_y = 9.0};
    for (const std::string name : {"a.csv", "a.h5"})
        for (const mpm::Geometry geometry : {mpm::Geometry::plane_strain, mpm::Geometry::axisymmetric}) {
            CAPTURE(name);
            mpm::Particles p;
            p.resize(1);
            p.body[0] = 4;
            scene.geometry = geometry;
            add_particles(p, body, folder / name, scene);
            REQUIRE(p.size() == 3);
            CHECK(p.x[2] == 0.3);
            CHECK(p.y[1] == 0.2);
            CHECK(p.mass[2] == doctest::Approx(2e-3));
            CHECK(p.density[2] == 10.0);
            CHECK(p.velocity_x[1] == 2.0);
            CHECK(p.velocity_y[2] == -3.0);
            CHECK(p.stress_xx[1] == 7.0);
            CHECK(p.stress_yy[1] == 0.0);
            CHECK(p.internal[0][2] == 0.25);
            CHECK(p.material[1] == 1);
            CHECK(p.body[1] == 5);
            CHECK(p.id[2] == 2);
            const double area = geometry == mpm::Geometry::axisymmetric ? 2e-4 / 0.3 : 2e-4;
            CHECK(4.0 * p.half_width[2] * p.half_height[2] == doctest::Approx(area));
        }
    // as other programs write it: the last line has no end, or lines end in two characters
    for (const std::string text : {"x,y,volume\n0.1,0.2,1e-4\n0.3,0.4,1e-4", "x,y,volume\r\n0.1,0.2,1e-4\r\n0.3,0.4,1e-4\r\n"}) {
        scratch::write(folder / "b.csv", text);
        mpm::Particles p;
        add_particles(p, body, folder / "b.csv", scene);
        CHECK(p.size() == 2);
    }
    CHECK(contains(message_of<InputError>([&] {
                       mpm::Particles p;
                       add_particles(p, body, "/dev/zero", scene);
                   }),
                   "/dev/zero: this is not a file"));
    for (const auto& [text, message] : {std::pair<std::string, std::string>{"x,y\n1,2\n", "it lacks the column 'volume'"},
                                        {"x,y,volume,velocty_x\n1,2,3,4\n", "did you mean velocity_x?"},
                                        {"x,y,volume\n1,2,-3\n", "particle 0 has the volume -3 m^3"},
                                        {"x,y,volume\n", "it has no particle"},
                                        {"x,y,volume,internal\n1,2,3,-1\n", "the plastic strain is -1: it must be from 0 to 10"},
                                        {"x,y,volume\n1,2\n", "is not a row of 3 numbers"}}) {
        scratch::write(folder / "bad.csv", text);
        mpm::Particles p;
        const std::string said = message_of<InputError>([&] { add_particles(p, body, folder / "bad.csv", scene); });
        CAPTURE(said);
        CHECK(contains(said, "bad.csv"));
        CHECK(contains(said, message));
    }
}

TEST_CASE("snapshots at equal intervals, beside those asked for") {
    CHECK(io::regular_times("--snapshots-every", {0.05}, 0.0, 1.0) == std::vector{0.05});
    CHECK(io::regular_times("--snapshots-every", {0.05}, 0.5, 1.2) == std::vector{0.05, 0.0, 0.5, 1.0});
    CHECK(io::regular_times("--snapshots-every", {}, 0.1, 0.3).size() == 4); // 3 * 0.1 > 0.3 by round-off alone
    CHECK(io::regular_times("--snapshots-every", {}, 1e308, 1.79e308).size() == 2);
    CHECK(contains(message_of<InputError>([] { (void)io::regular_times("--snapshots-every", {}, 1e-9, 1.0); }),
                   "--snapshots-every 1e-09"));
}

TEST_CASE("initial fields from a file: the same grid, another one, and a stress that is brought into equilibrium") {
    const scratch::Folder folder;
    using std::numbers::pi;
    const auto scene_on = [](int cells_x, int cells_y) {
        return fields::scene_on(Grid{cells_x, cells_y, 2.0, 2.0}, quasistatic::Model::full, {});
    };
    // an even temperature but for one wave in each direction
    const auto chi = [](double x, double y) { return 640.0 + 20.0 * std::cos(pi * x) * std::cos(0.5 * pi * (y + 1.0)); };
    const auto write = [&](const std::string& name, int m, int n, double tau, bool stress) {
        std::vector<double> temperature, shear, zero(static_cast<std::size_t>(m * n), 0.0);
        std::string csv = stress ? "x,y,effective_temperature,pressure,s,tau,q\n" : "x,y,effective_temperature\n";
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < m; ++i) {
                const double x = -1.0 + 2.0 * (i + 0.5) / m, y = -1.0 + 2.0 * (j + 0.5) / n;
                temperature.push_back(chi(x, y));
                shear.push_back(1e6 + tau * std::sin(pi * x));
                csv += fmt::format("{},{},{}", 0.01 * x, 0.01 * y, temperature.back());
                csv += stress ? fmt::format(",0,0,{},0\n", shear.back()) : "\n";
            }
        scratch::write(folder / (name + ".csv"), csv);
        io::Hdf5File file = io::Hdf5File::create(folder / (name + ".h5"));
        const auto add = [&](const char* field, std::vector<double>& values) {
            file.write(field, io::ArrayView{values.data(), n, m, m});
        };
        add("effective_temperature", temperature);
        if (stress)
            for (const auto& [field, values] : {std::pair{"pressure", &zero}, {"s", &zero}, {"tau", &shear}, {"q", &zero}})
                add(field, *values);
        file.close();
    };
    const auto start = [&](const quasistatic::Scene& scene, const std::string& file) {
        return quasistatic::start_from_file(scene, *make_space(scene), folder / file);
    };
    write("same", 32, 24, 0.0, false);
    for (const std::string file : {"same.csv", "same.h5"}) {
        CAPTURE(file);
        for (const auto& [m, n, tolerance] : {std::tuple{32, 24, 1e-12}, {40, 36, 3e-4}, {16, 16, 3e-4}}) {
            const quasistatic::Scene scene = scene_on(m, n);
            const quasistatic::FileStart made = start(scene, file);
            CHECK(made.correction == 0.0);
            double worst = 0.0;
            for (int j = 1; j + 1 < n; ++j) // beyond the outermost centres it is constant
                for (int i = 0; i < m; ++i)
                    worst = std::max(worst, std::abs(made.state.cells.internal[0](i, j) * scene.units.temperature -
                                                     chi(scene.grid.x(i + 0.5), scene.grid.y(j + 0.5))) /
                                                640.0);
            CHECK(worst < tolerance);
            CHECK((tolerance < 1e-9 || worst > 1e-9)); // another grid it was
        }
    }
    // tau = const is in equilibrium, a wave of it along x is not
    const quasistatic::Scene scene = scene_on(32, 24);
    for (const auto& [tau, least, most] : {std::tuple{0.0, 0.0, 1e-12}, {2e3, 1e-4, 3e-3}, {1e6, 0.1, 0.9}}) {
        CAPTURE_BINDING(tau);
        write("stressed", 32, 24, tau, true);
        for (const std::string file : {"stressed.csv", "stressed.h5"}) {
            const quasistatic::FileStart made = start(scene, file);
            VectorField force(scene.grid);
            CHECK(make_space(scene)->equilibrium_residual(made.state.cells.stress, force) < 1e-12);
            CHECK(made.correction >= least);
            CHECK(made.correction <= most);
            double mean = 0.0;
            for (int j = 0; j < 24; ++j)
                for (int i = 0; i < 32; ++i)
                    mean += made.state.cells.stress.tau(i, j) / (24.0 * 32.0);
            CHECK(mean * scene.units.stress == doctest::Approx(1e6).epsilon(1e-9)); // the load of the walls stays
        }
    }
    for (const auto& [text, message] :
         {std::pair<std::string, std::string>{"x,y,chi\n0,0,640\n", "it lacks the field 'effective_temperature'"},
          {"effective_temperature\n640\n", "it lacks the columns x and y"},
          {"x,y,effective_temperature\n", "its 0 cells are no rows of equal length"},
          {"x,y,effective_temperature\n0,nan,640\n", "its 1 cells are no rows of equal length"},
          {"x,y,effective_temperature\n0,0,640\n1,0,640\n0,1,640\n", "its 3 cells are no rows of equal length"},
          {"x,y,effective_temperature\n-0.005,0,640\n0.004,0,640\n", "row 2 lies at (0.004, 0) m"},
          {"x,y,effective_temperature\n0,0,-5\n", "the effective temperature is -5 at cell (0, 0): it must be from 1 to 21000 K"},
          {"x,y,effective_temperature,tau\n0,0,640,1\n", "a stress needs all of pressure, s, tau and q"}}) {
        scratch::write(folder / "bad.csv", text);
        const std::string said = message_of<InputError>([&] { (void)start(scene, "bad.csv"); });
        CAPTURE(said);
        CHECK(contains(said, message));
    }
    io::Hdf5File file = io::Hdf5File::create(folder / "begun.h5");
    file.create_group("snapshots");
    file.close();
    CHECK(contains(message_of<InputError>([&] { (void)start(scene, "begun.h5"); }), "begun.h5: it has no snapshot"));
}

TEST_SUITE_END();

} // namespace scene_parts_suite
