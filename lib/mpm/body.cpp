#include <ductile/base/error.hpp>
#include <ductile/mpm/body.hpp>
#include <ductile/mpm/scene.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <utility>

namespace ductile::mpm {

namespace {

/// Calls `visit(x, y)` for the trial points in the shape, of the grid's cells and of as many cells beyond each side.
void for_each_trial_point(const Grid& grid, int per_side, const Shape& shape, const auto& visit) {
    if (per_side < 1 || per_side > 100)
        throw InputError(fmt::format("{} particles along a cell's side: from 1 to 100 are possible", per_side));
    for (int cy = -grid.cells_y; cy < 2 * grid.cells_y; ++cy)
        for (int cx = -grid.cells_x; cx < 2 * grid.cells_x; ++cx)
            for (int j = 0; j < per_side; ++j)
                for (int i = 0; i < per_side; ++i) {
                    const double x = grid.left + (cx + (i + 0.5) / per_side) * grid.dx();
                    const double y = grid.bottom + (cy + (j + 0.5) / per_side) * grid.dy();
                    if (shape(x, y))
                        visit(x, y);
                }
}

/// The smallest box around some points.
struct Box {
    double left = std::numeric_limits<double>::infinity(), right = -left, bottom = left, top = -left;

    void add(double x, double y) {
        left = std::min(left, x);
        right = std::max(right, x);
        bottom = std::min(bottom, y);
        top = std::max(top, y);
    }
};

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
    Box all;
    std::size_t outside = 0, mirrored = 0;
    for_each_trial_point(grid, body.particles_per_side, body.shape, [&](double x, double y) {
        all.add(x, y);
        if (!contains(grid, x, y)) {
            ++outside;
            mirrored += mirrored_inside(grid, geometry, x, y) && body.shape(x, y) ? 1 : 0;
            return;
        }
        const std::size_t p = particles.size();
        particles.resize(p + 1);
        particles.x[p] = x;
        particles.y[p] = y;
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
    });
    const std::size_t inside = particles.size() - before;
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
    for_each_trial_point(grid, particles_per_side, shape, [&](double x, double y) {
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
