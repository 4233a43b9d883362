#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace ductile::io {

enum class TomlType { text, integer, number, boolean, array };

/// One `key = value` of a configuration file.
struct TomlEntry {
    std::string key;
    TomlType type = TomlType::text;
    std::string text;              ///< the value without quotes; an array's elements are joined by commas
    bool array_of_numbers = false; ///< for arrays: every element is an integer or a number
    int line = 0;
};

/// Reads the part of TOML that options need: top-level `key = value` with strings, integers, floats, booleans and arrays of
/// these, and comments. `source` names the text in messages. Throws InputError with the line for anything else
/// (tables and dates included) and for keys given twice.
[[nodiscard]] std::vector<TomlEntry> read_toml(std::string_view text, const std::string& source);

/// A string in TOML quotes.
[[nodiscard]] std::string toml_quoted(std::string_view text);

} // namespace ductile::io
