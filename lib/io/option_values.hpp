// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace ductile::io {

/// Which finite numbers an option accepts.
struct Limits {
    double lowest = -std::numeric_limits<double>::infinity();
    double highest = std::numeric_limits<double>::infinity();
    bool lowest_allowed = true;
    bool highest_allowed = true;

    /// "above 0", "from 1 to 4096"; empty without limits.
    [[nodiscard]] std::string describe() const;
    [[nodiscard]] bool allow(double value) const;
};

inline constexpr Limits any_number{};
inline constexpr Limits positive{.lowest = 0.0, .lowest_allowed = false};
inline constexpr Limits not_negative{.lowest = 0.0};
[[nodiscard]] constexpr Limits at_least(double lowest) { return {.lowest = lowest}; }
[[nodiscard]] constexpr Limits between(double lowest, double highest) { return {.lowest = lowest, .highest = highest}; }
[[nodiscard]] constexpr Limits strictly_between(double lowest, double highest) {
    return {.lowest = lowest, .highest = highest, .lowest_allowed = false, .highest_allowed = false};
}

/// Numbers of cells in x and y, written "N" (both) or "MxN".
struct CellCount {
    int x = 0;
    int y = 0;
    bool operator==(const CellCount&) const = default;
};

/// Text to value, for command line and configuration file alike. Throws InputError that says what is allowed; the caller adds
/// which option it was.
[[nodiscard]] double parse_number(std::string_view text, const Limits& limits = any_number);
[[nodiscard]] std::int64_t parse_integer(std::string_view text, const Limits& limits = any_number);
[[nodiscard]] CellCount parse_cell_count(std::string_view text);
/// "t1,t2,..."; empty text is an empty list.
[[nodiscard]] std::vector<double> parse_number_list(std::string_view text, const Limits& limits = any_number);

/// Value to the shortest text that is read back as the same value.
[[nodiscard]] std::string to_text(double value);
[[nodiscard]] std::string to_text(const CellCount& cells);
[[nodiscard]] std::string to_text(const std::vector<double>& values);

} // namespace ductile::io
