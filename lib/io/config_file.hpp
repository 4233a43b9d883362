// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace ductile::io {

/// A value of a configuration or scene file, with the key it stands at. Numbers are texts that are read back as the same number.
struct ConfigNode {
    enum class Kind { value, quoted, array, table };

    std::string key = {};
    Kind kind = Kind::value;
    std::string text = {};                 ///< of a value, without quotes
    std::vector<ConfigNode> children = {}; ///< elements of an array, or entries of a table in the order of their lines
    int line = 0;

    [[nodiscard]] bool is_table() const { return kind == Kind::table; }
    [[nodiscard]] bool is_array() const { return kind == Kind::array; }
    /// The entry of a table, or null.
    [[nodiscard]] const ConfigNode* find(std::string_view name) const;
};

/// A TOML text as a table. `source` names the text in messages. Throws InputError with the line for what is not TOML (a key given
/// twice included), for dates, and for files that begin with a byte-order mark or are not UTF-8.
[[nodiscard]] ConfigNode read_config(const std::string& text, const std::string& source);

/// The whole text of a file. Throws InputError when it cannot be read.
[[nodiscard]] std::string read_config_file(const std::string& path);

/// A key as TOML writes it: bare, or in quotes.
[[nodiscard]] std::string toml_key(std::string_view key);
/// A text as TOML writes it: in quotes.
[[nodiscard]] std::string toml_quoted(std::string_view text);
/// "[1, 2.5]"
[[nodiscard]] std::string toml_array(const std::vector<double>& values);
/// A value as TOML writes it on one line.
[[nodiscard]] std::string to_toml(const ConfigNode& node);

} // namespace ductile::io
