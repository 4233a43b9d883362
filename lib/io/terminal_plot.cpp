// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/terminal_plot.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace ductile::io {
namespace {

struct Range {
    double low = 0.0, high = 1.0;
    [[nodiscard]] double part(double value) const { return (value - low) / (high - low); }
};

/// Whether differences of such values are numbers.
bool can_be_shown(double value) { return std::abs(value) < 1e300; }

/// From the smallest to the largest value that can be shown, widened if there is only one.
Range range_of(std::span<const double> values) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const double value : values)
        if (can_be_shown(value))
            low = std::min(low, value), high = std::max(high, value);
    if (low > high)
        return {};
    constexpr double nothing = 1e-290;
    const double least = std::max(1e-9 * std::max(std::abs(low), std::abs(high)), nothing);
    if (high - low > least)
        return {low, high};
    const double margin = std::abs(low) < nothing ? 1.0 : 0.5 * std::abs(low);
    return {low - margin, high + margin};
}

struct Tick {
    double part;
    std::string label;
};

/// Three to six ticks at multiples of 1, 2 or 5 times a power of ten, labelled with as many digits as tell them apart.
std::vector<Tick> ticks_of(const Range& range) {
    const double rough = (range.high - range.low) / 4.0;
    const double power = std::pow(10.0, std::floor(std::log10(rough)));
    const double lead = rough / power;
    const double step = power * (lead < 1.5 ? 1.0 : lead < 3.5 ? 2.0 : lead < 7.5 ? 5.0 : 10.0);
    const double largest = std::max(std::abs(range.low), std::abs(range.high));
    const int digits = std::clamp(static_cast<int>(std::floor(std::log10(largest)) - std::floor(std::log10(step))) + 2, 1, 15);
    const auto label = [&](double value) { // numbers of everyday size are written out
        return step >= 1.0 && largest < 1e6 ? fmt::format("{:.0f}", value) : fmt::format("{:.{}g}", value, digits);
    };
    std::vector<Tick> ticks;
    for (double n = std::ceil(range.low / step - 1e-9); n * step <= range.high + 1e-9 * step; ++n)
        ticks.push_back({range.part(n * step), label(n == 0.0 ? 0.0 : n * step)});
    return ticks;
}

/// A canvas of braille characters, 2 x 4 dots each; dot (0, 0) is the lowest left one.
class Canvas {
public:
    Canvas(int width, int height) : width_(width), height_(height), cells_(static_cast<std::size_t>(width * height), 0) {}

    [[nodiscard]] int dots_x() const { return 2 * width_; }
    [[nodiscard]] int dots_y() const { return 4 * height_; }

    void dot(int x, int y) {
        constexpr std::array<std::array<unsigned, 4>, 2> bits = {{{0x40, 0x04, 0x02, 0x01}, {0x80, 0x20, 0x10, 0x08}}};
        const int line = height_ - 1 - y / 4;
        cells_[static_cast<std::size_t>(line * width_ + x / 2)] |=
            bits[static_cast<std::size_t>(x % 2)][static_cast<std::size_t>(y % 4)];
    }

    void segment(double x0, double y0, double x1, double y1) {
        const int count = 1 + static_cast<int>(std::max(std::abs(x1 - x0), std::abs(y1 - y0)));
        for (int k = 0; k <= count; ++k) {
            const double part = static_cast<double>(k) / count;
            dot(static_cast<int>(std::lround(x0 + part * (x1 - x0))), static_cast<int>(std::lround(y0 + part * (y1 - y0))));
        }
    }

    [[nodiscard]] std::string line(int number) const {
        std::string text;
        for (int i = 0; i < width_; ++i) {
            const unsigned code = 0x2800U + cells_[static_cast<std::size_t>(number * width_ + i)];
            text += static_cast<char>(0xE0U | (code >> 12U));
            text += static_cast<char>(0x80U | ((code >> 6U) & 0x3FU));
            text += static_cast<char>(0x80U | (code & 0x3FU));
        }
        return text;
    }

private:
    int width_, height_;
    std::vector<unsigned> cells_;
};

int position(double part, int count) { return static_cast<int>(std::lround(part * (count - 1))); }

} // namespace

std::string terminal_plot(std::span<const double> x, std::span<const double> y, const PlotOptions& options) {
    if (x.size() != y.size())
        throw InputError(fmt::format("plot '{}': {} values of x for {} values of y", options.title, x.size(), y.size()));
    const Range across = range_of(x), up = range_of(y);
    Canvas canvas(options.width, options.height);
    const auto dot_x = [&](std::size_t k) { return across.part(x[k]) * (canvas.dots_x() - 1); };
    const auto dot_y = [&](std::size_t k) { return up.part(y[k]) * (canvas.dots_y() - 1); };
    const auto shown = [&](std::size_t k) { return can_be_shown(x[k]) && can_be_shown(y[k]); };
    for (std::size_t k = 0; k < x.size(); ++k) {
        if (!shown(k))
            continue;
        const std::size_t from = k > 0 && shown(k - 1) ? k - 1 : k;
        canvas.segment(dot_x(from), dot_y(from), dot_x(k), dot_y(k));
    }

    std::vector<std::string> labels(static_cast<std::size_t>(options.height));
    std::size_t margin = 0;
    for (const Tick& tick : ticks_of(up)) {
        labels[static_cast<std::size_t>(options.height - 1 - position(tick.part, options.height))] = tick.label;
        margin = std::max(margin, tick.label.size());
    }
    std::string text = options.title.empty() ? "" : options.title + "\n";
    text += fmt::format("{}\n", options.y_label);
    for (int line = 0; line < options.height; ++line) {
        const std::string& label = labels[static_cast<std::size_t>(line)];
        text += fmt::format("{:>{}} {}{}\n", label, margin, label.empty() ? "│" : "┤", canvas.line(line));
    }

    std::string names(static_cast<std::size_t>(options.width) + margin + 12, ' ');
    std::vector<bool> marked(static_cast<std::size_t>(options.width), false);
    for (const Tick& tick : ticks_of(across)) {
        const auto column = static_cast<std::size_t>(position(tick.part, options.width));
        const std::size_t begin = margin + 2 + column - std::min(tick.label.size() / 2, margin + 2 + column);
        const bool free = names.find_first_not_of(' ', begin > 0 ? begin - 1 : 0) == names.npos;
        if (!free || begin + tick.label.size() > names.size())
            continue;
        marked[column] = true;
        names.replace(begin, tick.label.size(), tick.label);
    }
    text += fmt::format("{:{}} └", "", margin);
    for (const bool mark : marked)
        text += mark ? "┬" : "─";
    names.erase(names.find_last_not_of(' ') + 1);
    return text + "\n" + names + "\n" +
           fmt::format("{:>{}}\n", options.x_label, static_cast<std::size_t>(options.width) + margin + 2);
}

} // namespace ductile::io
