// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

namespace ductile::io {

/// Where a run stands.
struct ProgressState {
    double time_s = 0.0;
    std::int64_t step = 0;
    double dt_s = 0.0;
    std::string_view limit = {}; ///< what limits dt ("accuracy", "snapshot"); must outlive the Progress: use literals
};

/// The progress line, on the standard error stream: redrawn on a terminal, printed every few seconds in a pipe, silent with
/// `quiet`. Simulated time, step, dt and what limits it, elapsed and remaining wall time.
class Progress {
public:
    struct Options {
        double duration_s = 0.0; ///< simulated time at the end
        double start_s = 0.0;    ///< simulated time at the start: not 0 in a continued run
        bool quiet = false;
    };
    explicit Progress(const Options& options);

    /// Call it every step: without anything to print it costs one look at the clock.
    void update(const ProgressState& state) {
        last_ = state;
        if (!options_.quiet && Clock::now() >= next_)
            print();
    }
    /// Prints the final state once and ends the line.
    void finish();
    /// The line as it would be printed after so many seconds.
    [[nodiscard]] std::string line(const ProgressState& state, double elapsed_s) const;

private:
    using Clock = std::chrono::steady_clock;
    void print();

    Options options_;
    bool terminal_;
    bool printed_ = false;
    Clock::time_point start_, next_;
    ProgressState last_;
};

} // namespace ductile::io
