// SPDX-License-Identifier: GPL-3.0-or-later
// upsetting: a steel cylinder pressed flat between two platens (Sulsky & Kaul, Sec. 3.2, Figs. 10-13, Table VI).
//
// The upper half of a billet of 20 mm diameter and 30 mm height; the platen comes down with 1 m/s from a millimetre above and
// sticks to it, until 60 % of the height is gone. Implicit steps a thousand times as long as explicit ones take seconds:
//
//   ./ductile upsetting --dt 1e-4 --output out/upsetting
#include <ductile/mpm/setup.hpp>

#include <algorithm>
#include <numbers>

using namespace ductile;
using namespace ductile::mpm;

namespace {

struct BilletOptions {
    MaterialData material{.name = "steel",
                          .law = LawChoice::von_mises,
                          .young_modulus = 200e9,
                          .poisson_ratio = 0.3,
                          .density = 7800.0,
                          .heat_capacity = 460.0,
                          .yield_stress = 0.7e9,
                          .hardening = {.modulus = 0.3e9}};
    double speed = 1.0;
    bool frictionless = false;
    Setup::Contact contact = Setup::Contact::nodes;
    double friction = 0.0;
};

Setup make_billet(const BilletOptions& o, const Options& options) {
    (void)cells_along(1e-3, options, "a tenth of the billet's radius");
    constexpr double width = 24e-3, height = 18e-3;
    using enum Setup::Take;
    return {.grid = {.geometry = Geometry::axisymmetric, .width = width, .height = height},
            .sides = {.left = SideCondition::slip, .bottom = SideCondition::slip},
            .materials = {o.material},
            .bodies = {{.name = "billet", .material = o.material.name, .shape = rectangle(0.0, 0.0, 10e-3, 15e-3)}},
            .rigid_bodies = {{.name = "platen",
                              .shape = rectangle(0.0, 16e-3, width, height),
                              .velocity = Velocity{0.0, -o.speed},
                              .holds_x = !o.frictionless || o.contact == Setup::Contact::surface,
                              .contact = o.contact,
                              .friction = o.friction}},
            .observables = {{.name = "deflection_m", .quantity = "displacement-y", .factor = -1.0},
                            {.name = "load_N", .quantity = "force-y", .factor = 2.0 * std::numbers::pi},
                            {.name = "radius_m", .quantity = "position-x", .take = largest},
                            {.name = "height_m", .quantity = "position-y", .take = largest},
                            {.name = "largest_temperature_rise_K", .quantity = "temperature-rise", .take = largest}},
            .curve = {"deflection_m", "load_N", "way of the platen [m]", "load [N]"}};
}

Problem make_problem(const BilletOptions& o, const Options& options) {
    Problem problem = make_problem(make_billet(o, options), options);
    const auto load = problem.observables.at(1).value;
    const TrailingMean loads("loads_N", 0.97);
    problem.conclusions = {
        .observe = [=](const Observation& seen, Tally& tally) { loads.add(tally, seen.state.time, load(seen)); },
        .conclude =
            [=, final_values = problem.conclusions.conclude](const Observation& seen, const Tally& tally,
                                                             nlohmann::ordered_json& extra) {
                final_values(seen, tally, extra);
                extra["mean_load_of_last_3_percent_N"] = loads.mean(tally);
                extra["final_largest_plastic_strain"] = std::ranges::max(seen.state.particles.internal[0]);
            }};
    return problem;
}

} // namespace

int main(int argc, char** argv) {
    return io::run_main([&] {
        // 1. options; a safety factor of 0.484015 gives the 99388 explicit steps of the paper with --stable-step bar
        io::Program program("upsetting", "Upsetting of a steel cylinder (material points, axisymmetric).");
        Options options{.cell_size = 1e-3,
                        .implicit_dt = "1e-4",
                        .safety = 0.484015,
                        .duration = 9.5e-3,
                        .snapshots = {0.0, 3e-3, 6e-3, 9.5e-3}};
        BilletOptions billet;
        declare(program, options);
        writes_scene(program, [&] { return make_billet(billet, options); });
        declare_parameters(program, billet.material, "Billet");
        program.option("--frictionless", billet.frictionless,
                       {"Billet", "let the platen slip over the billet instead of sticking to it"});
        program.choice("--contact", billet.contact,
                       {{"nodes", Setup::Contact::nodes, "the paper's: the platen holds nodes, from a cell or two away"},
                        {"surface", Setup::Contact::surface, "the billet's surface touches the platen's, and rubs on it"}},
                       {"Billet", "how the platen acts"});
        program.option(
            "--friction", billet.friction,
            {"Billet", "Coulomb's coefficient with --contact surface; with 0 the billet slides", "1", io::not_negative});
        program.option("--speed", billet.speed, {"Billet", "of the platen", "m/s", io::positive});
        if (!program.parse(argc, argv))
            return 0;

        // 2. scene, 3. run and report
        return run_program(program, options, make_problem(billet, options));
    });
}
