// upsetting: a steel cylinder pressed flat between two platens (Sulsky & Kaul, Sec. 3.2, Figs. 10-13, Table VI).
//
// The upper half of a billet of 20 mm diameter and 30 mm height; the platen comes down with 1 m/s from a millimetre above and
// sticks to it, until 60 % of the height is gone. Implicit steps a thousand times as long as explicit ones take seconds:
//
//   ./ductile upsetting --dt 1e-4 --output out/upsetting
#include <ductile/material/von_mises.hpp>
#include <ductile/mpm/options.hpp>

#include <algorithm>
#include <numbers>

using namespace ductile;
using namespace ductile::mpm;

namespace {

struct BilletOptions {
    double young_modulus = 200e9, poisson_ratio = 0.3, density = 7800.0, speed = 1.0;
    Hardening hardening{.yield_stress = 0.7e9, .modulus = 0.3e9};
    double heat_capacity = 460.0;
    bool frictionless = false;
};

Problem make_billet(const BilletOptions& o, const Options& options) {
    constexpr double width = 24e-3, height = 18e-3;
    const int n = cells_along(1e-3, options, "a tenth of the billet's radius");
    Problem problem;
    problem.scene = {
        .geometry = Geometry::axisymmetric,
        .grid = {.cells_x = 24 * n,
                 .cells_y = 18 * n,
                 .width = width,
                 .height = height,
                 .sides = {.left = SideCondition::slip, .bottom = SideCondition::slip}},
        .shape = options.shape,
        .materials = {{von_mises_law(elasticity_from_young(o.young_modulus, o.poisson_ratio), o.hardening), o.heat_capacity}}};
    add_body(problem.start.particles,
             {.shape = rectangle(0.0, 0.0, 10e-3, 15e-3), .density = o.density, .particles_per_side = options.particles_per_side},
             problem.scene);
    RigidBody platen =
        make_rigid_body("platen", rectangle(0.0, 16e-3, width, height), options.particles_per_side, problem.scene.grid);
    platen.velocity = Velocity{0.0, -o.speed};
    platen.holds_x = !o.frictionless;
    problem.start.rigid_bodies.push_back(std::move(platen));

    const auto largest = [](const aligned_vector<double>& values) { return *std::max_element(values.begin(), values.end()); };
    const auto load = [](const Observation& seen) { return 2.0 * std::numbers::pi * seen.contact_forces[0][1]; };
    problem.observables = {
        {"deflection_m", [speed = o.speed](const Observation& seen) { return speed * seen.state.time; }},
        {"load_N", load},
        {"radius_m", [largest](const Observation& seen) { return largest(seen.state.particles.x); }},
        {"height_m", [largest](const Observation& seen) { return largest(seen.state.particles.y); }},
        {"largest_temperature_rise_K", [largest](const Observation& seen) { return largest(seen.state.particles.temperature); }}};
    problem.curve_x = "deflection_m";
    problem.curve_y = "load_N";
    problem.label_x = "way of the platen [m]";
    problem.label_y = "load [N]";
    const TrailingMean loads("loads_N", 0.97);
    problem.conclusions = {
        .observe = [=](const Observation& seen, Tally& tally) { loads.add(tally, seen.state.time, load(seen)); },
        .conclude =
            [=](const Observation& seen, const Tally& tally, nlohmann::ordered_json& extra) {
                const Particles& particles = seen.state.particles;
                extra["final_load_N"] = loads.last(tally);
                extra["mean_load_of_last_3_percent_N"] = loads.mean(tally);
                extra["final_radius_m"] = largest(particles.x);
                extra["final_height_m"] = largest(particles.y);
                extra["final_largest_plastic_strain"] = largest(particles.internal[0]);
            }};
    return problem;
}

} // namespace

int main(int argc, char** argv) {
    return io::run_main([&] {
        // 1. options; a safety factor of 0.484015 gives the 99388 explicit steps of the paper with --stable-step bar
        io::Program program("upsetting", "Upsetting of a steel cylinder (material points, axisymmetric).");
        Options options{.cell_size = 1e-3,
                        .implicit_dt = 1e-4,
                        .safety = 0.484015,
                        .duration = 9.5e-3,
                        .snapshots = {0.0, 3e-3, 6e-3, 9.5e-3}};
        BilletOptions billet;
        declare(program, options);
        program.option("--young-modulus", billet.young_modulus, {"Billet", "Young's modulus E", "Pa", io::positive});
        program.option("--poisson-ratio", billet.poisson_ratio,
                       {"Billet", "Poisson's ratio nu", "", io::strictly_between(-1.0, 0.5)});
        program.option("--density", billet.density, {"Billet", "density", "kg/m^3", io::positive});
        program.option("--yield-stress", billet.hardening.yield_stress, {"Billet", "first yield", "Pa", io::positive});
        program.option("--hardening", billet.hardening.modulus, {"Billet", "hardening modulus", "Pa", io::not_negative});
        program.option("--heat-capacity", billet.heat_capacity, {"Billet", "for the temperature rise", "J/(kg K)", io::positive});
        program.option("--frictionless", billet.frictionless,
                       {"Billet", "let the platen slip over the billet instead of sticking to it"});
        program.option("--speed", billet.speed, {"Billet", "of the platen", "m/s", io::positive});
        if (!program.parse(argc, argv))
            return 0;

        // 2. scene, 3. run and report
        return run_program(program, options, make_billet(billet, options));
    });
}
