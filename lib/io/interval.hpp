// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <chrono>

namespace ductile::io {

/// Says once every so many seconds of wall time that it is time again. A question costs one look at the clock.
class Interval {
public:
    explicit Interval(double seconds) : length_(seconds), last_(std::chrono::steady_clock::now()) {}

    /// True when the interval has passed since the last true answer (or since the beginning).
    [[nodiscard]] bool passed() {
        const auto now = std::chrono::steady_clock::now();
        if (now - last_ < length_)
            return false;
        last_ = now;
        return true;
    }

private:
    std::chrono::duration<double> length_;
    std::chrono::steady_clock::time_point last_;
};

} // namespace ductile::io
