#include <ductile/base/error.hpp>
#include <ductile/io/interrupt.hpp>
#include <ductile/quasistatic/accuracy_watch.hpp>
#include <ductile/quasistatic/recorder.hpp>
#include <ductile/quasistatic/run.hpp>
#include <ductile/run/loop.hpp>

#include <algorithm>

namespace ductile::quasistatic {

namespace {

class GridRun final : public run::Simulation {
public:
    GridRun(const Scene& scene, TimeStepper& stepper, StepControl& control, const RunOptions& options, const io::Program& program,
            const io::OutputFolder& folder, const io::CheckpointReader* checkpoint)
        : scene_(scene), stepper_(stepper), control_(control), checkpoint_(checkpoint), watch_(scene), last_(begin()),
          recorder_(scene, options, program, folder, checkpoint, time_s()) {}

    [[nodiscard]] double time_s() const override { return stepper_.state().time * scene_.units.time; }
    [[nodiscard]] std::int64_t step() const override { return stepper_.state().step; }

    [[nodiscard]] run::Attempt attempt(double output_time_s) override {
        const double output_time = output_time_s / scene_.units.time, now = stepper_.state().time;
        const double goal = std::min(output_time, scene_.walls.next_knot(now));
        const StepControl::Step planned = control_.next(now, goal);
        step_ = StepControl::shortened(planned, now, stepper_.limit_step(planned.dt));
        StepAttempt attempt;
        try {
            attempt = stepper_.attempt(step_.dt, step_.end);
        } catch (const RunError&) {
            if (io::interrupted())
                return run::Attempt::refused;
            if (!control_.retry_shorter(step_))
                throw;
            ++rejected_steps_;
            return run::Attempt::refused;
        }
        if (!control_.judge(step_, attempt)) {
            ++rejected_steps_;
            return run::Attempt::refused;
        }
        watch_.judge(attempt, now, step_.dt);
        relaxation_steps_ += step_.limit == StepLimit::relaxation ? 1 : 0;
        stepper_.accept();
        last_ = {step_.dt, attempt.measure};
        return step_.lands && goal == output_time ? run::Attempt::landed : run::Attempt::accepted;
    }

    void observe(bool last) override { watch_.observe(stepper_.state(), last); }
    void row() override { recorder_.row(stepper_.state(), last_); }
    void snapshot(double time_s) override { recorder_.snapshot(stepper_.state(), time_s); }
    [[nodiscard]] bool lacks_snapshot(double time_s) const override { return recorder_.lacks_snapshot(time_s); }
    void progress() override { recorder_.progress(stepper_.state(), step_); }
    void checkpoint(std::int64_t row_step) override {
        std::map<std::string, std::int64_t> total = counters();
        total["row_step"] = row_step;
        recorder_.checkpoint(stepper_, control_, watch_, total, last_);
    }
    void finish() override { recorder_.finish(); }

    void describe(io::RunSummary& summary) override {
        auto total = counters();
        summary.rejected_steps = total["rejected_steps"];
        summary.elliptic_solves = total["elliptic_solves"];
        summary.pointwise_substeps = total["pointwise_substeps"];
        summary.phase_seconds = stepper_.phase_seconds();
        for (const char* name :
             {"rate_evaluations", "inner_steps", "rejected_inner_steps", "rejected_substeps", "steps_limited_by_relaxation"})
            summary.extra[name] = total[name];
        for (const auto& [scheme, steps] : stepper_.steps_by_scheme())
            summary.extra[std::string("steps_by_") + description(scheme).name] = steps;
        summary.extra["simulated_time_s"] = time_s();
        summary.drawing = recorder_.curve();
        for (const std::vector<std::string>& warnings : {recorder_.warnings(), watch_.warnings()})
            summary.warnings.insert(summary.warnings.end(), warnings.begin(), warnings.end());
    }

private:
    LastStep begin() {
        if (!checkpoint_) {
            control_.start(stepper_.time_scale());
            return {};
        }
        restore_hidden(*checkpoint_, stepper_, control_, watch_);
        (void)counters(); // whether they are all there
        return read_last_step(*checkpoint_);
    }

    [[nodiscard]] std::map<std::string, std::int64_t> counters() const {
        const StepperCounts now = stepper_.counts();
        std::map<std::string, std::int64_t> total{{"elliptic_solves", now.elliptic_solves},
                                                  {"rate_evaluations", now.evaluations},
                                                  {"pointwise_substeps", now.pointwise_substeps},
                                                  {"rejected_substeps", now.rejected_substeps},
                                                  {"rejected_steps", rejected_steps_},
                                                  {"steps_limited_by_relaxation", relaxation_steps_},
                                                  {"inner_steps", now.inner_steps},
                                                  {"rejected_inner_steps", now.rejected_inner_steps}};
        for (auto& [name, count] : total)
            count += checkpoint_ ? checkpoint_->counter(name) : 0;
        return total;
    }

    const Scene& scene_;
    TimeStepper& stepper_;
    StepControl& control_;
    const io::CheckpointReader* checkpoint_; // what the run goes on from, or null
    std::int64_t rejected_steps_ = 0, relaxation_steps_ = 0;
    AccuracyWatch watch_;
    LastStep last_;
    Recorder recorder_; // made once the checkpoint is read: a wrong one must leave the files as they are
    StepControl::Step step_;
};

} // namespace

io::RunStatus run(const Scene& scene, TimeStepper& stepper, StepControl& control, const RunOptions& options,
                  const io::Program& program, const io::OutputFolder& folder, const io::CheckpointReader* checkpoint,
                  io::RunSummary& summary) {
    const std::int64_t row_step = run::read_row_step(checkpoint);
    GridRun grid_run(scene, stepper, control, options, program, folder, checkpoint);
    return run::loop(grid_run, io::OutputTimes(options.duration_s, options.snapshots_s),
                     {.history_every = options.history_every, .checkpoint_every_s = program.common().checkpoint_every_s}, folder,
                     row_step, summary);
}

} // namespace ductile::quasistatic
