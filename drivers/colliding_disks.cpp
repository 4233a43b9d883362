// SPDX-License-Identifier: GPL-3.0-or-later
// colliding_disks: two elastic disks meet and rebound (Sulsky & Kaul, Sec. 3.1, Figs. 2 and 3, Table II).
//
// Disks of 0.4 m diameter fly towards each other along a diagonal; they touch through the velocity field of the grid alone. Their
// contact lasts about 3 s, a hundred explicit steps: steps of 0.25 s resolve it, steps of 2.4 s cannot. A few seconds:
//
//   ./ductile colliding_disks --dt 0.24 --output out/disks
#include <ductile/mpm/diagnostics.hpp>
#include <ductile/mpm/setup.hpp>

#include <algorithm>

using namespace ductile;
using namespace ductile::mpm;

namespace {

struct DiskOptions {
    MaterialData material{.young_modulus = 1000.0, .poisson_ratio = 0.3, .density = 1000.0};
    double speed = 1e-3;
};

Setup make_disks(const DiskOptions& o) {
    Setup setup{.grid = {.width = 1.0, .height = 1.0},
                .materials = {o.material},
                .curve = {"time_s", "total_energy_J", "time [s]", "kinetic and strain energy [J/m]"}};
    for (const double sign : {1.0, -1.0}) {
        const double centre = 0.5 - 0.23 * sign; // impact after some 70 s
        setup.bodies.push_back({.name = sign > 0.0 ? "lower disk" : "upper disk",
                                .material = o.material.name,
                                .shape = disk(centre, centre, 0.2),
                                .velocity = {sign * o.speed, sign * o.speed}});
    }
    return setup;
}

Problem make_problem(const DiskOptions& o, const Options& options) {
    (void)cells_along(1.0, options, "the side of the grid", 3);
    Problem problem = make_problem(make_disks(o), options);
    const auto energies = [scene = problem.scene](const Observation& seen) { return energies_of(scene, seen.state.particles); };
    problem.conclusions = {.observe =
                               [energies](const Observation& seen, Tally& tally) {
                                   const Energies e = energies(seen);
                                   tally.try_emplace("kinetic_and_strain_energy_at_start_J", 1, e.kinetic + e.strain);
                                   double& largest =
                                       tally.try_emplace("largest_strain_energy_J", 1, e.strain).first->second.front();
                                   largest = std::max(largest, e.strain);
                               },
                           .conclude =
                               [energies](const Observation& seen, const Tally& tally, nlohmann::ordered_json& extra) {
                                   const Energies e = energies(seen);
                                   extra["energy_kept"] =
                                       (e.kinetic + e.strain) / tally.at("kinetic_and_strain_energy_at_start_J").front();
                                   extra["largest_strain_energy_J"] = tally.at("largest_strain_energy_J").front();
                               }};
    return problem;
}

} // namespace

int main(int argc, char** argv) {
    return io::run_main([&] {
        // 1. options; a safety factor of 0.48765 gives the 6152 explicit steps of the paper with --stable-step bar
        io::Program program("colliding_disks", "Two elastic disks that collide (material points).");
        Options options{.cell_size = 0.05,
                        .implicit_dt = "0.24",
                        .safety = 0.48765,
                        .duration = 150.0,
                        .snapshots = {0.0, 25.0, 75.0, 100.0, 150.0}};
        DiskOptions disks;
        declare(program, options);
        writes_scene(program, [&] { return make_disks(disks); });
        declare_parameters(program, disks.material, "Disks");
        program.option("--speed", disks.speed, {"Disks", "of each disk, in x and in y", "m/s", io::positive});
        if (!program.parse(argc, argv))
            return 0;

        // 2. scene, 3. run and report
        return run_program(program, options, make_problem(disks, options));
    });
}
