#include <ductile/base/error.hpp>
#include <ductile/base/timer.hpp>
#include <ductile/io/interrupt.hpp>
#include <ductile/io/output_times.hpp>
#include <ductile/mpm/contact_force.hpp>
#include <ductile/mpm/recorder.hpp>
#include <ductile/mpm/run.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <string_view>

namespace ductile::mpm {

namespace {

/// Of the particles on each rigid body at the start.
std::vector<std::array<double, 2>> contact_forces_at_start(const Problem& problem) {
    const auto discretisation = make_discretisation(problem.scene);
    Particles particles = problem.start.particles; // may be sorted
    discretisation->prepare(particles, problem.start.rigid_bodies);
    std::vector<double> force(discretisation->nodes().components()), external(force.size());
    discretisation->internal_force(particles, force);
    discretisation->body_force(particles, problem.start.time, external);
    for (std::size_t c = 0; c < force.size(); ++c)
        force[c] += external[c];
    std::vector<std::array<double, 2>> forces;
    for (std::size_t b = 0; b < problem.start.rigid_bodies.size(); ++b)
        forces.push_back(contact_force(discretisation->nodes(), force, static_cast<std::int32_t>(b)));
    return forces;
}

} // namespace

io::RunStatus run(const Problem& problem, State& state, TimeStepper& stepper, StepControl& control, const RunOptions& options,
                  const io::Program& program, const io::OutputFolder& folder, const io::CheckpointReader* checkpoint,
                  io::RunSummary& summary) {
    check(problem.scene, state.particles, state.rigid_bodies, state.time);
    for (const RigidBody& body : state.rigid_bodies) {
        const double speed = std::max(std::abs(body.velocity_x), std::abs(body.velocity_y));
        const double cells = speed * (options.duration_s - state.time) / problem.scene.grid.smallest_spacing();
        if (cells > 1e9)
            throw InputError(
                fmt::format("the rigid body '{}' would cross {:.3g} cells of the grid in the run, one or less a step: its "
                            "speed of {:.3g} m/s or the duration of {:.3g} s is out of all proportion",
                            body.name, cells, speed, options.duration_s));
    }
    const io::OutputTimes times(options.duration_s, options.snapshots_s);
    std::vector<double> output_times = times.after(state.time);
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
                         .rest = checkpoint->scalar("rest_of_step"),
                         .shortened = static_cast<StepControl::Shortened>(checkpoint->counter("shortened")),
                         .touching = checkpoint->integer_vector("touching")});

    Timer wall, since_checkpoint;
    Recorder recorder(problem, options, program, folder, checkpoint, state.time);
    for (const std::string& warning : recorder.warnings())
        summary.warnings.push_back(warning);
    double output_seconds = 0.0;

    // what summary numbers need, of every step
    const Monitor monitor(problem.scene, options.monitor);
    LastStep last{.contact_forces = contact_forces_at_start(problem)};
    Tally tally;
    const auto observe = [&](const State& seen_state) {
        const Observation seen{seen_state, last.dt, last.contact_forces};
        monitor.observe(seen, last.outcome.smallest_determinant, tally);
        if (problem.conclusions.observe)
            problem.conclusions.observe(seen, tally);
    };
    observe(problem.start);
    if (checkpoint) {
        last = read_last_step(*checkpoint, state.rigid_bodies.size());
        for (auto& [name, numbers] : tally)
            numbers = checkpoint->vector(fmt::format("tally/{}", name));
        if (folder.continued() && recorder.lacks_snapshot(state.time))
            recorder.snapshot(state);
    } else {
        if (times.is_snapshot(state.time))
            recorder.snapshot(state);
        recorder.row(state, last);
    }
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
        const Observation seen{state, last.dt, last.contact_forces};
        monitor.conclude(seen, tally, summary);
        if (problem.conclusions.conclude)
            problem.conclusions.conclude(seen, tally, summary.extra);
        summary.drawing = recorder.curve();
    };

    const bool at_end = output_times.empty();
    std::vector<std::int64_t> touching(state.rigid_bodies.size(), 0);
    try {
        while (!output_times.empty()) {
            if (io::interrupted()) {
                recorder.checkpoint(state, control, tally, counters(), last);
                recorder.finish();
                describe_run();
                return io::RunStatus::interrupted;
            }
            const StepControl::Step step = control.next(state, output_times.back());
            if (!(state.time + step.dt > state.time))
                throw RunError(
                    fmt::format("step {} at t = {:.6g} s would be {:.3g} s long ({}), too short to change the time: look for "
                                "a speed or a length that is out of all proportion",
                                state.step + 1, state.time, step.dt, step.limit));
            StepOutcome outcome = stepper.attempt(state, step.dt);
            if (!outcome.accepted) {
                ++failures[static_cast<int>(outcome.failure)];
                if (!control.failed(step))
                    throw RunError(fmt::format("step {} at t = {:.6g} s failed even with dt = {:.3g} s: {}", state.step + 1,
                                               state.time, step.dt, outcome.reason));
                continue;
            }
            if (control.options().ends_at_contact) {
                std::fill(touching.begin(), touching.end(), 0);
                for (const Hold& hold : stepper.discretisation().nodes().holds)
                    if (hold.holder >= 0)
                        touching[static_cast<std::size_t>(hold.holder)] = 1;
            }
            control.accepted(step, outcome.newton_iterations, touching);
            steps_cut_by_rigid_travel += step.limit == "rigid travel" ? 1 : 0;
            steps_ended_at_contact += step.limit == "contact" ? 1 : 0;
            steps_with_many_newton_iterations += outcome.newton_iterations > control.options().many_newton_iterations ? 1 : 0;

            if (step.lands)
                state.time = output_times.back();
            last.dt = step.dt;
            last.outcome = std::move(outcome);
            Timer output;
            const std::span<const double> force = stepper.force();
            for (std::size_t b = 0; b < last.contact_forces.size(); ++b)
                last.contact_forces[b] = contact_force(stepper.discretisation().nodes(), force, static_cast<std::int32_t>(b));
            observe(state);
            if (state.step % options.history_every == 0)
                recorder.row(state, last);
            recorder.progress(state, step);
            if (step.lands) {
                if (times.is_snapshot(state.time))
                    recorder.snapshot(state);
                output_times.pop_back();
            }
            if (since_checkpoint.seconds() > program.common().checkpoint_every_s) {
                recorder.checkpoint(state, control, tally, counters(), last);
                since_checkpoint.lap();
            }
            output_seconds += output.seconds();
        }
        if (!at_end)
            recorder.checkpoint(state, control, tally, counters(), last);
        // after the checkpoint: a longer run that goes on from there will not have it
        recorder.last_row(state, last);
    } catch (const Error& failure) {
        const RunError advised = io::with_checkpoint(failure, folder.checkpoint(),
                                                     [&] { recorder.checkpoint(state, control, tally, counters(), last); });
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
