// SPDX-License-Identifier: GPL-3.0-or-later
// A column under its own weight, H = 1 m high, between slip walls on a fixed bottom: uniaxial strain. Gravity grows with the
// steps to g with rho_0 g H = 0.2 alpha, alpha = K + 4 mu/3.
//
// The cross-section stays, so the nominal stress is the Cauchy stress and carries what is above: sigma_yy = -rho_0 g (H - Y). The
// law integrates rates of strain and nothing turns: sigma_yy = alpha ln F. Hence
//   F = exp(-k (H - Y)),   y = (exp(-k (H - Y)) - exp(-k H))/k,   k = rho_0 g/alpha.
// An implicit step adds the strain dF/F of its beginning where ln F grows by ln(1 + dF/F): the error is of first order in the
// number of steps.
#include "cases.hpp"
#include <ductile/material/linear_elastic.hpp>

namespace solutions {

namespace {

constexpr double height = 1.0, density = 1000.0, compression = 0.2;

void compact(Table& table, const auto& shape, int cells, int steps, int particles_per_side = 2) {
    const double h = height / cells;
    const IsotropicElasticity elasticity = elasticity_from_young(1e6, 0.3);
    const double gravity = compression * elasticity.alpha() / (density * height), k = compression / height;
    const Scene scene{
        .grid = {.cells_x = 3,
                 .cells_y = cells + 2,
                 .width = 3.0 * h,
                 .height = height + 2.0 * h,
                 .sides = {.left = SideCondition::slip, .right = SideCondition::slip, .bottom = SideCondition::fixed}},
        .shape = shape.second,
        .materials = {{linear_elastic_law(elasticity)}},
        .body_force = [gravity](std::int64_t, double, double, double time) {
            return std::array{0.0, -gravity * time};
        }};
    State state;
    Particles& p = state.particles;
    add_body(p, {.shape = rectangle(0.0, 0.0, 3.0 * h, height), .density = density, .particles_per_side = particles_per_side},
             scene);
    const Places start(p);
    const auto stepper = quasi_static_stepper(scene, 1e-11);
    advance(*stepper, state, 1.0, steps);
    RootMeanSquare displacement, stress;
    double top = 0.0;
    for (std::size_t i = 0; i < p.size(); ++i) {
        const double y0 = start.y[static_cast<std::size_t>(p.id[i])];
        const double y = (std::exp(-k * (height - y0)) - std::exp(-k * height)) / k;
        displacement.add(p.y[i] - y);
        stress.add((p.stress_yy[i] + density * gravity * (height - y0)) / (density * gravity * height));
        top = y0 > height - 0.5 * h ? p.y[i] - y : top;
    }
    table.row(shape.first, cells, particles_per_side, steps, displacement.value(), stress.value(), top,
              crossed(scene.grid, p, start));
}

} // namespace

void column(const std::filesystem::path& folder) {
    Table table(folder / "column.csv", "shape,cells,particles_per_side,steps,displacement_m,relative_stress,top_m,crossed");
    for (const auto& shape : all_shapes)
        for (const int cells : {8, 16, 32, 64})
            compact(table, shape, cells, 1600);
    for (const auto& shape : all_shapes) // what is due to the sums over particles in place of integrals
        compact(table, shape, 32, 1600, 6);
    for (const int steps : {50, 100, 200, 400, 800}) // and what to the steps
        compact(table, all_shapes[2], 32, steps, 6);
}

} // namespace solutions
