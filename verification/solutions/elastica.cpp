// SPDX-License-Identifier: GPL-3.0-or-later
// A cantilever, L = 10 m long and t = 0.5 m thick, under its own weight, which grows with the steps to q = 6 E I/L^3 a metre of
// length: then the tip hangs by half the length. Plane strain with Poisson's ratio 0, so that E I = E t^3/12. It is clamped at
// the left side of the grid, where all nodes are fixed.
//
// The weight is a dead load, q (L - s) downwards at the arc length s of the unstrained beam. Euler's elastica is
//   E I theta'' = -q (L - s) cos theta,   theta(0) = 0,   theta'(L) = 0
// for the angle theta below the horizontal; verification/solutions.py integrates it, and the beam that is sheared and stretched
// besides (Reissner 1972). Reported are the mean places of the columns of particles, which lie at s = (i + 1/2) times their
// distance.
//
// Two methods. The quasi-static one meets a singular stiffness once the hanging beam brings a corner into a new row of nodes: a
// particle that alone sees n components of free nodes gives them three strains, and nothing resists their other n - 3 motions.
// Newton's method fails there or soon after; reported are how far it got, and the stiffness where it stopped. The implicit method
// with inertia has mass to hold these nodes; with the load grown in 1000 s, 25 periods of the beam, and the damping of the
// backward Euler formula, what inertia does to the beam is nothing beside the weight.
#include "cases.hpp"

#include <ductile/base/error.hpp>
#include <ductile/material/linear_elastic.hpp>
#include <ductile/mpm/momentum_balance.hpp>

namespace solutions {

namespace {

constexpr double length = 10.0, thickness = 0.5, young_modulus = 1e6, density = 1000.0, duration = 1000.0;

enum class Method { quasi_static, implicit };

/// Rows "shape,row,column,value" of the tangent stiffness at this state, between the components that are not prescribed; several
/// for an entry.
void write_stiffness(Table& table, const char* shape, const Scene& scene, State& state, double dt) {
    MomentumBalance balance(scene, {.method = ImplicitMethod::quasi_static});
    balance.prepare(state, dt);
    balance.linearise(balance.initial_guess());
    const std::vector<char>& prescribed = balance.nodes().prescribed;
    balance.discretisation().stiffness_blocks([&](std::span<const std::int32_t> nodes, std::span<const double> matrix) {
        const std::size_t side = 2 * nodes.size();
        const auto component = [&](std::size_t n) { return 2 * nodes[n / 2] + static_cast<std::int32_t>(n % 2); };
        for (std::size_t r = 0; r < side; ++r)
            for (std::size_t c = 0; c < side; ++c)
                if (!prescribed[component(r)] && !prescribed[component(c)])
                    table.row(shape, component(r), component(c), matrix[r * side + c]);
    });
}

void bend(Table& tip, Table& line, Table& stiffness, Method method, const auto& shape, int cells_through, int particles_per_side,
          int steps) {
    const double h = thickness / cells_through;
    const double inertia = std::pow(thickness, 3) / 12.0, load = 6.0 * young_modulus * inertia / std::pow(length, 3);
    const double gravity = load / (density * thickness);
    const int cells_a_metre = static_cast<int>(std::lround(1.0 / h));
    const Scene scene{.grid = {.cells_x = 11 * cells_a_metre,
                               .cells_y = 9 * cells_a_metre,
                               .width = 11.0,
                               .height = 9.0,
                               .bottom = -8.0,
                               .sides = {.left = SideCondition::fixed}},
                      .shape = shape.second,
                      .materials = {{linear_elastic_law(elasticity_from_young(young_modulus, 0.0))}},
                      .body_force = [gravity](std::int64_t, double, double, double time) {
                          return std::array{0.0, -gravity * time / duration};
                      }};
    State state;
    Particles& p = state.particles;
    add_body(p,
             {.shape = rectangle(0.0, -0.5 * thickness, length, 0.5 * thickness),
              .density = density,
              .particles_per_side = particles_per_side},
             scene);
    const Places start(p);
    ImplicitOptions options{.preconditioner = PreconditionerKind::tangent};
    options.newton.tolerance = 1e-8;
    const auto stepper = method == Method::implicit ? make_implicit_stepper(scene, options)
                                                    : quasi_static_stepper(scene, options.newton.tolerance);
    const char* const name = method == Method::implicit ? "implicit" : "quasi-static";
    try {
        advance(*stepper, state, duration, steps);
    } catch (const RunError& error) {
        fmt::print("{}, {}, {} cells, {} particles a side: {}\n", name, shape.first, cells_through, particles_per_side,
                   error.what());
        if (method == Method::quasi_static)
            write_stiffness(stiffness, shape.first, scene, state, duration / steps);
    }

    const double distance = h / particles_per_side; // of columns
    std::vector<double> x(static_cast<std::size_t>(std::lround(length / distance))), y(x.size());
    for (std::size_t i = 0; i < p.size(); ++i) {
        const auto column_number = static_cast<std::size_t>(start.x[static_cast<std::size_t>(p.id[i])] / distance);
        x[column_number] += p.x[i] / (particles_per_side * cells_through);
        y[column_number] += p.y[i] / (particles_per_side * cells_through);
    }
    tip.row(name, shape.first, cells_through, particles_per_side, steps, state.time / duration, length - 0.5 * distance, x.back(),
            y.back());
    for (std::size_t n = 0; n < x.size(); ++n)
        line.row(name, shape.first, cells_through, particles_per_side, steps, (static_cast<double>(n) + 0.5) * distance, x[n],
                 y[n]);
}

} // namespace

void elastica(const std::filesystem::path& folder) {
    const std::string columns = "method,shape,cells_through,particles_per_side,steps,";
    Table tip(folder / "elastica.csv", columns + "load,s_m,x_m,y_m");
    Table line(folder / "elastica_line.csv", columns + "s_m,x_m,y_m");
    Table stiffness(folder / "elastica_stiffness.csv", "shape,row,column,value");
    for (const auto& shape : all_shapes) {
        for (const auto& [cells_through, particles_per_side] :
             {std::array{2, 2}, {4, 2}, {8, 2}, {2, 4}, {4, 4}, {8, 4}, {2, 8}, {4, 8}})
            bend(tip, line, stiffness, Method::implicit, shape, cells_through, particles_per_side, 400);
        bend(tip, line, stiffness, Method::quasi_static, shape, 4, 2, 400);
    }
    for (const int steps : {100, 200, 800}) // what is due to the steps
        bend(tip, line, stiffness, Method::implicit, all_shapes[2], 4, 4, steps);
}

} // namespace solutions
