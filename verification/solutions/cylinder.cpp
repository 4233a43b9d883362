// SPDX-License-Identifier: GPL-3.0-or-later
// A thick-walled cylinder in plane strain, inner radius a = 1 m, outer radius b = 2 m, that a rigid wall widens (Hill 1950):
// von Mises metal with E = 10^6 Y, so that strains stay below 10^-5 and the linear theory is as exact. A strip of three
// cells along the axis between slip walls; the radius is x.
//
// Without hardening the pressure tends to (2/sqrt 3) Y ln(b/a). The whole curve and the stress in the wall come from an
// independent solution of the same law, in verification/solutions.py.
//
// The wall has its points on the line x = a, the left side of the grid. With all three shape functions they touch the nodes of
// that line only, whose functions are 1 there: so the wall acts at x = a. The points are put back after each step, because a
// body that has moved any distance into the first cell touches its far nodes, too, and holds the whole cell. To see what this
// matters, `body` has its points in the middle of the cell behind the line, as those of any body that has come up to another:
// they touch the nodes x = a with linear functions and GIMP, and those one node farther with B-splines.
#include "cases.hpp"

#include <ductile/material/von_mises.hpp>
#include <ductile/mpm/contact_force.hpp>

namespace solutions {

namespace {

constexpr double inner = 1.0, outer = 2.0, yield_stress = 1e6, expansion = 6e-6;
constexpr int steps = 120;

enum class Wall { line, body };

void widen(Table& curve, Table& profile, const auto& shape, Wall wall, double hardening, int cells) {
    const double h = (outer - inner) / cells;
    const int behind = wall == Wall::line ? 0 : 1; // cells before x = a
    const Scene scene{.geometry = Geometry::axisymmetric,
                      .grid = {.cells_x = cells + behind + 2,
                               .cells_y = 3,
                               .width = (cells + behind + 2) * h,
                               .height = 3.0 * h,
                               .left = inner - behind * h,
                               .sides = {.bottom = SideCondition::slip, .top = SideCondition::slip}},
                      .shape = shape.second,
                      .materials = {{von_mises_law(elasticity_from_young(1e6 * yield_stress, 0.3),
                                                   {.yield_stress = yield_stress, .modulus = hardening})}}};
    State state;
    Particles& p = state.particles;
    add_body(p, {.shape = rectangle(inner, 0.0, outer, 3.0 * h), .density = 1000.0}, scene);
    const Places start(p);
    RigidBody pusher{.name = "wall", .velocity = Velocity{expansion, 0.0}, .holds_y = false};
    for (const double row : {0.5, 1.5, 2.5}) {
        pusher.x.push_back(inner - 0.5 * behind * h);
        pusher.y.push_back(row * h);
    }
    const std::vector<double> places = pusher.x;
    state.rigid_bodies.push_back(pusher);
    const auto stepper = quasi_static_stepper(scene, 1e-13);
    const char* const name = wall == Wall::line ? "line" : "body";
    advance(*stepper, state, 1.0, steps, [&] {
        state.rigid_bodies[0].x = places;
        const double pressure = -contact_force(stepper->discretisation().nodes(), stepper->force(), 0)[0] / (inner * 3.0 * h);
        curve.row(shape.first, name, hardening, cells, expansion * state.time, pressure);
    });
    for (std::size_t i = 0; i < p.size(); ++i)
        profile.row(shape.first, name, hardening, cells, start.x[static_cast<std::size_t>(p.id[i])], p.stress_xx[i],
                    p.stress_zz[i], p.stress_yy[i]);
}

} // namespace

void cylinder(const std::filesystem::path& folder) {
    Table curve(folder / "cylinder.csv", "shape,wall,hardening_Pa,cells,displacement_m,pressure_Pa");
    Table profile(folder / "cylinder_profile.csv", "shape,wall,hardening_Pa,cells,radius_m,radial_Pa,hoop_Pa,axial_Pa");
    for (const auto& shape : all_shapes)
        for (const double hardening : {0.0, 100'000.0 * yield_stress})
            for (const int cells : {8, 16, 32, 64})
                widen(curve, profile, shape, Wall::line, hardening, cells);
    for (const auto& shape : all_shapes)
        for (const int cells : {8, 16, 32, 64})
            widen(curve, profile, shape, Wall::body, 0.0, cells);
}

} // namespace solutions
