// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/option_values.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>

namespace ductile::io {
namespace {

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view blanks = " \t\n\r";
    const std::size_t first = text.find_first_not_of(blanks);
    return first == text.npos ? std::string_view{} : text.substr(first, text.find_last_not_of(blanks) + 1 - first);
}

std::string required(const char* kind, const Limits& limits) {
    const std::string range = limits.describe();
    return fmt::format("it must be {}{}{}", kind, range.empty() ? "" : " ", range);
}

/// The number that is the whole text; std::from_chars knows no locale and no hexadecimal forms.
template <class T> T whole_text(std::string_view text, const std::string& requirement) {
    std::string_view digits = trimmed(text);
    if (digits.starts_with('+') && !digits.starts_with("+-"))
        digits.remove_prefix(1);
    T value{};
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error == std::errc::result_out_of_range)
        throw InputError(fmt::format("this number cannot be represented, {}", requirement));
    if (error != std::errc{} || end != digits.data() + digits.size())
        throw InputError(requirement);
    return value;
}

} // namespace

std::string Limits::describe() const {
    const bool below = std::isfinite(highest), above = std::isfinite(lowest);
    if (above && below && lowest_allowed && highest_allowed)
        return fmt::format("from {} to {}", lowest, highest);
    std::string text;
    if (above)
        text = fmt::format("{} {}", lowest_allowed ? "at least" : "above", lowest);
    if (below)
        text += fmt::format("{}{} {}", above ? " and " : "", highest_allowed ? "at most" : "below", highest);
    return text;
}

bool Limits::allow(double value) const {
    return std::isfinite(value) && (lowest_allowed ? value >= lowest : value > lowest) &&
           (highest_allowed ? value <= highest : value < highest);
}

double parse_number(std::string_view text, const Limits& limits) {
    const std::string requirement = required("a finite number", limits);
    const auto value = whole_text<double>(text, requirement);
    if (!limits.allow(value))
        throw InputError(requirement);
    return value;
}

std::int64_t parse_integer(std::string_view text, const Limits& limits) {
    const std::string requirement = required("a whole number", limits);
    const auto value = whole_text<std::int64_t>(text, requirement);
    if (!limits.allow(static_cast<double>(value)))
        throw InputError(requirement);
    return value;
}

CellCount parse_cell_count(std::string_view text) {
    constexpr Limits allowed = between(1, 1 << 20);
    try {
        const std::size_t cross = text.find('x');
        const auto x = static_cast<int>(parse_integer(text.substr(0, cross), allowed));
        return {x, cross == text.npos ? x : static_cast<int>(parse_integer(text.substr(cross + 1), allowed))};
    } catch (const InputError&) {
        throw InputError(fmt::format("it must be N or MxN (cells in x and y), whole numbers {}", allowed.describe()));
    }
}

std::vector<double> parse_number_list(std::string_view text, const Limits& limits) {
    std::vector<double> values;
    if (trimmed(text).empty())
        return values;
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        const std::string_view element = text.substr(begin, end - begin);
        try {
            values.push_back(parse_number(element, limits));
        } catch (const InputError& error) {
            throw InputError(fmt::format("it must be a list \"a,b,...\", element '{}' is wrong: {}", element, error.what()));
        }
        begin = end + 1;
    }
    return values;
}

std::string to_text(double value) { return fmt::format("{}", value); }
std::string to_text(const CellCount& cells) {
    return cells.x == cells.y ? fmt::format("{}", cells.x) : fmt::format("{}x{}", cells.x, cells.y);
}
std::string to_text(const std::vector<double>& values) { return fmt::format("{}", fmt::join(values, ",")); }

} // namespace ductile::io
