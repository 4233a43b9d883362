#include <ductile/base/error.hpp>
#include <ductile/base/timer.hpp>
#include <ductile/io/interrupt.hpp>
#include <ductile/mpm/recorder.hpp>
#include <ductile/mpm/run.hpp>

#include <algorithm>
#include <fmt/format.h>
#include <functional>
#include <string_view>

namespace ductile::mpm {

io::RunStatus run(const Problem& problem, State& state, TimeStepper& stepper, StepControl& control, const RunOptions& options,
                  const io::Program& program, const io::OutputFolder& folder, const io::CheckpointReader* checkpoint,
                  io::RunSummary& summary) {
    std::vector<double> snapshots; // times still to come
    for (const double time : options.snapshots_s)
        if (time > state.time || (time == 0.0 && !checkpoint))
            snapshots.push_back(time);
    std::sort(snapshots.begin(), snapshots.end(), std::greater<>());

    std::int64_t failures[5] = {}; // by StepFailure
    std::int64_t steps_cut_by_rigid_travel = 0, steps_ended_at_contact = 0, steps_with_many_newton_iterations = 0;
    const auto counters = [&] {
        const SolverCounts now = stepper.counts();
        std::map<std::string, std::int64_t> total{{"newton_iterations", now.newton_iterations},
                                                  {"linear_iterations", now.linear_iterations},
                                                  {"residual_evaluations", now.residual_evaluations},
                                                  {"jacobian_products", now.jacobian_products},
                                                  {"backtracks", now.backtracks},
                                                  {"rejected_without_convergence", failures[1]},
                                                  {"rejected_with_folded_grid", failures[2]},
                                                  {"rejected_with_far_particle", failures[3]},
                                                  {"rejected_with_leaving_particle", failures[4]},
                                                  {"steps_cut_by_rigid_travel", steps_cut_by_rigid_travel},
                                                  {"steps_ended_at_contact", steps_ended_at_contact},
                                                  {"steps_with_many_newton_iterations", steps_with_many_newton_iterations}};
        for (auto& [name, count] : total)
            count += checkpoint ? checkpoint->counter(name) : 0;
        return total;
    };
    if (checkpoint)
        control.restore({.next = checkpoint->scalar("planned_dt"),
                         .shortened = static_cast<StepControl::Shortened>(checkpoint->counter("shortened")),
                         .touching = checkpoint->integer_vector("touching")});

    Timer wall, since_checkpoint;
    Recorder recorder(problem, options, program, folder, checkpoint, state.time);
    for (const std::string& warning : recorder.warnings())
        summary.warnings.push_back(warning);
    double output_seconds = 0.0;
    const auto take_snapshots = [&] {
        if (snapshots.empty() || snapshots.back() > state.time)
            return;
        while (!snapshots.empty() && snapshots.back() <= state.time)
            snapshots.pop_back();
        recorder.snapshot(state);
    };
    take_snapshots();
    if (checkpoint && folder.continued() && recorder.lacks_snapshot(state.time))
        recorder.snapshot(state);
    const auto describe_run = [&] {
        auto total = counters();
        summary.steps = state.step;
        summary.rejected_steps = 0;
        for (const char* name : {"rejected_without_convergence", "rejected_with_folded_grid", "rejected_with_far_particle",
                                 "rejected_with_leaving_particle", "steps_cut_by_rigid_travel", "steps_ended_at_contact",
                                 "steps_with_many_newton_iterations"}) {
            summary.rejected_steps += std::string_view(name).starts_with("rejected") ? total[name] : 0;
            if (total[name] > 0)
                summary.extra[name] = total[name];
        }
        summary.newton_iterations = total["newton_iterations"];
        summary.linear_iterations = total["linear_iterations"];
        summary.residual_evaluations = total["residual_evaluations"];
        summary.jacobian_products = total["jacobian_products"];
        summary.wall_seconds = wall.seconds();
        summary.phase_seconds = stepper.phase_seconds();
        summary.phase_seconds.emplace_back("output", output_seconds);
        summary.extra["shortened_newton_steps"] = total["backtracks"];
        summary.extra["simulated_time_s"] = state.time;
        summary.extra["particles"] = state.particles.size();
        if (const io::HistoryTable history = recorder.history(); history.rows() > 0) {
            const std::vector<double> empty = history.column("enclosed_empty_cells");
            if (const double most = *std::max_element(empty.begin(), empty.end()); most > 0.0)
                summary.extra["most_enclosed_empty_cells"] = most; // numerical fracture: worth a line
            if (problem.conclude)
                problem.conclude(history, summary.extra);
        }
        summary.drawing = recorder.curve();
    };

    StepControl::Step step;
    StepOutcome outcome;
    std::vector<std::int64_t> touching(state.rigid_bodies.size(), 0);
    try {
        // a sum of steps that is short of the end by round-off has reached it
        while (state.time < options.duration_s - 1e-9 * control.options().target) {
            if (io::interrupted()) {
                recorder.checkpoint(state, control, counters());
                recorder.finish();
                describe_run();
                return io::RunStatus::interrupted;
            }
            step = control.next(state);
            outcome = stepper.attempt(state, step.dt);
            if (!outcome.accepted) {
                ++failures[static_cast<int>(outcome.failure)];
                if (!control.failed(step))
                    throw RunError(fmt::format("step {} at t = {:.6g} s failed even with dt = {:.3g} s: {}", state.step + 1,
                                               state.time, step.dt, outcome.reason));
                continue;
            }
            if (control.options().ends_at_contact) {
                std::fill(touching.begin(), touching.end(), 0);
                for (const std::int32_t body : stepper.discretisation().nodes().rigid_body)
                    if (body >= 0)
                        touching[static_cast<std::size_t>(body)] = 1;
            }
            control.accepted(step, outcome.newton_iterations, touching);
            steps_cut_by_rigid_travel += step.limit == "rigid travel" ? 1 : 0;
            steps_ended_at_contact += step.limit == "contact" ? 1 : 0;
            steps_with_many_newton_iterations += outcome.newton_iterations > control.options().many_newton_iterations ? 1 : 0;

            Timer output;
            if (state.step % options.history_every == 0)
                recorder.row(state, stepper, step.dt, outcome);
            recorder.progress(state, step);
            take_snapshots();
            if (since_checkpoint.seconds() > program.common().checkpoint_every_s) {
                recorder.checkpoint(state, control, counters());
                since_checkpoint.lap();
            }
            output_seconds += output.seconds();
        }
        recorder.checkpoint(state, control, counters());
        // the row of the end, where it is not an n-th one: a continued run will not have it
        if (state.step % options.history_every != 0)
            recorder.row(state, stepper, step.dt, outcome);
    } catch (const Error& failure) {
        const RunError advised =
            io::with_checkpoint(failure, folder.checkpoint(), [&] { recorder.checkpoint(state, control, counters()); });
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

} // namespace ductile::mpm
