// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/base/threads.hpp>
#include <ductile/io/output_times.hpp>
#include <ductile/quasistatic/checkpoint.hpp>
#include <ductile/quasistatic/doubts.hpp>
#include <ductile/quasistatic/initial_file.hpp>
#include <ductile/quasistatic/program.hpp>
#include <ductile/quasistatic/run.hpp>

#include <algorithm>
#include <fmt/format.h>
#include <iterator>

namespace ductile::quasistatic {

namespace {

/// The state that the options ask for; says and warns of what had to be done to it.
State start(const io::Program& program, const Options& options, const Scene& scene, Space& space,
            std::vector<std::string>& warnings) {
    if (options.initial_file.empty() != (options.initial != InitialChoice::file))
        throw InputError(options.initial_file.empty() ? "--initial file: which? add --initial-file FILE"
                                                      : "--initial-file: it is read with --initial file only");
    if (options.initial != InitialChoice::file) {
        State state = initial_state(scene, space, make_initial_internal(options, scene, space.rows()));
        if (options.initial_stress > 0.0) {
            add_eigenstress(options, scene, space.rows(), state.cells.stress);
            (void)put_into_equilibrium(scene, space, state.cells);
        }
        return state;
    }
    if (options.initial_stress > 0.0)
        throw InputError("--initial-stress: with --initial file the stress comes from the file: leave one of them out");
    FileStart made = start_from_file(scene, space, options.initial_file);
    const std::string file = options.initial_file.string();
    if (made.correction > 0.01)
        warnings.push_back(
            fmt::format("the stress in {} is not in equilibrium on this grid: it was changed by {:.3g} % to be so (root "
                        "mean square): take it from a finer grid, or from this one",
                        file, 100.0 * made.correction));
    else if (made.correction > 0.0)
        program.say(
            fmt::format("initial   stress from {}, changed by {:.3g} % to be in equilibrium\n", file, 100.0 * made.correction));
    return std::move(made.state);
}

} // namespace

int run_program(const io::Program& program, const Options& options) {
    // scene, steps, initial or restored state: all input is checked before anything is written
    if (!options.shear_traction.empty() && !program.has_default("--wall-velocity"))
        throw InputError("--wall-velocity and --shear-traction: walls are sheared by one of them");
    const Scene scene = make_scene(options);
    check_meaning(options, scene);
    StepControl control = make_step_control(options, scene);
    const auto checkpoint = program.open_restart(checkpoint_format);
    std::vector<std::string> warnings;
    auto space = make_space(options, scene);
    State state = checkpoint ? read_state(*checkpoint, scene, *space) : start(program, options, scene, *space, warnings);

    const run::Outputs outputs = make_outputs(options, scene, state.time);
    std::ranges::move(doubts(options, scene, space->observe(state.cells)), std::back_inserter(warnings));
    if (!program.has_default("--snapshots"))
        std::ranges::move(io::missing_snapshots(options.duration, options.snapshots), std::back_inserter(warnings));
    const auto stepper = make_time_stepper(options, scene, std::move(space));
    program.say(describe(options, scene, *stepper, thread_count()));
    return program.run(
        [&](const io::OutputFolder& folder, io::RunSummary& summary) {
            return run(scene, state, *stepper, control, outputs, {program, folder, checkpoint ? &*checkpoint : nullptr}, summary);
        },
        warnings);
}

} // namespace ductile::quasistatic
