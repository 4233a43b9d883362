#include <ductile/base/error.hpp>
#include <ductile/mpm/body.hpp>

#include <cmath>
#include <fmt/format.h>

namespace ductile::mpm {

namespace {

void for_each_trial_point(const Grid& grid, int per_side, const Shape& shape, const auto& visit) {
    if (per_side < 1 || per_side > 100)
        throw InputError(fmt::format("{} particles along a cell's side: from 1 to 100 are possible", per_side));
    for (int cy = 0; cy < grid.cells_y; ++cy)
        for (int cx = 0; cx < grid.cells_x; ++cx)
            for (int j = 0; j < per_side; ++j)
                for (int i = 0; i < per_side; ++i) {
                    const double x = grid.left + (cx + (i + 0.5) / per_side) * grid.dx();
                    const double y = grid.bottom + (cy + (j + 0.5) / per_side) * grid.dy();
                    if (shape(x, y))
                        visit(x, y);
                }
}

} // namespace

Shape rectangle(double left, double bottom, double right, double top) {
    return [=](double x, double y) { return x > left && x < right && y > bottom && y < top; };
}

Shape disk(double centre_x, double centre_y, double radius) {
    return [=](double x, double y) { return std::hypot(x - centre_x, y - centre_y) < radius; };
}

Shape operator|(Shape first, Shape second) {
    return [first = std::move(first), second = std::move(second)](double x, double y) { return first(x, y) || second(x, y); };
}

Shape operator-(Shape first, Shape second) {
    return [first = std::move(first), second = std::move(second)](double x, double y) { return first(x, y) && !second(x, y); };
}

void add_body(Particles& particles, const Body& body, const Grid& grid, Geometry geometry) {
    if (!(body.density > 0.0 && std::isfinite(body.density)))
        throw InputError(fmt::format("a body has the density {} kg/m^3: it must be positive and finite", body.density));
    const std::size_t before = particles.size();
    const double half_width = 0.5 * grid.dx() / body.particles_per_side, half_height = 0.5 * grid.dy() / body.particles_per_side;
    for_each_trial_point(grid, body.particles_per_side, body.shape, [&](double x, double y) {
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
        particles.internal[p] = body.internal;
        particles.material[p] = body.material;
        particles.id[p] = static_cast<std::int64_t>(p);
    });
    if (particles.size() == before)
        throw InputError("a body has no particle: it lies outside the grid or is smaller than the distance of the trial points; "
                         "use smaller cells or more particles a cell");
}

RigidBody make_rigid_body(const std::string& name, const Shape& shape, int particles_per_side, const Grid& grid) {
    RigidBody body{.name = name};
    for_each_trial_point(grid, particles_per_side, shape, [&](double x, double y) {
        body.x.push_back(x);
        body.y.push_back(y);
    });
    if (body.x.empty())
        throw InputError(fmt::format("the rigid body '{}' has no point: it lies outside the grid", name));
    return body;
}

} // namespace ductile::mpm
