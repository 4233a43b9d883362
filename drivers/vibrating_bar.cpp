// vibrating_bar: the first axial mode of an elastic bar, held at its left end and free at its right one.
//
// E = 100 Pa, density 1 kg/m^3, length 25 m, initial velocity 0.1 sin(pi x/2L) m/s: a period of 10 s and 0.15915 m at the tip. It
// shows what a time integrator does to energy and frequency: compare --method explicit, midpoint, and implicit, which damps. Ten
// periods take a second:
//
//   ./ductile vibrating_bar --method midpoint --output out/vibration
#include <ductile/material/linear_elastic.hpp>
#include <ductile/mpm/diagnostics.hpp>
#include <ductile/mpm/options.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

using namespace ductile;
using namespace ductile::mpm;

namespace {

struct BarOptions {
    double young_modulus = 100.0, density = 1.0, length = 25.0, speed = 0.1;
};

/// Three rows of cells between slippery walls: with nu = 0 the motion is axial.
Problem make_bar(const BarOptions& o, const Options& options) {
    const int n = cells_along(o.length, options, "the length of the bar", 3);
    Problem problem;
    problem.scene = {.grid = {.cells_x = n + 2,
                              .cells_y = 3,
                              .width = (n + 2) * options.cell_size,
                              .height = 3 * options.cell_size,
                              .sides = {.left = SideCondition::slip, .bottom = SideCondition::slip, .top = SideCondition::slip}},
                     .shape = options.shape,
                     .materials = {{linear_elastic_law(elasticity_from_young(o.young_modulus, 0.0))}},
                     .finite_rotation = false};
    Particles& particles = problem.start.particles;
    add_body(particles,
             {.shape = rectangle(0.0, 0.0, o.length, 3 * options.cell_size),
              .density = o.density,
              .particles_per_side = options.particles_per_side},
             problem.scene);
    for (std::size_t p = 0; p < particles.size(); ++p)
        particles.velocity_x[p] = o.speed * std::sin(0.5 * std::numbers::pi * particles.x[p] / o.length);
    const double tip = *std::max_element(particles.x.begin(), particles.x.end());
    const auto tip_way = [tip](const Observation& seen) {
        return *std::max_element(seen.state.particles.x.begin(), seen.state.particles.x.end()) - tip;
    };
    problem.observables = {{"tip_displacement_m", tip_way}};
    problem.curve_x = "time_s";
    problem.curve_y = "tip_displacement_m";
    problem.label_x = "time [s]";
    problem.label_y = "displacement of the tip [m]";
    const auto energy = [scene = problem.scene](const Observation& seen) {
        const Energies e = energies_of(scene, seen.state.particles);
        return e.kinetic + e.strain;
    };
    problem.conclusions = {
        .observe =
            [=](const Observation& seen, Tally& tally) {
                const double time = seen.state.time, way = tip_way(seen);
                if (tally.try_emplace("kinetic_and_strain_energy_at_start_J").second)
                    tally["kinetic_and_strain_energy_at_start_J"] = {energy(seen)};
                std::vector<double>& last = tally.try_emplace("tip_time_and_way", std::vector{time, way, way}).first->second;
                // the times when the tip passes its place from the right: the first, the last, their number
                std::vector<double>& falls = tally.try_emplace("tip_falls", 3, 0.0).first->second;
                if (last[1] > 0.0 && way <= 0.0) {
                    falls[1] = last[0] + (time - last[0]) * last[1] / (last[1] - way);
                    falls[0] = falls[2] == 0.0 ? falls[1] : falls[0];
                    falls[2] += 1.0;
                }
                last = {time, way, std::max(last[2], way)};
            },
        .conclude =
            [=](const Observation& seen, const Tally& tally, nlohmann::ordered_json& extra) {
                const std::vector<double>& falls = tally.at("tip_falls");
                if (falls[2] > 1.0)
                    extra["period_s"] = (falls[1] - falls[0]) / (falls[2] - 1.0);
                extra["largest_tip_displacement_m"] = tally.at("tip_time_and_way")[2];
                extra["energy_kept"] = energy(seen) / tally.at("kinetic_and_strain_energy_at_start_J").front();
            }};
    return problem;
}

} // namespace

int main(int argc, char** argv) {
    return io::run_main([&] {
        // 1. options
        io::Program program("vibrating_bar", "An elastic bar in its first axial mode (material points).");
        Options options{.cell_size = 1.0, .method = Method::midpoint, .implicit_dt = 0.05, .duration = 100.0};
        BarOptions bar;
        declare(program, options);
        program.option("--young-modulus", bar.young_modulus, {"Bar", "Young's modulus E", "Pa", io::positive});
        program.option("--density", bar.density, {"Bar", "density", "kg/m^3", io::positive});
        program.option("--length", bar.length, {"Bar", "its length", "m", io::positive});
        program.option("--speed", bar.speed, {"Bar", "initial velocity of the tip", "m/s"});
        if (!program.parse(argc, argv))
            return 0;

        // 2. scene, 3. run and report
        return run_program(program, options, make_bar(bar, options));
    });
}
