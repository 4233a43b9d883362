// SPDX-License-Identifier: GPL-3.0-or-later
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

OutputTimes::OutputTimes(double end_s, std::span<const double> snapshots_s, std::span<const double> rows_s)
    : end_s_(end_s), snapshots_s_(snapshots_s.begin(), snapshots_s.end()), rows_s_(rows_s.begin(), rows_s.end()) {
    merge(snapshots_s_);
    merge(rows_s_);
    all_s_ = snapshots_s_;
    all_s_.insert(all_s_.end(), rows_s_.begin(), rows_s_.end());
    all_s_.push_back(end_s);
    merge(all_s_);
}

/// One of times that are the same, the end if it is among them, in their order.
void OutputTimes::merge(std::vector<double>& times_s) const {
    for (double& time : times_s)
        time = same(time, end_s_) ? end_s_ : time;
    std::erase_if(times_s, [this](double time) { return time > end_s_; });
    std::ranges::sort(times_s, std::greater<>());
    const auto repeated = std::unique(times_s.begin(), times_s.end(), [this](double a, double b) { return same(a, b); });
    times_s.erase(repeated, times_s.end());
}

bool OutputTimes::same(double a, double b) const { return equal(a, b, end_s_); }

bool OutputTimes::is_among(const std::vector<double>& times_s, double time_s) const {
    return std::ranges::any_of(times_s, [&](double time) { return same(time, time_s); });
}

std::vector<double> OutputTimes::after(double time_s) const {
    std::vector<double> times = all_s_;
    std::erase_if(times, [&](double t) { return reached(t, time_s); });
    return times;
}

std::vector<double> regular_times(std::string_view option, std::vector<double> times_s, double every_s, double end_s) {
    if (every_s > 0.0 && !(end_s / every_s <= 1e6))
        throw InputError(fmt::format("{} {}: these would be {:.3g} times up to {:g} s: take a longer interval", option, every_s,
                                     end_s / every_s, end_s));
    for (double k = 0.0; every_s > 0.0 && k <= end_s / every_s * (1.0 + 1e-12); k += 1.0)
        times_s.push_back(k * every_s);
    return times_s;
}

std::vector<double> snapshots_of_run(double end_s, std::vector<double> default_s) {
    if (default_s.empty())
        return {};
    std::erase_if(default_s, [&](double time_s) { return time_s >= end_s || equal(time_s, end_s, end_s); });
    default_s.push_back(end_s);
    return default_s;
}

std::vector<std::string> missing_snapshots(double end_s, std::span<const double> snapshots_s) {
    const double last = snapshots_s.empty() ? 0.0 : *std::ranges::max_element(snapshots_s);
    if (last <= end_s || equal(last, end_s, end_s))
        return {};
    return {fmt::format("the snapshot at {:g} s lies beyond the end at {:g} s and will be missing: lengthen --duration", last,
                        end_s)};
}

} // namespace ductile::io
