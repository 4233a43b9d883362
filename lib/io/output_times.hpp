// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ductile::io {

/// The times of a run [s] at which something is written: those of its snapshots, of rows of its history that do not follow its
/// steps, and its end. Times that differ by less than 1e-12 of the end are one, and the end goes before all others.
class OutputTimes {
public:
    /// In any order; those beyond the end are left out.
    OutputTimes(double end_s, std::span<const double> snapshots_s, std::span<const double> rows_s);

    /// Whether a time that after() gave, or 0, is that of a snapshot, or of a row.
    [[nodiscard]] bool is_snapshot(double time_s) const { return is_among(snapshots_s_, time_s); }
    [[nodiscard]] bool is_row(double time_s) const { return is_among(rows_s_, time_s); }
    /// Whether a time that after() gave is not after this one.
    [[nodiscard]] bool reached(double output_s, double time_s) const { return output_s <= time_s || same(output_s, time_s); }
    /// Those that are later than a time, the last first.
    [[nodiscard]] std::vector<double> after(double time_s) const;

private:
    [[nodiscard]] bool same(double a, double b) const;
    [[nodiscard]] bool is_among(const std::vector<double>& times_s, double time_s) const;
    void merge(std::vector<double>& times_s) const;

    double end_s_;
    std::vector<double> snapshots_s_, rows_s_, all_s_; // the last first
};

/// These times, and 0, every, 2 every, ... up to the end; `every` = 0 adds none. Throws InputError, which names the option that
/// says `every`, for more than a million.
[[nodiscard]] std::vector<double> regular_times(std::string_view option, std::vector<double> times_s, double every_s,
                                                double end_s);

/// Of snapshots that nobody has asked for, those before the end of a run, and the end; none where there are none.
[[nodiscard]] std::vector<double> snapshots_of_run(double end_s, std::vector<double> default_s);

/// A warning where snapshots are asked for beyond the end of a run.
[[nodiscard]] std::vector<std::string> missing_snapshots(double end_s, std::span<const double> snapshots_s);

} // namespace ductile::io
