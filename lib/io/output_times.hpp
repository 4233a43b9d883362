#pragma once
#include <span>
#include <string>
#include <vector>

namespace ductile::io {

/// The times of a run [s] at which something is written: those of its snapshots, and its end. Times that differ
/// by less than 1e-12 of the end are one, and the end goes before a snapshot.
class OutputTimes {
public:
    /// `snapshots_s` in any order; those beyond the end are left out.
    OutputTimes(double end_s, std::span<const double> snapshots_s);

    /// Whether a time that after() gave, or 0, is that of a snapshot.
    [[nodiscard]] bool is_snapshot(double time_s) const;
    /// Those that are later than a time, the last first.
    [[nodiscard]] std::vector<double> after(double time_s) const;

private:
    [[nodiscard]] bool same(double a, double b) const;

    double end_s_;
    std::vector<double> snapshots_s_; // the last first
};

/// These times, and 0, every, 2 every, ... up to the end; `every` = 0 adds none. Throws InputError for more than a million.
[[nodiscard]] std::vector<double> snapshot_times(std::vector<double> times_s, double every_s, double end_s);

/// A warning where snapshots are asked for beyond the end of a run.
[[nodiscard]] std::vector<std::string> missing_snapshots(double end_s, std::span<const double> snapshots_s);

} // namespace ductile::io
