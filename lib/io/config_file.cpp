#include <ductile/base/error.hpp>
#include <ductile/io/config_file.hpp>
#include <ductile/io/option_values.hpp>

#include <fmt/format.h>

#define TOML_ENABLE_FORMATTERS 0
#include <toml++/toml.h>

#include <algorithm>

namespace ductile::io {
namespace {

/// What editors on other systems write, and TOML does not allow.
void check_encoding(std::string_view text) {
    if (text.starts_with("\xef\xbb\xbf"))
        throw InputError("the file begins with a byte-order mark (BOM): save it as UTF-8 without one");
    if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff"))
        throw InputError("the file is UTF-16 (it begins with a byte-order mark): save it as UTF-8");
    if (text.find('\0') != text.npos)
        throw InputError("the file contains null characters: save it as UTF-8 text");
}

std::string text_of(const toml::node& value) {
    if (const auto* text = value.as_string())
        return text->get();
    if (const auto* number = value.as_integer())
        return fmt::format("{}", number->get());
    if (const auto* truth = value.as_boolean())
        return truth->get() ? "true" : "false";
    if (const auto* number = value.as_floating_point()) {
        const std::string text = to_text(number->get());
        return text.find_first_not_of("-0123456789") == text.npos ? text + ".0" : text; // no whole number by its type
    }
    if (value.is_table())
        throw InputError("tables are not used: all keys stand at the top level, as key = value");
    if (value.is_array())
        throw InputError("arrays in arrays are not used");
    throw InputError("dates and times of day are not used: a time is a number of seconds");
}

ConfigEntry entry_of(const toml::key& key, const toml::node& node) {
    ConfigEntry entry{.key = std::string(key.str()), .line = static_cast<int>(key.source().begin.line)};
    if (const auto* array = node.as_array()) {
        entry.is_array = true;
        for (const toml::node& element : *array)
            entry.values.push_back(text_of(element));
    } else {
        entry.values.push_back(text_of(node));
    }
    return entry;
}

} // namespace

std::vector<ConfigEntry> read_config(const std::string& text, const std::string& source) {
    std::vector<ConfigEntry> entries;
    int line = 1;
    try {
        check_encoding(text);
        const toml::table table = toml::parse(text);
        for (auto&& [key, node] : table) {
            line = static_cast<int>(key.source().begin.line);
            entries.push_back(entry_of(key, node));
        }
    } catch (const InputError& error) {
        throw InputError(fmt::format("{}, line {}: {}", source, line, error.what()));
    } catch (const toml::parse_error& error) {
        throw InputError(fmt::format("{}, line {}: {} (TOML: one key = value a line, texts in quotes)", source,
                                     error.source().begin.line, error.description()));
    }
    std::ranges::sort(entries, {}, &ConfigEntry::line);
    return entries;
}

std::string toml_quoted(std::string_view text) {
    std::string result = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\')
            result += '\\';
        result += c;
    }
    return result + '"';
}

} // namespace ductile::io
