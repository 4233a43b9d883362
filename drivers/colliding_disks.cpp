// colliding_disks: two elastic disks meet and rebound (Sulsky & Kaul, Sec. 3.1, Figs. 2 and 3, Table II).
//
// Disks of 0.4 m diameter fly towards each other along a diagonal; they touch through the velocity field of the grid alone. Their
// contact lasts about 3 s, a hundred explicit steps: steps of 0.25 s resolve it, steps of 2.4 s cannot. A few seconds:
//
//   ./ductile colliding_disks --dt 0.24 --output out/disks
#include <ductile/material/linear_elastic.hpp>
#include <ductile/mpm/diagnostics.hpp>
#include <ductile/mpm/options.hpp>

#include <algorithm>

using namespace ductile;
using namespace ductile::mpm;

namespace {

struct DiskOptions {
    double young_modulus = 1000.0, poisson_ratio = 0.3, density = 1000.0, speed = 1e-3;
};

Problem make_disks(const DiskOptions& o, const Options& options) {
    const int n = cells_along(1.0, options, "the side of the grid", 3);
    Problem problem;
    problem.scene = {.grid = {.cells_x = n, .cells_y = n, .width = 1.0, .height = 1.0},
                     .shape = options.shape,
                     .materials = {{linear_elastic_law(elasticity_from_young(o.young_modulus, o.poisson_ratio))}}};
    for (const double sign : {1.0, -1.0}) {
        const double centre = 0.5 - 0.23 * sign; // impact after some 70 s
        add_body(problem.start.particles,
                 {.shape = disk(centre, centre, 0.2),
                  .density = o.density,
                  .velocity_x = sign * o.speed,
                  .velocity_y = sign * o.speed,
                  .particles_per_side = options.particles_per_side},
                 problem.scene);
    }
    problem.curve_x = "time_s";
    problem.curve_y = "total_energy_J";
    problem.label_x = "time [s]";
    problem.label_y = "kinetic and strain energy [J/m]";
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
                        .implicit_dt = 0.24,
                        .safety = 0.48765,
                        .duration = 150.0,
                        .snapshots = {0.0, 25.0, 75.0, 100.0, 150.0}};
        DiskOptions disks;
        declare(program, options);
        program.option("--young-modulus", disks.young_modulus, {"Disks", "Young's modulus E", "Pa", io::positive});
        program.option("--poisson-ratio", disks.poisson_ratio,
                       {"Disks", "Poisson's ratio nu", "", io::strictly_between(-1.0, 0.5)});
        program.option("--density", disks.density, {"Disks", "density", "kg/m^3", io::positive});
        program.option("--speed", disks.speed, {"Disks", "of each disk, in x and in y", "m/s", io::positive});
        if (!program.parse(argc, argv))
            return 0;

        // 2. scene, 3. run and report
        return run_program(program, options, make_disks(disks, options));
    });
}
