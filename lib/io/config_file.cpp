// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/config_file.hpp>
#include <ductile/io/option_values.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#define TOML_ENABLE_FORMATTERS 0
#include <toml++/toml.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

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

int line_of(const toml::source_region& region) { return static_cast<int>(region.begin.line); }

/// `line` is kept at what is being read.
ConfigNode node_of(std::string key, const toml::node& value, int& line) {
    using Kind = ConfigNode::Kind;
    ConfigNode node{.key = std::move(key), .line = line};
    if (const auto* text = value.as_string()) {
        node.kind = Kind::quoted;
        node.text = text->get();
    } else if (const auto* whole = value.as_integer()) {
        node.text = fmt::format("{}", whole->get());
    } else if (const auto* truth = value.as_boolean()) {
        node.text = truth->get() ? "true" : "false";
    } else if (const auto* number = value.as_floating_point()) {
        node.text = to_text(number->get());
        if (node.text.find_first_not_of("-0123456789") == node.text.npos)
            node.text += ".0"; // no whole number by its type
    } else if (const auto* array = value.as_array()) {
        node.kind = Kind::array;
        for (const toml::node& element : *array) {
            line = line_of(element.source());
            node.children.push_back(node_of({}, element, line));
        }
    } else if (const auto* table = value.as_table()) {
        node.kind = Kind::table;
        for (auto&& [name, entry] : *table) {
            line = line_of(name.source());
            node.children.push_back(node_of(std::string(name.str()), entry, line));
        }
        std::ranges::stable_sort(node.children, {}, &ConfigNode::line);
    } else {
        throw InputError("dates and times of day are not used: a time is a number of seconds");
    }
    return node;
}

} // namespace

const ConfigNode* ConfigNode::find(std::string_view name) const {
    const auto found = std::ranges::find(children, name, &ConfigNode::key);
    return is_table() && found != children.end() ? &*found : nullptr;
}

ConfigNode read_config(const std::string& text, const std::string& source) {
    int line = 1;
    try {
        check_encoding(text);
        return node_of({}, toml::parse(text), line);
    } catch (const InputError& error) {
        throw InputError(fmt::format("{}, line {}: {}", source, line, error.what()));
    } catch (const toml::parse_error& error) {
        throw InputError(fmt::format("{}, line {}: {} (TOML: one key = value a line, texts in quotes)", source,
                                     error.source().begin.line, error.description()));
    }
}

std::string read_config_file(const std::string& path) {
    std::ifstream file(path);
    if (!file || std::filesystem::is_directory(path))
        throw InputError(fmt::format("{}: the file cannot be read", path));
    std::string text;
    std::vector<char> piece(1 << 16);
    while (file.read(piece.data(), static_cast<std::streamsize>(piece.size())) || file.gcount() > 0) {
        text.append(piece.data(), static_cast<std::size_t>(file.gcount()));
        if (text.size() > 100'000'000) // a device that never ends, for one
            throw InputError(fmt::format("{}: the file has more than 100 MB: it is no text of keys and values", path));
    }
    return text;
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

std::string toml_key(std::string_view key) {
    const auto bare = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
    };
    return !key.empty() && std::ranges::all_of(key, bare) ? std::string(key) : toml_quoted(key);
}

std::string toml_array(const std::vector<double>& values) { return fmt::format("[{}]", fmt::join(values, ", ")); }

std::string to_toml(const ConfigNode& node) {
    if (!node.is_array() && !node.is_table())
        return node.kind == ConfigNode::Kind::quoted ? toml_quoted(node.text) : node.text;
    std::string inside;
    for (const ConfigNode& child : node.children)
        inside += fmt::format("{}{}{}{}", inside.empty() ? "" : ", ", node.is_table() ? toml_key(child.key) : "",
                              node.is_table() ? " = " : "", to_toml(child));
    return node.is_array() ? fmt::format("[{}]", inside) : fmt::format("{{{}}}", inside);
}

} // namespace ductile::io
