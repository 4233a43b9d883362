#include <ductile/base/error.hpp>
#include <ductile/io/output_times.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <functional>

namespace ductile::io {

namespace {
bool equal(double a, double b, double end_s) { return std::abs(a - b) <= 1e-12 * end_s; }
} // namespace

OutputTimes::OutputTimes(double end_s, std::span<const double> snapshots_s) : end_s_(end_s) {
    for (const double time : snapshots_s)
        if (const double t = same(time, end_s) ? end_s : time; t <= end_s)
            snapshots_s_.push_back(t);
    std::ranges::sort(snapshots_s_, std::greater<>());
    const auto repeated =
        std::unique(snapshots_s_.begin(), snapshots_s_.end(), [this](double a, double b) { return same(a, b); });
    snapshots_s_.erase(repeated, snapshots_s_.end());
}

bool OutputTimes::same(double a, double b) const { return equal(a, b, end_s_); }

bool OutputTimes::is_snapshot(double time_s) const { return std::ranges::find(snapshots_s_, time_s) != snapshots_s_.end(); }

std::vector<double> OutputTimes::after(double time_s) const {
    std::vector<double> times;
    if (!is_snapshot(end_s_))
        times.push_back(end_s_);
    times.insert(times.end(), snapshots_s_.begin(), snapshots_s_.end());
    std::erase_if(times, [&](double t) { return t < time_s || same(t, time_s); });
    return times;
}

std::vector<double> snapshot_times(std::vector<double> times_s, double every_s, double end_s) {
    if (every_s > 0.0 && !(end_s / every_s <= 1e6))
        throw InputError(fmt::format("--snapshots-every {}: these would be {:.3g} snapshots up to {:g} s: take a longer interval",
                                     every_s, end_s / every_s, end_s));
    for (double k = 0.0; every_s > 0.0 && k * every_s <= end_s * (1.0 + 1e-12); k += 1.0)
        times_s.push_back(k * every_s);
    return times_s;
}

std::vector<std::string> missing_snapshots(double end_s, std::span<const double> snapshots_s) {
    const double last = snapshots_s.empty() ? 0.0 : *std::ranges::max_element(snapshots_s);
    if (last <= end_s || equal(last, end_s, end_s))
        return {};
    return {fmt::format("the snapshot at {:g} s lies beyond the end at {:g} s and will be missing: lengthen --duration", last,
                        end_s)};
}

} // namespace ductile::io
