// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/function_ref.hpp>
#include <ductile/io/checkpoint.hpp>
#include <ductile/io/progress.hpp>
#include <ductile/io/snapshots.hpp>
#include <ductile/io/summary.hpp>

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace ductile::run {

/// Two columns of history.csv that the terminal shows at the end of a run.
struct Curve {
    std::string x = {}, y = {}; ///< no curve if empty
    std::string x_label = {}, y_label = {};
    double y_scale = 1.0;
};

/// Numbers of things that happened in a run, by their names in checkpoints.
using Counters = std::map<std::string, std::int64_t>;

/// A run of either carrier as the loop sees it: a state that steps lead on, and what there is to write of it.
class Simulation {
public:
    virtual ~Simulation() = default;

    [[nodiscard]] virtual double time_s() const = 0;
    [[nodiscard]] virtual std::int64_t step() const = 0;
    /// One step that ends at the last of the output times, the first in the list, at the latest. It calls `output` for each that
    /// it passes before its end, while all that is written is of that time, and `output` takes it from the list. That changes no
    /// bit of the step. A step that is shorter because of the end of the run calls `before_end` before: a longer run that goes on
    /// from there is one that never had that end. Returns whether the state is at the end of the step; otherwise it is as before,
    /// and the next attempt will be another one. Throws RunError when no attempt can succeed.
    [[nodiscard]] virtual bool attempt(const std::vector<double>& output_times_s, FunctionRef<void()> before_end,
                                       FunctionRef<void()> output) = 0;
    /// Takes note of an accepted state for the summary, whichever rows are written; `last`: at the end of the run.
    virtual void observe(bool last) = 0;

    /// Names of the columns of history.csv, with units.
    [[nodiscard]] virtual std::vector<std::string> columns() const = 0;
    /// Appends a value a column to `values`, which is empty.
    virtual void row(std::vector<double>& values) = 0;
    [[nodiscard]] virtual Curve curve() const = 0;
    [[nodiscard]] virtual io::ProgressState progress() const = 0;

    /// Makes the file of snapshots, once, before the first of them.
    virtual io::Snapshots& open_snapshots(const std::filesystem::path& fields, const std::string& program,
                                          const std::optional<io::EarlierSnapshots>& earlier) = 0;
    /// Adds one; `time_s` is the time that was asked for.
    virtual void snapshot(double time_s) = 0;

    /// Puts into a checkpoint what the state, the steps and the summary need to go on, but for counters().
    virtual void describe(io::Checkpoint& content) = 0;
    [[nodiscard]] virtual int checkpoint_format() const = 0;

    /// Since construction, all of them from the start on.
    [[nodiscard]] virtual Counters counters() const = 0;
    /// Fills in results, phases and warnings; `total` is counters() with those of the checkpoint that the run went on from.
    virtual void describe(const Counters& total, io::RunSummary& summary) = 0;
};

} // namespace ductile::run
