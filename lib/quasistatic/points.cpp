// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/quasistatic/doubts.hpp>
#include <ductile/quasistatic/points.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numeric>

namespace ductile::quasistatic {

namespace {

WallHistory walls_of(const Options& o) {
    if (!o.shear_traction.empty() || !o.normal_traction.empty())
        throw InputError(
            "--shear-traction, --normal-traction: on material points walls move as prescribed: use --wall-velocity or "
            "--wall-history, or carrier = \"grid\"");
    WallHistory walls = o.wall_history.empty() ? WallHistory({o.wall_velocity, 0.0}) : parse_wall_history(o.wall_history);
    for (const WallKnot& knot : walls.knots())
        if (knot.value.v != 0.0)
            throw InputError(
                fmt::format("--wall-history {}: on material points walls can shear, and not open or close: leave out v, "
                            "or use carrier = \"grid\"",
                            o.wall_history));
    return walls;
}

/// Points on the top (side 1) or the bottom (-1) of the grid: there they touch the outermost nodes alone, whatever the shape
/// functions.
mpm::RigidBody make_wall(const char* name, const WallHistory& walls, double side, const mpm::Grid& grid) {
    mpm::RigidBody wall{.name = name};
    std::vector<WallKnot> knots = walls.knots();
    for (WallKnot& knot : knots)
        knot.value = side * knot.value;
    wall.velocity = WallHistory(std::move(knots));
    double y = grid.bottom + (side > 0.0 ? grid.height : 0.0);
    while (!mpm::contains(grid, 0.0, y)) // round-off
        y = std::nextafter(y, 0.0);
    for (int i = 0; i < grid.cells_x; ++i) {
        wall.x.push_back(grid.left + (i + 0.5) * grid.dx());
        wall.y.push_back(y);
    }
    return wall;
}

/// The pattern on a grid whose cells are the shares of the particles: its centres are their places.
void start_internal(const Options& o, int particles_per_side, const mpm::Scene& made, mpm::Particles& particles) {
    Options fine = o;
    fine.cells = {o.cells.x * particles_per_side, o.cells.y * particles_per_side};
    const Scene scene = make_scene(fine);
    check_meaning(fine, scene);
    const Field pattern = make_initial_internal(fine, scene, uniform_rows(scene.grid));
    const double unit = scene.law->variables().front().natural_unit;
    const mpm::Grid& g = made.grid;
    for (std::size_t p = 0; p < particles.size(); ++p)
        particles.internal[0][p] = unit * pattern(static_cast<int>((particles.x[p] - g.left) / g.width * fine.cells.x),
                                                  static_cast<int>((particles.y[p] - g.bottom) / g.height * fine.cells.y));
}

} // namespace

PointsOptions::PointsOptions() {
    points.method = mpm::Method::quasi_static;
    points.dt = "2e-3"; // a shear of 1e-4 at the velocity of the walls that is the default
    points.newton_tolerance = 1e-8;
    points.duration = scene.duration;
    points.snapshots = scene.snapshots;
}

void declare(io::Program& program, PointsOptions& options) {
    declare_scene(program, options.scene);
    mpm::declare_on_given_cells(program, options.points);
}

mpm::Problem make_problem(const PointsOptions& options) {
    const Options& o = options.scene;
    if (o.initial == InitialChoice::file || !o.initial_file.empty())
        throw InputError("--initial file: on material points the start is a pattern: use paper, uniform, gaussian or random, or "
                         "carrier = \"grid\"");
    if (o.initial_stress > 0.0)
        throw InputError("--initial-stress: material points start without stress: leave it out, or use carrier = \"grid\"");
    const WallHistory walls = walls_of(o);
    mpm::Problem problem;
    problem.scene = {.grid = {.cells_x = o.cells.x,
                              .cells_y = o.cells.y,
                              .width = o.width,
                              .height = o.height,
                              .left = -0.5 * o.width,
                              .bottom = -0.5 * o.height,
                              .sides = {.left = mpm::SideCondition::periodic, .right = mpm::SideCondition::periodic}},
                     .shape = options.points.shape,
                     .materials = {{make_law(o.material, si_units)}},
                     .finite_rotation = o.model == Model::full,
                     .affine = options.points.affine};
    const mpm::Grid& grid = problem.scene.grid;
    mpm::Particles& particles = problem.start.particles;
    mpm::add_body(particles,
                  {.shape = rectangle(grid.left, grid.bottom, grid.left + grid.width, grid.bottom + grid.height),
                   .density = assumed_density(), // without inertia nothing depends on it
                   .particles_per_side = options.points.particles_per_side,
                   .name = "the block"},
                  problem.scene);
    start_internal(o, options.points.particles_per_side, problem.scene, particles);
    problem.start.rigid_bodies = {make_wall("top", walls, 1.0, grid), make_wall("bottom", walls, -1.0, grid)};

    const double width = o.width, half_height = 0.5 * o.height;
    problem.observables = {
        {"wall_strain",
         [=](const mpm::Observation& seen) {
             return seen.state.rigid_bodies[0].velocity.displacement(seen.state.time).u / half_height;
         }},
        {"wall_shear_traction_Pa", [=](const mpm::Observation& seen) { return -seen.contact_forces[0][0] / width; }},
        {"wall_normal_traction_Pa", [=](const mpm::Observation& seen) { return -seen.contact_forces[0][1] / width; }},
        {fmt::format("mean_{}", column_name(problem.scene.materials[0].law->variables().front())),
         [](const mpm::Observation& seen) {
             const auto& values = seen.state.particles.internal[0];
             return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
         }}};
    problem.curve_x = "wall_strain";
    problem.curve_y = "wall_shear_traction_Pa";
    problem.label_x = "wall strain";
    problem.label_y = "shear traction on the wall [Pa]";
    return problem;
}

} // namespace ductile::quasistatic
