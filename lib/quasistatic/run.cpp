#include <ductile/base/error.hpp>
#include <ductile/base/timer.hpp>
#include <ductile/io/interrupt.hpp>
#include <ductile/io/output_times.hpp>
#include <ductile/quasistatic/accuracy_watch.hpp>
#include <ductile/quasistatic/recorder.hpp>
#include <ductile/quasistatic/run.hpp>

#include <algorithm>
#include <iterator>

namespace ductile::quasistatic {

io::RunStatus run(const Scene& scene, TimeStepper& stepper, StepControl& control, const RunOptions& options,
                  const io::Program& program, const io::OutputFolder& folder, const io::CheckpointReader* checkpoint,
                  io::RunSummary& summary) {
    const double unit = scene.units.time;
    const double start_s = stepper.state().time * unit;
    const io::OutputTimes times(options.duration_s, options.snapshots_s);
    std::vector<double> output_times = times.after(start_s); // in s: natural units add round-off

    std::int64_t rejected_steps = 0, relaxation_steps = 0;
    LastStep last;
    AccuracyWatch watch(scene);
    if (checkpoint) {
        restore_hidden(*checkpoint, stepper, control, watch);
        last = read_last_step(*checkpoint);
    }
    const auto counters = [&] {
        const StepperCounts now = stepper.counts();
        std::map<std::string, std::int64_t> total{{"elliptic_solves", now.elliptic_solves},
                                                  {"rate_evaluations", now.evaluations},
                                                  {"pointwise_substeps", now.pointwise_substeps},
                                                  {"rejected_substeps", now.rejected_substeps},
                                                  {"rejected_steps", rejected_steps},
                                                  {"steps_limited_by_relaxation", relaxation_steps},
                                                  {"inner_steps", now.inner_steps},
                                                  {"rejected_inner_steps", now.rejected_inner_steps}};
        for (auto& [name, count] : total)
            count += checkpoint ? checkpoint->counter(name) : 0;
        return total;
    };

    Timer wall, since_checkpoint;
    Recorder recorder(scene, options, program, folder, checkpoint, start_s);
    for (const std::string& warning : recorder.warnings())
        summary.warnings.push_back(warning);
    if (checkpoint && folder.continued() && recorder.lacks_snapshot(start_s))
        recorder.snapshot(stepper.state(), start_s);
    if (!checkpoint) {
        control.start(stepper.time_scale());
        if (times.is_snapshot(0.0))
            recorder.snapshot(stepper.state(), 0.0);
        recorder.row(stepper.state(), last);
    }
    double output_seconds = 0.0;
    const auto describe_run = [&] {
        auto total = counters();
        summary.steps = stepper.state().step;
        summary.rejected_steps = total["rejected_steps"];
        summary.elliptic_solves = total["elliptic_solves"];
        summary.pointwise_substeps = total["pointwise_substeps"];
        summary.wall_seconds = wall.seconds();
        summary.phase_seconds = stepper.phase_seconds();
        summary.phase_seconds.emplace_back("output", output_seconds);
        summary.extra["rate_evaluations"] = total["rate_evaluations"];
        summary.extra["inner_steps"] = total["inner_steps"];
        summary.extra["rejected_inner_steps"] = total["rejected_inner_steps"];
        summary.extra["rejected_substeps"] = total["rejected_substeps"];
        summary.extra["steps_limited_by_relaxation"] = total["steps_limited_by_relaxation"];
        for (const auto& [scheme, steps] : stepper.steps_by_scheme())
            summary.extra[std::string("steps_by_") + description(scheme).name] = steps;
        summary.extra["simulated_time_s"] = stepper.state().time * unit;
        summary.drawing = recorder.curve();
        std::ranges::move(watch.warnings(), std::back_inserter(summary.warnings));
    };

    const bool at_end = output_times.empty();
    try {
        while (!output_times.empty()) {
            if (io::interrupted()) {
                recorder.checkpoint(stepper, control, watch, counters(), last);
                recorder.finish();
                describe_run();
                return io::RunStatus::interrupted;
            }
            const double knot = scene.walls.next_knot(stepper.state().time);
            const double output_time = output_times.back() / unit;
            const double goal = std::min(output_time, knot);
            const double now = stepper.state().time;
            const StepControl::Step planned = control.next(now, goal);
            const StepControl::Step step = StepControl::shortened(planned, now, stepper.limit_step(planned.dt));
            StepAttempt attempt;
            try {
                attempt = stepper.attempt(step.dt, step.end);
            } catch (const RunError&) {
                if (io::interrupted())
                    continue;
                if (!control.retry_shorter(step))
                    throw;
                ++rejected_steps;
                continue;
            }
            if (!control.judge(step, attempt)) {
                ++rejected_steps;
                continue;
            }
            watch.judge(attempt, now, step.dt);
            relaxation_steps += step.limit == StepLimit::relaxation ? 1 : 0;
            stepper.accept();
            last = {step.dt, attempt.measure};

            Timer output;
            if (stepper.state().step % options.history_every == 0)
                recorder.row(stepper.state(), last);
            watch.observe(stepper.state(), output_times.size() == 1 && step.lands);
            recorder.progress(stepper.state(), step);
            if (step.lands && goal == output_time) {
                if (times.is_snapshot(output_times.back()))
                    recorder.snapshot(stepper.state(), output_times.back());
                output_times.pop_back();
            }
            if (since_checkpoint.seconds() > program.common().checkpoint_every_s) {
                recorder.checkpoint(stepper, control, watch, counters(), last);
                since_checkpoint.lap();
            }
            output_seconds += output.seconds();
        }
        if (!at_end)
            recorder.checkpoint(stepper, control, watch, counters(), last);
        // after the checkpoint: a longer run that goes on from there will not have it
        recorder.last_row(stepper.state(), last);
    } catch (const Error& failure) {
        const RunError advised = io::with_checkpoint(failure, folder.checkpoint(),
                                                     [&] { recorder.checkpoint(stepper, control, watch, counters(), last); });
        recorder.finish_quietly();
        try {
            describe_run();
        } catch (const Error&) {
            // the history cannot be read back: its curve is missing
        }
        throw advised;
    }
    recorder.finish();
    describe_run();
    return io::RunStatus::completed;
}

} // namespace ductile::quasistatic
