// SPDX-License-Identifier: GPL-3.0-or-later
// Cook's membrane (Cook 1974): the quadrilateral (0,0), (48,44), (48,60), (0,44), clamped at the left side of the grid, with a
// shear force of 1 in all on the right edge; E = 1. Small strains: one linear step under a thousandth of the force, and the
// displacement a thousand times as large. Plane stress with nu = 1/3, and plane strain with nu = 0.4999, nearly incompressible.
//
// The body is the particles whose places lie inside, so that slanted edges are staircases, and the force is a body force on the
// last column of particles, a quarter of a cell inside the edge. Reported is the displacement at (48, 52), taken from the
// particle that is nearest to it. References: verification/solutions.py.
#include "cases.hpp"
#include <ductile/material/linear_elastic.hpp>

namespace solutions {

namespace {

constexpr double force = 1e-3;

void load(Table& table, const auto& shape, Geometry geometry, double poisson_ratio, double h) {
    const int cells_x = static_cast<int>(std::lround(52.0 / h)), cells_y = static_cast<int>(std::lround(68.0 / h));
    Scene scene{.geometry = geometry,
                .grid = {.cells_x = cells_x,
                         .cells_y = cells_y,
                         .width = 52.0,
                         .height = 68.0,
                         .bottom = -4.0,
                         .sides = {.left = SideCondition::fixed}},
                .shape = shape.second,
                .materials = {{linear_elastic_law(elasticity_from_young(1.0, poisson_ratio))}},
                .finite_rotation = false};
    State state;
    Particles& p = state.particles;
    const Shape membrane = [](double x, double y) {
        return x > 0.0 && x < 48.0 && y > 44.0 * x / 48.0 && y < 44.0 + 16.0 * x / 48.0;
    };
    add_body(p, {.shape = membrane, .density = 1.0}, scene);
    const Places start(p);
    const auto in_last_column = [&](std::size_t id) { return start.x[id] > 48.0 - 0.5 * h; };
    double mass = 0.0;
    std::size_t nearest = 0;
    for (std::size_t id = 0; id < p.size(); ++id) {
        mass += in_last_column(id) ? p.mass[id] : 0.0;
        const auto distance = [&](std::size_t i) { return std::hypot(start.x[i] - 48.0, start.y[i] - 52.0); };
        nearest = distance(id) < distance(nearest) ? id : nearest;
    }
    scene.body_force = [&](std::int64_t id, double, double, double) {
        return std::array{0.0, in_last_column(static_cast<std::size_t>(id)) ? force / mass : 0.0};
    };
    ImplicitOptions options{.scheme = {.method = ImplicitMethod::quasi_static},
                            .solver = SolverKind::newton_cg,
                            .preconditioner = PreconditionerKind::tangent,
                            .scale = ResidualScale::none};
    options.newton.tolerance = 1e-8 * force;
    const auto stepper = make_implicit_stepper(scene, options);
    advance(*stepper, state, 1.0, 1);
    for (std::size_t i = 0; i < p.size(); ++i)
        if (static_cast<std::size_t>(p.id[i]) == nearest)
            table.row(shape.first, geometry == Geometry::plane_stress ? "plane stress" : "plane strain", poisson_ratio, h,
                      p.size(), start.x[nearest], start.y[nearest], (p.y[i] - start.y[nearest]) / force);
}

} // namespace

void cook(const std::filesystem::path& folder) {
    Table table(folder / "cook.csv", "shape,geometry,poisson_ratio,cell,particles,x,y,displacement");
    for (const auto& shape : all_shapes)
        for (const double h : {4.0, 2.0, 1.0, 0.5, 0.25}) {
            load(table, shape, Geometry::plane_stress, 1.0 / 3.0, h);
            load(table, shape, Geometry::plane_strain, 0.4999, h);
        }
}

} // namespace solutions
