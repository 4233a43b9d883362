#include <ductile/io/text.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace ductile::io {

std::string aligned_lines(const std::string& title, const LabelledLines& lines) {
    std::size_t width = 0;
    for (const auto& [label, value] : lines)
        width = std::max(width, label.size());
    std::string text = title + "\n";
    for (const auto& [label, value] : lines)
        text += fmt::format("  {:<{}}  {}\n", label, width, value);
    return text;
}

std::string warning_line(const std::string& warning) { return fmt::format("warning: {}\n", warning); }

std::string human_bytes(double bytes) {
    constexpr std::array units = {"B", "KiB", "MiB", "GiB", "TiB"};
    std::size_t unit = 0;
    while (bytes >= 1024.0 && unit + 1 < units.size()) {
        bytes /= 1024.0;
        ++unit;
    }
    return unit == 0 ? fmt::format("{:.0f} B", bytes) : fmt::format("{:.1f} {}", bytes, units[unit]);
}

std::string human_duration(double seconds) {
    if (!std::isfinite(seconds) || seconds < 0.0)
        return "-";
    if (seconds < 59.95)
        return fmt::format("{:.1f} s", seconds);
    const long long whole = std::llround(seconds);
    if (whole < 3600)
        return fmt::format("{}:{:02} min", whole / 60, whole % 60);
    return fmt::format("{}:{:02}:{:02} h", whole / 3600, whole / 60 % 60, whole % 60);
}

} // namespace ductile::io
