// taylor_bar: a copper cylinder hits a rigid, slippery wall (Taylor's test).
//
// 32.4 mm long, 6.4 mm thick, 227 m/s: von Mises plasticity with linear hardening, axisymmetric. After 80 us it is at rest,
// some 21.5 mm long, with a foot of some 7 mm radius. A few seconds:
//
//   ./ductile taylor_bar --output out/taylor
#include <ductile/material/von_mises.hpp>
#include <ductile/mpm/options.hpp>

#include <algorithm>

using namespace ductile;
using namespace ductile::mpm;

namespace {

struct BarOptions {
    double young_modulus = 117e9, poisson_ratio = 0.35, density = 8930.0, speed = 227.0, heat_capacity = 385.0;
    Hardening hardening{.yield_stress = 0.4e9, .modulus = 0.1e9};
};

Problem make_bar(const BarOptions& o, const Options& options) {
    constexpr double radius = 3.2e-3, length = 32.4e-3, height = 36e-3, width = 12e-3;
    const int n = cells_along(0.4e-3, options, "an eighth of the bar's radius");
    Problem problem;
    problem.scene = {
        .geometry = Geometry::axisymmetric,
        .grid = {.cells_x = 30 * n,
                 .cells_y = 90 * n,
                 .width = width,
                 .height = height,
                 .sides = {.left = SideCondition::slip, .bottom = SideCondition::slip}},
        .shape = options.shape,
        .materials = {{von_mises_law(elasticity_from_young(o.young_modulus, o.poisson_ratio), o.hardening), o.heat_capacity}}};
    add_body(problem.start.particles,
             {.shape = rectangle(0.0, 0.0, radius, length),
              .density = o.density,
              .velocity_y = -o.speed,
              .particles_per_side = options.particles_per_side},
             problem.scene);
    const auto largest = [](const aligned_vector<double>& values) { return *std::max_element(values.begin(), values.end()); };
    // the outermost particle sits half a particle inside the surface
    const double inset = 0.5 * options.cell_size / options.particles_per_side;
    problem.observables = {
        {"length_m", [=](const Observation& seen) { return largest(seen.state.particles.y) + inset; }},
        {"foot_radius_m", [=](const Observation& seen) { return largest(seen.state.particles.x) + inset; }},
        {"largest_temperature_rise_K", [=](const Observation& seen) { return largest(seen.state.particles.temperature); }}};
    problem.curve_x = "time_s";
    problem.curve_y = "length_m";
    problem.label_x = "time [s]";
    problem.label_y = "length [m]";
    problem.conclusions.conclude = [=, all = problem.observables](const Observation& seen, const Tally&,
                                                                  nlohmann::ordered_json& extra) {
        for (const Observable& observable : all)
            extra["final_" + observable.name] = observable.value(seen);
        extra["final_largest_plastic_strain"] = largest(seen.state.particles.internal[0]);
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
                        .snapshots = {0.0, 20e-6, 40e-6, 80e-6},
                        .history_every = 20};
        BarOptions bar;
        declare(program, options);
        program.option("--young-modulus", bar.young_modulus, {"Bar", "Young's modulus E", "Pa", io::positive});
        program.option("--poisson-ratio", bar.poisson_ratio, {"Bar", "Poisson's ratio nu", "", io::strictly_between(-1.0, 0.5)});
        program.option("--density", bar.density, {"Bar", "density", "kg/m^3", io::positive});
        program.option("--speed", bar.speed, {"Bar", "of the impact", "m/s", io::positive});
        program.option("--yield-stress", bar.hardening.yield_stress, {"Bar", "first yield", "Pa", io::positive});
        program.option("--hardening", bar.hardening.modulus, {"Bar", "hardening modulus", "Pa", io::not_negative});
        program.option("--heat-capacity", bar.heat_capacity, {"Bar", "for the temperature rise", "J/(kg K)", io::positive});
        if (!program.parse(argc, argv))
            return 0;

        // 2. scene, 3. run and report
        return run_program(program, options, make_bar(bar, options));
    });
}
