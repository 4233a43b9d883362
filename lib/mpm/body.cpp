// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/base/memory.hpp>
#include <ductile/mpm/body.hpp>
#include <ductile/mpm/scene.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <string>
#include <utility>
#include <vector>

namespace ductile::mpm {

namespace {

/// Cells [first, end) of one direction that an interval touches, of the grid's and of as many beyond each side; with a cell more
/// at each end for round-off.
struct CellRange {
    int first, end;

    CellRange(double from, double to, double origin, double cell, int cells)
        : first(static_cast<int>(std::clamp((from - origin) / cell - 1.0, -1.0 * cells, 2.0 * cells))),
          end(static_cast<int>(std::clamp((to - origin) / cell + 2.0, -1.0 * cells, 2.0 * cells))) {}
    [[nodiscard]] double within(int cells) const { return std::max(0, std::min(end, cells) - std::max(first, 0)); }
};

/// Calls `visit(x, y)` for the trial points in the shape, of the grid's cells and of as many cells beyond each side. Throws
/// InputError, beginning with `name`, where so many of `point_bytes` as lie around the shape in the grid do not fit into memory.
void for_each_trial_point(const Grid& grid, int per_side, const Shape& shape, const std::string& name, double point_bytes,
                          const auto& visit) {
    if (per_side < 1 || per_side > 100)
        throw InputError(fmt::format("{} particles along a cell's side: from 1 to 100 are possible", per_side));
    const CellRange across(shape.box().left, shape.box().right, grid.left, grid.dx(), grid.cells_x);
    const CellRange up(shape.box().bottom, shape.box().top, grid.bottom, grid.dy(), grid.cells_y);
    const double points = across.within(grid.cells_x) * up.within(grid.cells_y) * per_side * per_side;
    require_memory(point_bytes * points, fmt::format("{} may have {:.3g} points", name, points),
                   "use larger cells or fewer particles a cell");
    for (int cy = up.first; cy < up.end; ++cy)
        for (int cx = across.first; cx < across.end; ++cx)
            for (int j = 0; j < per_side; ++j)
                for (int i = 0; i < per_side; ++i) {
                    const double x = grid.left + (cx + (i + 0.5) / per_side) * grid.dx();
                    const double y = grid.bottom + (cy + (j + 0.5) / per_side) * grid.dy();
                    if (shape(x, y))
                        visit(x, y);
                }
}

/// Makes it larger if need be, so that it holds a point.
void add(Box& box, double x, double y) {
    box = {std::min(box.left, x), std::min(box.bottom, y), std::max(box.right, x), std::max(box.top, y)};
}

/// Whether a point beyond sides that slip, or beyond the axis, is the mirror image of a point (x, y) within.
bool mirrored_inside(const Grid& grid, Geometry geometry, double& x, double& y) {
    const double right = grid.left + grid.width, top = grid.bottom + grid.height;
    const bool axis = geometry == Geometry::axisymmetric && grid.left == 0.0;
    const auto mirrors = [](SideCondition condition) { return condition == SideCondition::slip; };
    if (x < grid.left && (axis || mirrors(grid.sides.left)))
        x = 2.0 * grid.left - x;
    else if (x > right && mirrors(grid.sides.right))
        x = 2.0 * right - x;
    if (y < grid.bottom && mirrors(grid.sides.bottom))
        y = 2.0 * grid.bottom - y;
    else if (y > top && mirrors(grid.sides.top))
        y = 2.0 * top - y;
    return contains(grid, x, y);
}

void check(const Body& body) {
    if (!(body.density > 0.0 && std::isfinite(body.density)))
        throw InputError(fmt::format("{} has the density {} kg/m^3: it must be positive and finite", body.name, body.density));
    for (const auto& [what, value] : {std::pair{"velocity in x", body.velocity_x}, {"velocity in y", body.velocity_y}})
        if (!std::isfinite(value))
            throw InputError(fmt::format("{} has the {} {}: it must be finite", body.name, what, value));
}

} // namespace

std::vector<double> starts_of(const Body& body, const Scene& scene) {
    if (body.material < 0 || body.material >= static_cast<int>(scene.materials.size()))
        throw InputError(fmt::format("{} is of material {}, but the scene has {} materials", body.name, body.material,
                                     scene.materials.size()));
    const auto variables = scene.materials[static_cast<std::size_t>(body.material)].law->variables();
    std::vector<double> starts = body.internal;
    if (starts.empty())
        for (const InternalVariable& variable : variables)
            starts.push_back(variable.start / variable.natural_unit);
    if (starts.size() != variables.size())
        throw InputError(fmt::format("{} has {} start values of internal variables, and its law {} of them", body.name,
                                     starts.size(), variables.size()));
    for (std::size_t k = 0; k < starts.size(); ++k)
        if (!variables[k].can_start_at(starts[k]))
            throw InputError(fmt::format("{} has the {} {}: it must be {}", body.name, spoken_name(variables[k]), starts[k],
                                         describe_range(variables[k])));
    return starts;
}

void add_body(Particles& particles, const Body& body, const Scene& scene) {
    const Grid& grid = scene.grid;
    const Geometry geometry = scene.geometry;
    check(grid, geometry);
    check(body);
    const std::vector<double> internal = starts_of(body, scene);
    particles.provide_internal(internal.size());
    const std::size_t before = particles.size();
    const std::int64_t number = before == 0 ? 0 : *std::max_element(particles.body.begin(), particles.body.end()) + 1;
    const double half_width = 0.5 * grid.dx() / body.particles_per_side, half_height = 0.5 * grid.dy() / body.particles_per_side;
    Box all{everywhere.right, everywhere.top, everywhere.left, everywhere.bottom};
    std::size_t outside = 0, mirrored = 0;
    std::vector<std::array<double, 2>> places;
    const double particle_bytes =
        8.0 * static_cast<double>(2 + common_arrays(particles).size() + internal.size() + named_integer_arrays(particles).size());
    for_each_trial_point(grid, body.particles_per_side, body.shape, body.name, particle_bytes, [&](double x, double y) {
        add(all, x, y);
        if (contains(grid, x, y)) {
            places.push_back({x, y});
        } else {
            ++outside;
            mirrored += mirrored_inside(grid, geometry, x, y) && body.shape(x, y) ? 1 : 0;
        }
    });
    if (scene.affine)
        particles.provide_affine();
    particles.resize(before + places.size());
    for (std::size_t p = before; p < particles.size(); ++p) {
        const double x = particles.x[p] = places[p - before][0];
        particles.y[p] = places[p - before][1];
        particles.velocity_x[p] = body.velocity_x;
        particles.velocity_y[p] = body.velocity_y;
        particles.density[p] = body.density;
        particles.mass[p] = body.density * 4.0 * half_width * half_height * (geometry == Geometry::axisymmetric ? x : 1.0);
        particles.half_width[p] = half_width;
        particles.half_height[p] = half_height;
        for (std::size_t k = 0; k < internal.size(); ++k)
            particles.internal[k][p] = internal[k];
        particles.material[p] = body.material;
        particles.body[p] = number;
        particles.id[p] = static_cast<std::int64_t>(p);
    }
    const std::size_t inside = places.size();
    // a plane of symmetry needs the image of every particle, too
    const auto whole = [&](std::size_t p) {
        const double x = particles.x[p], y = particles.y[p], right = grid.left + grid.width, top = grid.bottom + grid.height;
        return (all.left > grid.left || body.shape(2.0 * grid.left - x, y)) &&
               (all.right < right || body.shape(2.0 * right - x, y)) &&
               (all.bottom > grid.bottom || body.shape(x, 2.0 * grid.bottom - y)) &&
               (all.top < top || body.shape(x, 2.0 * top - y));
    };
    if (mirrored == outside)
        for (std::size_t p = before; p < particles.size() && outside > 0; ++p)
            mirrored -= whole(p) ? 0 : 1;
    const bool crosses = mirrored != outside;
    if (crosses)
        particles.resize(before);
    if (inside == 0)
        throw InputError(
            fmt::format("{} has no particle: it lies outside the grid or is smaller than the distance of the trial points; use "
                        "smaller cells or more particles a cell",
                        body.name));
    if (crosses)
        throw InputError(fmt::format(
            "{} crosses the edge of the grid: {} of its {} particles would lie outside; they reach from ({:.6g}, {:.6g}) to "
            "({:.6g}, {:.6g}) m, the grid from ({:.6g}, {:.6g}) to ({:.6g}, {:.6g}) m: use a larger grid or a smaller body",
            body.name, outside, outside + inside, all.left, all.bottom, all.right, all.top, grid.left, grid.bottom,
            grid.left + grid.width, grid.bottom + grid.height));
}

RigidBody make_rigid_body(const std::string& name, const Shape& shape, int particles_per_side, const Grid& grid) {
    check(grid, Geometry::plane_strain);
    RigidBody body{.name = name, .half_width = 0.5 / particles_per_side};
    for_each_trial_point(grid, particles_per_side, shape, name, 2 * sizeof(double), [&](double x, double y) {
        body.x.push_back(x);
        body.y.push_back(y);
    });
    if (body.x.empty())
        throw InputError(
            fmt::format("the rigid body '{}' has no point: it lies farther outside than the grid is wide or high, or "
                        "is smaller than the distance of the trial points",
                        name));
    return body;
}

} // namespace ductile::mpm
