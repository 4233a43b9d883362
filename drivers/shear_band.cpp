// shear_band: simple shear of a metallic glass until it localises (Lu & Rycroft, Sec. 8).
//
// A square of Vitreloy 1, periodic in x, is sheared between two rigid walls at quasi-static rate. The effective temperature of
// its shear transformation zones starts from a curved pattern; plastic flow heats it where it is soft already, and a band forms.
// 128 x 128 cells to t = 1.4175 s (35e4 t_s) take less than a second:
//
//   ./ductile shear_band --cells 128 --output out/band
#include <ductile/base/threads.hpp>
#include <ductile/io/interrupt.hpp>
#include <ductile/io/output_times.hpp>
#include <ductile/io/program.hpp>
#include <ductile/quasistatic/doubts.hpp>
#include <ductile/quasistatic/options.hpp>

#include <algorithm>
#include <iterator>

using namespace ductile;
using namespace ductile::quasistatic;

int main(int argc, char** argv) {
    return io::run_main([&] {
        // 1. options
        io::Program program("shear_band", "Simple shear of a metallic glass until it localises (quasi-static).");
        Options options;
        declare(program, options);
        if (!program.parse(argc, argv))
            return 0;

        // 2. scene, steps, initial or restored state: all input is checked before anything is written
        const Scene scene = make_scene(options);
        check_meaning(options, scene);
        StepControl control = make_step_control(options, scene);
        const auto checkpoint = program.open_restart(checkpoint_format);
        State state = checkpoint ? read_state(*checkpoint, scene) : initial_state(scene, make_initial_internal(options, scene));

        // 3. time stepper with its elliptic solver
        const RunOptions run_options = make_run_options(options, scene, state.time);
        std::vector<std::string> warnings = doubts(options, scene, state.cells);
        if (!program.has_default("--snapshots"))
            std::ranges::move(io::missing_snapshots(options.duration, options.snapshots), std::back_inserter(warnings));
        const auto stepper = make_time_stepper(options, scene, std::move(state));
        program.say(describe(options, scene, *stepper, thread_count()));

        // 4. run and report
        return program.run(
            [&](const io::OutputFolder& folder, io::RunSummary& summary) {
                return run(scene, *stepper, control, run_options, program, folder, checkpoint ? &*checkpoint : nullptr, summary);
            },
            warnings);
    });
}
