// SPDX-License-Identifier: GPL-3.0-or-later
// taylor_bar: a copper cylinder hits a rigid, slippery wall (Taylor's test).
//
// 32.4 mm long, 6.4 mm thick, 227 m/s: von Mises plasticity with linear hardening, axisymmetric. After 80 us it is at rest,
// some 21.5 mm long, with a foot of some 7 mm radius. A few seconds:
//
//   ./ductile taylor_bar --output out/taylor
#include <ductile/mpm/setup.hpp>

#include <algorithm>

using namespace ductile;
using namespace ductile::mpm;

namespace {

struct BarOptions {
    MaterialData material{.name = "copper",
                          .law = LawChoice::von_mises,
                          .young_modulus = 117e9,
                          .poisson_ratio = 0.35,
                          .density = 8930.0,
                          .heat_capacity = 385.0,
                          .yield_stress = 0.4e9,
                          .hardening = {.modulus = 0.1e9}};
    double speed = 227.0;
};

Setup make_bar(const BarOptions& o, const Options& options) {
    (void)cells_along(0.4e-3, options, "an eighth of the bar's radius");
    using enum Setup::Take;
    // the outermost particle sits half a particle inside the surface
    const double inset = 0.5 * options.cell_size / options.particles_per_side;
    return {.grid = {.geometry = Geometry::axisymmetric, .width = 12e-3, .height = 36e-3},
            .sides = {.left = SideCondition::slip, .bottom = SideCondition::slip},
            .materials = {o.material},
            .bodies = {{.name = "bar",
                        .material = o.material.name,
                        .shape = rectangle(0.0, 0.0, 3.2e-3, 32.4e-3),
                        .velocity = {0.0, -o.speed}}},
            .observables = {{.name = "length_m", .quantity = "position-y", .take = largest, .offset = inset},
                            {.name = "foot_radius_m", .quantity = "position-x", .take = largest, .offset = inset},
                            {.name = "largest_temperature_rise_K", .quantity = "temperature-rise", .take = largest}},
            .curve = {"time_s", "length_m", "time [s]", "length [m]"}};
}

Problem make_problem(const BarOptions& o, const Options& options) {
    Problem problem = make_problem(make_bar(o, options), options);
    problem.conclusions.conclude = [final_values = problem.conclusions.conclude](const Observation& seen, const Tally& tally,
                                                                                 nlohmann::ordered_json& extra) {
        final_values(seen, tally, extra);
        extra["final_largest_plastic_strain"] = std::ranges::max(seen.state.particles.internal[0]);
    };
    return problem;
}

} // namespace

int main(int argc, char** argv) {
    return io::run_main([&] {
        // 1. options
        io::Program program("taylor_bar", "Taylor's impact test: a copper cylinder hits a wall (material points, axisymmetric).");
        Options options{.cell_size = 0.4e-3,
                        .shape = ShapeFunction::bspline,
                        .method = Method::explicit_steps,
                        .safety = 0.3,
                        .duration = 80e-6,
                        .snapshots = {0.0, 20e-6, 40e-6, 80e-6}};
        BarOptions bar;
        declare(program, options);
        writes_scene(program, [&] { return make_bar(bar, options); });
        declare_parameters(program, bar.material, "Bar");
        program.option("--speed", bar.speed, {"Bar", "of the impact", "m/s", io::positive});
        if (!program.parse(argc, argv))
            return 0;

        // 2. scene, 3. run and report
        return run_program(program, options, make_problem(bar, options));
    });
}
