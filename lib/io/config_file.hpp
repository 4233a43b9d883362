#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace ductile::io {

/// One `key = value` of a configuration file. Numbers are texts that are read back as the same number.
struct ConfigEntry {
    std::string key;
    std::vector<std::string> values = {}; ///< the elements of an array, or the one value
    bool is_array = false;
    int line = 0;
};

/// The top-level keys of a TOML text in the order of their lines. `source` names the text in messages. Throws InputError with the
/// line for what is not TOML (a key given twice included), for tables and dates, and for files that begin with a byte-order mark
/// or are not UTF-8.
[[nodiscard]] std::vector<ConfigEntry> read_config(const std::string& text, const std::string& source);

/// A text as TOML writes it: in quotes.
[[nodiscard]] std::string toml_quoted(std::string_view text);

} // namespace ductile::io
