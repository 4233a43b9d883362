// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/base/threads.hpp>
#include <ductile/io/output_times.hpp>
#include <ductile/quasistatic/checkpoint.hpp>
#include <ductile/quasistatic/doubts.hpp>
#include <ductile/quasistatic/initial_file.hpp>
#include <ductile/quasistatic/program.hpp>
#include <ductile/quasistatic/projection.hpp>
#include <ductile/quasistatic/resolution.hpp>
#include <ductile/quasistatic/run.hpp>

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

namespace ductile::quasistatic {

namespace {

/// The state that the options ask for, and what had to be done to it.
struct Start {
    State state;
    std::string said = {}, warning = {};
};

Start start_on(const Options& options, const Scene& scene, Space& space) {
    if (options.initial_file.empty() != (options.initial != InitialChoice::file))
        throw InputError(options.initial_file.empty() ? "--initial file: which? add --initial-file FILE"
                                                      : "--initial-file: it is read with --initial file only");
    if (options.initial != InitialChoice::file) {
        State state = initial_state(scene, space, make_initial_internal(options, scene, space.rows()));
        if (options.initial_stress > 0.0) {
            add_eigenstress(options, scene, space.rows(), state.cells.stress);
            (void)put_into_equilibrium(scene, space, 0.0, state.cells);
            state.cells.energy = {}; // it starts from there
        }
        return {std::move(state)};
    }
    if (options.initial_stress > 0.0)
        throw InputError("--initial-stress: with --initial file the stress comes from the file: leave one of them out");
    FileStart made = start_from_file(scene, space, options.initial_file);
    const std::string file = options.initial_file.string();
    Start begun{std::move(made.state)};
    if (made.correction > 0.01)
        begun.warning =
            fmt::format("the stress in {} is not in equilibrium on this grid: it was changed by {:.3g} % to be so (root "
                        "mean square): take it from a finer grid, or from this one",
                        file, 100.0 * made.correction);
    else if (made.correction > 0.0)
        begun.said =
            fmt::format("initial   stress from {}, changed by {:.3g} % to be in equilibrium\n", file, 100.0 * made.correction);
    return begun;
}

/// On edges that suit it, where edges may move.
Start start(const Options& options, const Scene& scene, Space& space) {
    constexpr int most_rounds = 20; // what is rough on every scale never has edges that suit it
    Start made = start_on(options, scene, space);
    for (int round = 0; round < most_rounds; ++round) {
        const std::vector<double> edges = space.better_edges(made.state.cells);
        if (edges.empty())
            break;
        space.move_edges(edges, {});
        made = start_on(options, scene, space);
    }
    return made;
}

EndState end_of(const Options& options, const Scene& scene, Space& space, const State& state) {
    return {scene, space, state, largest_wall_speed(options, scene) / scene.units.velocity()};
}

/// Sets the options that --accuracy finds. Given beside it, or by a stronger source, they contradict it; it goes before what a
/// weaker one says, so that it serves scenes whose files have cells and a tolerance.
Resolution find_resolution(const io::Program& program, Options& options) {
    const std::string accuracy = fmt::format("--accuracy {:g}", options.accuracy);
    std::vector<std::string> overruled;
    for (const std::string key : {"--cells", "--tolerance", "--element-edges", "--space", "--adapt-elements"}) {
        if ((key == "--space" && options.space.kind == SpaceKind::elements) ||
            (key == "--adapt-elements" && options.space.elements.adapt))
            continue;
        const io::Source source = program.source(key);
        const bool differs = !program.has_default(key);
        if (source == io::Source::command_line || (differs && source <= program.source("--accuracy")))
            throw InputError(fmt::format("{} and {}: the one finds the other: leave one of them out", accuracy, key));
        if (differs)
            overruled.push_back(key);
    }
    if (options.step == StepChoice::fixed || scheme_named(options.scheme).kind == SchemeKind::projection)
        throw InputError(fmt::format("{}: --scheme {} with {} steps knows no error: take --scheme auto", accuracy, options.scheme,
                                     options.step == StepChoice::fixed ? "fixed" : "such"));
    options.element_edges.clear();
    if (!overruled.empty())
        program.say(fmt::format("accuracy  goes before what the file says of {}\n", fmt::join(overruled, ", ")));
    return {options,
            [&](const Options& tried) {
                const Scene scene = make_scene(tried);
                check_meaning(tried, scene);
                StepControl control = make_step_control(tried, scene);
                auto space = make_space(tried, scene);
                State state = start(tried, scene, *space).state;
                const auto stepper = make_time_stepper(tried, scene, std::move(space));
                advance(scene, state, *stepper, control, tried.duration);
                return end_of(tried, scene, stepper->space(), state);
            },
            [&](const std::string& text) { program.say(text); }};
}

/// Of a run with --accuracy.
void report(const Options& options, const EndErrors& errors, io::RunSummary& summary) {
    summary.extra["estimated_error_stress"] = errors.stress;
    summary.extra["estimated_error_internal"] = errors.internal;
    summary.extra["estimated_error_velocity"] = errors.velocity;
    summary.extra["estimated_error_traction"] = errors.traction;
    if (const std::string missed = missed_accuracy(errors, options.accuracy); !missed.empty())
        summary.warnings.push_back(missed);
}

} // namespace

int run_program(const io::Program& program, Options& options) {
    // scene, steps, initial or restored state: all input is checked before anything is written
    if (!options.shear_traction.empty() && !program.has_default("--wall-velocity"))
        throw InputError("--wall-velocity and --shear-traction: walls are sheared by one of them");
    const auto checkpoint = program.open_restart(checkpoint_format);
    std::optional<Resolution> resolution;
    if (options.accuracy > 0.0 && !checkpoint)
        resolution = find_resolution(program, options);
    const Scene scene = make_scene(options);
    check_meaning(options, scene);
    StepControl control = make_step_control(options, scene);
    std::vector<std::string> warnings;
    if (options.accuracy > 0.0 && checkpoint)
        warnings.emplace_back("--accuracy: the error of a run that goes on from a checkpoint is not estimated");
    auto space = make_space(options, scene);
    Start begun = checkpoint ? Start{read_state(*checkpoint, scene, *space)} : start(options, scene, *space);
    if (!begun.said.empty())
        program.say(begun.said);
    if (!begun.warning.empty())
        warnings.push_back(begun.warning);
    State& state = begun.state;

    Options shown = options;
    if (program.has_default("--snapshots"))
        shown.snapshots = io::snapshots_of_run(options.duration, options.snapshots);
    const run::Outputs outputs = make_outputs(shown, scene, state.time);
    std::ranges::move(doubts(options, scene, space->observe(state.cells)), std::back_inserter(warnings));
    std::ranges::move(io::missing_snapshots(options.duration, shown.snapshots), std::back_inserter(warnings));
    const auto stepper = make_time_stepper(options, scene, std::move(space));
    program.say(describe(options, scene, *stepper, thread_count()));
    return program.run(
        [&](const io::OutputFolder& folder, io::RunSummary& summary) {
            const io::RunStatus status =
                run(scene, state, *stepper, control, outputs, {program, folder, checkpoint ? &*checkpoint : nullptr}, summary);
            if (resolution && status == io::RunStatus::completed)
                report(options, resolution->errors(end_of(options, scene, stepper->space(), state)), summary);
            return status;
        },
        warnings);
}

} // namespace ductile::quasistatic
