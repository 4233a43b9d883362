// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/base/timer.hpp>
#include <ductile/io/interrupt.hpp>
#include <ductile/io/output_times.hpp>
#include <ductile/run/loop.hpp>

namespace ductile::run {

io::RunStatus loop(Simulation& simulation, const Outputs& outputs, const Files& files, io::RunSummary& summary) {
    const Timer wall;
    Timer since_checkpoint;
    double output_seconds = 0.0;
    const io::OutputTimes times(outputs.duration_s, outputs.snapshots_s, outputs.rows_s);
    Recorder recorder(simulation, outputs, files);
    const auto end = [&] {
        summary.steps = simulation.step();
        summary.wall_seconds = wall.seconds();
        recorder.describe(summary);
        summary.phase_seconds.emplace_back("output", output_seconds);
    };

    const double start_s = simulation.time_s();
    if (!files.checkpoint) {
        if (times.is_snapshot(start_s))
            recorder.snapshot(start_s);
        recorder.row();
    } else if (files.folder.continued() && recorder.lacks_snapshot(start_s)) {
        recorder.snapshot(start_s);
    }
    std::vector<double> output_times = times.after(start_s);
    const bool at_end = output_times.empty();
    bool checkpoint_is_last = false; // what follows depends on the end of this run
    try {
        while (!output_times.empty()) {
            if (io::interrupted()) {
                recorder.checkpoint();
                recorder.finish();
                end();
                return io::RunStatus::interrupted;
            }
            const auto before_end = [&] {
                if (checkpoint_is_last)
                    return;
                const Timer output;
                recorder.checkpoint();
                checkpoint_is_last = true;
                output_seconds += output.seconds();
            };
            const auto write_output = [&] {
                const Timer output;
                const double time_s = output_times.back();
                if (times.is_snapshot(time_s))
                    recorder.snapshot(time_s);
                if (times.is_row(time_s))
                    recorder.row();
                output_times.pop_back();
                output_seconds += output.seconds();
            };
            if (!simulation.attempt(output_times, before_end, write_output))
                continue;
            Timer output;
            simulation.observe(times.reached(output_times.front(), simulation.time_s()));
            if (outputs.rows_s.empty() && simulation.step() % outputs.history_every == 0)
                recorder.row();
            recorder.progress();
            output_seconds += output.lap();
            while (!output_times.empty() && times.reached(output_times.back(), simulation.time_s()))
                write_output();
            output.lap();
            if (!checkpoint_is_last && since_checkpoint.seconds() > files.program.common().checkpoint_every_s) {
                recorder.checkpoint();
                since_checkpoint.lap();
            }
            output_seconds += output.seconds();
        }
        if (!at_end && !checkpoint_is_last)
            recorder.checkpoint();
        // after the checkpoint: a longer run that goes on from there will not have it
        if (recorder.row_step() != simulation.step())
            recorder.row();
    } catch (const Error& failure) {
        const RunError advised = io::with_checkpoint(failure, files.folder.checkpoint(), [&] { recorder.checkpoint(); });
        try {
            recorder.finish();
        } catch (const Error&) {
            // the failure that ended the run is the one to tell; what cannot be finished stays behind in its partial form
        }
        try {
            end();
        } catch (const Error&) {
            // the history cannot be read back: its curve is missing
        }
        throw advised;
    }
    recorder.finish();
    end();
    return io::RunStatus::completed;
}

} // namespace ductile::run
