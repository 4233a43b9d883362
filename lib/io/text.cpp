// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/io/text.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <sys/ioctl.h>
#include <unistd.h>

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

std::string warning_line(const std::string& warning, std::size_t columns) {
    const std::string line = "warning: " + warning;
    return (columns == 0 ? line : wrapped(line, columns)) + "\n";
}

std::optional<std::size_t> terminal_columns(int descriptor) {
    winsize size{};
    if (isatty(descriptor) == 1 && ioctl(descriptor, TIOCGWINSZ, &size) == 0 && size.ws_col > 0)
        return size.ws_col;
    return std::nullopt;
}

std::string wrapped(const std::string& text, std::size_t columns, const std::string& margin) {
    std::string result;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        const std::string spaces(std::min(line.find_first_not_of(' '), line.size()), ' ');
        std::string piece = margin + spaces;
        bool begun = false;
        std::istringstream words(line);
        for (std::string word; words >> word; begun = true) {
            if (begun && piece.size() + 1 + word.size() > columns) {
                result += piece + '\n';
                piece = margin + spaces + (spaces.empty() ? "" : "    ");
            } else if (begun) {
                piece += ' ';
            }
            piece += word;
        }
        result += piece + '\n';
    }
    if (!result.empty())
        result.pop_back();
    return result;
}

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
