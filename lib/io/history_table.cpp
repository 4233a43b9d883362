// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/history.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <limits>

namespace ductile::io {
namespace {

std::vector<std::string> split(const std::string& line) {
    std::vector<std::string> names;
    for (std::size_t begin = 0; begin <= line.size();) {
        const std::size_t end = std::min(line.find(',', begin), line.size());
        names.push_back(line.substr(begin, end - begin));
        begin = end + 1;
    }
    return names;
}

std::size_t place(const std::vector<std::string>& columns, std::string_view name) {
    const auto found = std::ranges::find(columns, name);
    if (found == columns.end())
        throw RunError(fmt::format("the history has no column '{}'; it has {}", name, fmt::join(columns, ", ")));
    return static_cast<std::size_t>(found - columns.begin());
}

} // namespace

std::vector<double> HistoryTable::column(std::string_view name) const {
    std::vector<double> picked;
    picked.reserve(rows());
    for (std::size_t at = place(columns, name); at < values.size(); at += columns.size())
        picked.push_back(values[at]);
    return picked;
}

namespace {

enum class Writer { run, user };

HistoryTable read(const std::filesystem::path& csv, const std::vector<std::string>& columns, Writer writer) {
    std::ifstream file(csv);
    std::string line;
    const auto next_line = [&] {
        const bool found = static_cast<bool>(std::getline(file, line));
        if (found && writer == Writer::user && line.ends_with('\r'))
            line.pop_back();
        return found;
    };
    if (!next_line())
        throw InputError(fmt::format("{}: the history cannot be read", csv.string()));
    const std::vector<std::string> all = split(line);
    HistoryTable table{.columns = columns.empty() ? all : columns};
    constexpr std::size_t unused = std::numeric_limits<std::size_t>::max();
    std::vector<std::size_t> target(all.size(), unused);
    for (std::size_t c = 0; c < table.columns.size(); ++c)
        target[place(all, table.columns[c])] = c;
    for (std::int64_t row = 1; next_line() && (writer == Writer::user || !file.eof()); ++row) {
        const std::size_t first = table.values.size();
        table.values.resize(first + table.columns.size());
        const char* cursor = line.data();
        const char* const end = cursor + line.size();
        for (std::size_t c = 0; c < all.size(); ++c) {
            double value = 0.0;
            const auto [stop, status] = std::from_chars(cursor, end, value);
            const bool closed = c + 1 < all.size() ? stop != end && *stop == ',' : stop == end;
            if (status != std::errc{} || !closed)
                throw InputError(fmt::format("{}, row {}: '{}' is not a row of {} numbers", csv.string(), row, line, all.size()));
            if (target[c] != unused)
                table.values[first + target[c]] = value;
            cursor = stop + 1;
        }
    }
    return table;
}

} // namespace

HistoryTable read_history(const std::filesystem::path& csv, const std::vector<std::string>& columns) {
    return read(csv, columns, Writer::run);
}

HistoryTable read_table(const std::filesystem::path& csv) {
    std::error_code unknown;
    if (std::filesystem::exists(csv, unknown) && !std::filesystem::is_regular_file(csv, unknown)) // it may never end
        throw InputError(fmt::format("{}: this is not a file", csv.string()));
    return read(csv, {}, Writer::user);
}

} // namespace ductile::io
