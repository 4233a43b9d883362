#pragma once
#include <string>
#include <vector>

namespace ductile::io {

/// One `key = value` of a configuration file. CLI11, which reads it, does not say whether a value stood in quotes.
struct ConfigEntry {
    std::string key;
    std::vector<std::string> values; ///< the elements of an array, or the one value
    int line = 0;
};

/// Reads top-level TOML keys with CLI11. `source` names the text in messages. Throws InputError with the line for what is not
/// `key = value` (tables included), for a key given twice, and for what CLI11 would silently misread: open quotes or arrays,
/// backslashes.
[[nodiscard]] std::vector<ConfigEntry> read_config(const std::string& text, const std::string& source);

} // namespace ductile::io
