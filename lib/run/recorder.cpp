// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/io/terminal_plot.hpp>
#include <ductile/run/recorder.hpp>

namespace ductile::run {

namespace {

std::int64_t last_row(const Simulation& simulation, const io::CheckpointReader* checkpoint) {
    if (!checkpoint)
        return -1;
    for (const auto& [name, count] : simulation.counters())
        (void)checkpoint->counter(name);
    return checkpoint->counter("row_step");
}

std::optional<io::EarlierSnapshots> earlier_snapshots(const Simulation& simulation, const Files& files) {
    if (!files.checkpoint)
        return std::nullopt;
    // a snapshot's time is the one asked for, which may differ from the state's by round-off
    return files.checkpoint->snapshots(files.folder, simulation.time_s() * (1.0 + 1e-12));
}

} // namespace

Recorder::Recorder(Simulation& simulation, const Outputs& outputs, const Files& files)
    : simulation_(simulation), outputs_(outputs), files_(files), row_step_(last_row(simulation, files.checkpoint)),
      snapshots_(simulation.open_snapshots(files.folder.fields(), files.program.name(), earlier_snapshots(simulation, files))),
      history_(files.folder.history(), simulation.columns(),
               files.checkpoint ? std::optional(files.checkpoint->history()) : std::nullopt),
      progress_({.duration_s = outputs.duration_s, .start_s = simulation.time_s(), .quiet = files.program.common().quiet}) {}

void Recorder::row() {
    values_.clear();
    simulation_.row(values_);
    history_.append(values_);
    row_step_ = simulation_.step();
}

Counters Recorder::total() const {
    Counters total = simulation_.counters();
    if (files_.checkpoint)
        for (auto& [name, count] : total)
            count += files_.checkpoint->counter(name);
    return total;
}

void Recorder::checkpoint() {
    io::Checkpoint content{.program = files_.program.name(),
                           .format = simulation_.checkpoint_format(),
                           .config = files_.program.config_text(),
                           .counters = total()};
    content.counters["row_step"] = row_step_;
    simulation_.describe(content);
    content.snapshots = snapshots_.times().size();
    content.history = history_.mark();
    io::write_checkpoint(files_.folder.checkpoint(), content);
}

void Recorder::finish() {
    progress_.finish();
    history_.finish();
    snapshots_.finish();
}

std::string Recorder::curve() {
    const Curve curve = simulation_.curve();
    if (curve.x.empty())
        return {};
    const io::HistoryTable history = history_.read({curve.x, curve.y});
    std::vector<double> y = history.column(curve.y);
    for (double& value : y)
        value *= curve.y_scale;
    return io::terminal_plot(history.column(curve.x), y, {.x_label = curve.x_label, .y_label = curve.y_label});
}

void Recorder::describe(io::RunSummary& summary) {
    for (const std::string& warning : {snapshots_.warning(), history_.warning()})
        if (!warning.empty())
            summary.warnings.push_back(warning);
    simulation_.describe(total(), summary);
    summary.drawing = curve();
}

} // namespace ductile::run
