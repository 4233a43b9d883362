// SPDX-License-Identifier: GPL-3.0-or-later
// vibrating_bar: the first axial mode of an elastic bar, held at its left end and free at its right one.
//
// E = 100 Pa, density 1 kg/m^3, length 25 m, initial velocity 0.1 sin(pi x/2L) m/s: a period of 10 s and 0.15915 m at the tip. It
// shows what a time integrator does to energy and frequency: compare --method explicit, midpoint, and implicit, which damps. Ten
// periods take a second:
//
//   ./ductile vibrating_bar --method midpoint --output out/vibration
#include <ductile/mpm/diagnostics.hpp>
#include <ductile/mpm/setup.hpp>

#include <algorithm>

using namespace ductile;
using namespace ductile::mpm;

namespace {

struct BarOptions {
    MaterialData material{.young_modulus = 100.0, .density = 1.0};
    double length = 25.0, speed = 0.1;
};

/// Three rows of cells between slippery walls: with nu = 0 the motion is axial.
Setup make_bar(const BarOptions& o, const Options& options) {
    const int n = cells_along(o.length, options, "the length of the bar", 3);
    const double width = (n + 2) * options.cell_size, height = 3 * options.cell_size;
    const int per_side = options.particles_per_side;
    const double tip = (n - 1 + (per_side - 1 + 0.5) / per_side) * (width / (n + 2)); // of its last particle
    return {
        .grid = {.finite_rotation = false, .width = width, .height = height},
        .sides = {.left = SideCondition::slip, .bottom = SideCondition::slip, .top = SideCondition::slip},
        .materials = {o.material},
        .bodies = {{.name = "bar",
                    .material = o.material.name,
                    .shape = rectangle(0.0, 0.0, o.length, height),
                    .axial_mode = {o.speed, o.length}}},
        .observables = {{.name = "tip_displacement_m", .quantity = "position-x", .take = Setup::Take::largest, .offset = -tip}},
        .curve = {"time_s", "tip_displacement_m", "time [s]", "displacement of the tip [m]"}};
}

Problem make_problem(const BarOptions& o, const Options& options) {
    Problem problem = make_problem(make_bar(o, options), options);
    const auto tip_way = problem.observables.front().value;
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
            [=, final_values = problem.conclusions.conclude](const Observation& seen, const Tally& tally,
                                                             nlohmann::ordered_json& extra) {
                final_values(seen, tally, extra);
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
        Options options{.cell_size = 1.0, .method = Method::midpoint, .implicit_dt = "0.05", .duration = 100.0};
        BarOptions bar;
        declare(program, options);
        writes_scene(program, [&] { return make_bar(bar, options); });
        declare_parameters(program, bar.material, "Bar");
        program.option("--length", bar.length, {"Bar", "its length", "m", io::positive});
        program.option("--speed", bar.speed, {"Bar", "initial velocity of the tip", "m/s"});
        if (!program.parse(argc, argv))
            return 0;

        // 2. scene, 3. run and report
        return run_program(program, options, make_problem(bar, options));
    });
}
