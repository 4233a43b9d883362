#include <ductile/base/error.hpp>
#include <ductile/base/timer.hpp>
#include <ductile/io/interrupt.hpp>
#include <ductile/run/loop.hpp>

#include <vector>

namespace ductile::run {

std::int64_t read_row_step(const io::CheckpointReader* checkpoint) { return checkpoint ? checkpoint->counter("row_step") : -1; }

io::RunStatus loop(Simulation& simulation, const io::OutputTimes& times, const LoopOptions& options,
                   const io::OutputFolder& folder, std::int64_t row_step, io::RunSummary& summary) {
    const Timer wall;
    Timer since_checkpoint;
    double output_seconds = 0.0;
    const auto write_row = [&] {
        simulation.row();
        row_step = simulation.step();
    };
    const auto end = [&] {
        simulation.describe(summary);
        summary.steps = simulation.step();
        summary.wall_seconds = wall.seconds();
        summary.phase_seconds.emplace_back("output", output_seconds);
    };

    const double start_s = simulation.time_s();
    if (row_step < 0) {
        if (times.is_snapshot(start_s))
            simulation.snapshot(start_s);
        write_row();
    } else if (folder.continued() && simulation.lacks_snapshot(start_s)) {
        simulation.snapshot(start_s);
    }
    std::vector<double> output_times = times.after(start_s);
    const bool at_end = output_times.empty();
    try {
        while (!output_times.empty()) {
            if (io::interrupted()) {
                simulation.checkpoint(row_step);
                simulation.finish();
                end();
                return io::RunStatus::interrupted;
            }
            const Attempt attempt = simulation.attempt(output_times.back());
            if (attempt == Attempt::refused)
                continue;
            Timer output;
            const bool landed = attempt == Attempt::landed;
            simulation.observe(landed && output_times.size() == 1);
            if (simulation.step() % options.history_every == 0)
                write_row();
            simulation.progress();
            if (landed) {
                if (times.is_snapshot(output_times.back()))
                    simulation.snapshot(output_times.back());
                output_times.pop_back();
            }
            if (since_checkpoint.seconds() > options.checkpoint_every_s) {
                simulation.checkpoint(row_step);
                since_checkpoint.lap();
            }
            output_seconds += output.seconds();
        }
        if (!at_end)
            simulation.checkpoint(row_step);
        // after the checkpoint: a longer run that goes on from there will not have it
        if (row_step != simulation.step())
            write_row();
    } catch (const Error& failure) {
        const RunError advised = io::with_checkpoint(failure, folder.checkpoint(), [&] { simulation.checkpoint(row_step); });
        try {
            simulation.finish();
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
    simulation.finish();
    end();
    return io::RunStatus::completed;
}

} // namespace ductile::run
