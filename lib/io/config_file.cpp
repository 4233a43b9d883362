#include <ductile/base/error.hpp>
#include <ductile/io/config_file.hpp>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <sstream>

namespace ductile::io {
namespace {

/// A line up to its comment; CLI11 takes a '#' inside quotes for the beginning of one.
std::string without_comment(const std::string& line) {
    char quote = '\0';
    for (std::size_t i = 0; i < line.size(); ++i) {
        const char c = line[i];
        if (c == '#' && quote == '\0')
            return line.substr(0, i);
        if (c == '\\')
            throw InputError("backslashes are not understood here");
        if (c == quote)
            quote = '\0';
        else if (quote == '\0' && (c == '"' || c == '\''))
            quote = c;
    }
    if (quote != '\0')
        throw InputError("a text has no closing quote");
    return line;
}

bool blank(const std::string& text) { return text.find_first_not_of(" \t\r") == text.npos; }

bool opens_array(const std::string& statement) {
    const std::size_t value = statement.find_first_not_of(" \t", std::min(statement.find('='), statement.size() - 1) + 1);
    return value != statement.npos && statement[value] == '[' && statement[statement.find_last_not_of(" \t\r")] != ']';
}

ConfigEntry read_statement(const std::string& statement, int line) {
    std::istringstream stream(statement);
    CLI::ConfigTOML toml;
    toml.comment('\0'); // none are left
    const std::vector<CLI::ConfigItem> items = toml.from_config(stream);
    if (statement.find('=') == statement.npos || items.size() != 1 || !items.front().parents.empty())
        throw InputError("expected key = value (tables are not used: all keys stand at the top level)");
    return {items.front().name, items.front().inputs, line};
}

} // namespace

// A statement at a time: CLI11 would join the values of a key given twice, and knows no lines.
std::vector<ConfigEntry> read_config(const std::string& text, const std::string& source) {
    std::vector<ConfigEntry> entries;
    std::istringstream lines(text);
    std::string line;
    int number = 0;
    const auto next_line = [&] { return std::getline(lines, line) && ++number > 0; };
    try {
        while (next_line()) {
            std::string statement = without_comment(line);
            const int first = number;
            if (blank(statement))
                continue;
            while (opens_array(statement)) {
                if (!next_line())
                    throw InputError("an array has no closing bracket");
                statement += without_comment(line);
            }
            ConfigEntry entry = read_statement(statement, first);
            const auto same = std::ranges::find(entries, entry.key, &ConfigEntry::key);
            if (same != entries.end())
                throw InputError(fmt::format("key '{}' is given twice (first in line {})", entry.key, same->line));
            entries.push_back(std::move(entry));
        }
    } catch (const InputError& error) {
        throw InputError(fmt::format("{}, line {}: {}", source, number, error.what()));
    }
    return entries;
}

} // namespace ductile::io
