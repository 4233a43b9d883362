// SPDX-License-Identifier: GPL-3.0-or-later
// shear_band: simple shear of a metallic glass until it localises (Lu & Rycroft, Sec. 8).
//
// A square of Vitreloy 1, periodic in x, is sheared between two rigid walls at quasi-static rate. The effective temperature of
// its shear transformation zones starts from a curved pattern; plastic flow heats it where it is soft already, and a band forms.
// 128 x 128 cells to t = 1.4175 s (35e4 t_s) take less than a second:
//
//   ./ductile shear_band --cells 128 --output out/band
#include <ductile/quasistatic/program.hpp>

using namespace ductile;
using namespace ductile::quasistatic;

int main(int argc, char** argv) {
    return io::run_main([&] {
        // 1. options
        io::Program program("shear_band", "Simple shear of a metallic glass until it localises (quasi-static).");
        Options options;
        declare(program, options);
        program.writes_scene("grid", {});
        if (!program.parse(argc, argv))
            return 0;

        // 2. scene, 3. run and report
        return run_program(program, options);
    });
}
