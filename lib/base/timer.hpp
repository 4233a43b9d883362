// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <chrono>
#include <string>
#include <utility>
#include <vector>

namespace ductile {

/// Wall seconds by phase, in the order of printing.
using PhaseSeconds = std::vector<std::pair<std::string, double>>;

/// Wall-clock seconds since construction or the last lap.
class Timer {
public:
    /// Seconds since the last lap (or construction); starts the next lap.
    double lap() {
        const auto now = Clock::now();
        const double seconds = std::chrono::duration<double>(now - start_).count();
        start_ = now;
        return seconds;
    }
    [[nodiscard]] double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

private:
    using Clock = std::chrono::steady_clock;
    Clock::time_point start_ = Clock::now();
};

} // namespace ductile
