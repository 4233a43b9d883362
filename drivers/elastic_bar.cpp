// SPDX-License-Identifier: GPL-3.0-or-later
// elastic_bar: a square bar pulled by a rigid body (Sulsky & Kaul, Sec. 3.1, Fig. 1, Tables I and IV).
//
// The bar [0.4, 0.7] x [0.1, 0.4] m sticks to the right end of the grid; a rigid body at its left end moves away with 1 mm/s.
// The stress along the bar is uniform and grows as E v t/L, (3.1.1): with nu = 0; the stated nu = 0.3 holds back the contraction
// at the ends. Implicit steps a hundred times as long as explicit ones, after a ramp, take a fraction of a second:
//
//   ./ductile elastic_bar --dt 0.5 --dt-start 0.0048 --output out/bar
#include <ductile/mpm/bars.hpp>
#include <ductile/mpm/options.hpp>

using namespace ductile;
using namespace ductile::mpm;

int main(int argc, char** argv) {
    return io::run_main([&] {
        // 1. options; a safety factor of 0.484015 gives the 2108 explicit steps of the paper with --stable-step bar
        io::Program program("elastic_bar", "A linear elastic bar in tension (material points).");
        Options options{.cell_size = 0.1, .safety = 0.484015, .duration = 10.2, .snapshots = {0.0, 10.2}};
        BarOptions bar{.material = {.young_modulus = 1000.0, .poisson_ratio = 0.3, .density = 10.0}};
        const auto setup = [&] { // small strains, no rotation, hence a linear system a step
            Setup made = make_bar(bar, options);
            made.grid.finite_rotation = false;
            return made;
        };
        declare(program, options);
        writes_scene(program, setup);
        declare(program, bar);
        if (!program.parse(argc, argv))
            return 0;

        // 2. scene, 3. run and report
        return run_program(program, options, make_problem(setup(), options));
    });
}
