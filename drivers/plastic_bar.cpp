// SPDX-License-Identifier: GPL-3.0-or-later
// plastic_bar: the bar of elastic_bar from a hardening metal (Sulsky & Kaul, Sec. 3.1, Fig. 4, Tables III and V).
//
// Von Mises plasticity with the yield stress 6 Pa and the hardening modulus 5000 Pa, to a strain of 8 %; --duration 100 takes it
// to 33 %, --direction compression pushes instead. About a second:
//
//   ./ductile plastic_bar --dt 0.5 --dt-start 0.0048 --output out/plastic
#include <ductile/mpm/bars.hpp>
#include <ductile/mpm/options.hpp>

using namespace ductile;
using namespace ductile::mpm;

int main(int argc, char** argv) {
    return io::run_main([&] {
        // 1. options; a safety factor of 0.4778 gives the 5024 explicit steps of the paper with --stable-step bar
        io::Program program("plastic_bar", "An elastoplastic bar in tension or compression (material points).");
        Options options{.cell_size = 0.1, .safety = 0.4778, .duration = 24.0, .snapshots = {0.0, 24.0}};
        BarOptions bar{.material = {.law = LawChoice::von_mises,
                                    .young_modulus = 1000.0,
                                    .poisson_ratio = 0.3,
                                    .density = 10.0,
                                    .yield_stress = 6.0,
                                    .hardening = {.modulus = 5000.0}}};
        declare(program, options);
        writes_scene(program, [&] { return make_bar(bar, options); });
        declare(program, bar);
        if (!program.parse(argc, argv))
            return 0;

        // 2. scene, 3. run and report
        return run_program(program, options, make_problem(make_bar(bar, options), options));
    });
}
