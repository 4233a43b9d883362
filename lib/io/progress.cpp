// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/io/progress.hpp>
#include <ductile/io/text.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <unistd.h>

namespace ductile::io {
namespace {

constexpr std::chrono::milliseconds terminal_interval{200};
constexpr std::chrono::seconds pipe_interval{5};

} // namespace

Progress::Progress(const Options& options)
    : options_(options), terminal_(isatty(STDERR_FILENO) == 1), start_(Clock::now()),
      next_(start_ + (terminal_ ? Clock::duration(terminal_interval) : Clock::duration(pipe_interval))) {}

std::string Progress::line(const ProgressState& state, double elapsed_s) const {
    const double done = state.time_s - options_.start_s;
    const double remaining_s = elapsed_s * (options_.duration_s - state.time_s) / done;
    const double percentage = options_.duration_s > 0.0 ? 100.0 * state.time_s / options_.duration_s : 100.0;
    const std::string limit = state.limit.empty() ? "" : fmt::format(" ({})", state.limit);
    return fmt::format("{:5.1f} %  step {}  dt {:.3g} s{}  elapsed {}  remaining {}", std::clamp(percentage, 0.0, 100.0),
                       state.step, state.dt_s, limit, human_duration(elapsed_s), human_duration(std::max(remaining_s, 0.0)));
}

void Progress::print() {
    const auto now = Clock::now();
    std::string text = line(last_, std::chrono::duration<double>(now - start_).count());
    if (terminal_) {
        // a longer line would wrap and could not be redrawn
        text.resize(std::min(text.size(), terminal_columns(STDERR_FILENO).value_or(80) - 1));
        std::fprintf(stderr, "\r%s\033[K", text.c_str());
    } else {
        std::fprintf(stderr, "%s\n", text.c_str());
    }
    std::fflush(stderr);
    next_ = now + (terminal_ ? Clock::duration(terminal_interval) : Clock::duration(pipe_interval));
    printed_ = true;
}

void Progress::finish() {
    if (options_.quiet || !printed_)
        return;
    print();
    if (terminal_)
        std::fputc('\n', stderr);
    printed_ = false;
}

} // namespace ductile::io
