// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/keys.hpp>
#include <ductile/io/nearest_name.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <limits>

namespace ductile::io {
namespace {

std::string without_dashes(const std::string& key) { return key.starts_with("--") ? key.substr(2) : key; }

} // namespace

void check_storable(const std::string& text) {
    try {
        (void)read_config("text = " + toml_quoted(text), "");
    } catch (const InputError&) {
        throw InputError("it must be UTF-8 text without control characters");
    }
}

std::vector<Choice<std::string>> plain_words(const std::vector<std::string>& words) {
    std::vector<Choice<std::string>> choices;
    for (const std::string& word : words)
        choices.push_back({word, word});
    return choices;
}

std::string visible(const std::string& text) {
    std::string result;
    for (const char c : text)
        result += static_cast<unsigned char>(c) < ' ' ? fmt::format("\\x{:02x}", c) : std::string(1, c);
    return result;
}

Keys::Keys(const ConfigNode& table, std::string source, std::string place)
    : folder_(std::filesystem::path(source).parent_path()), table_(&table), source_(std::move(source)), place_(std::move(place)) {
    if (!table.is_table())
        throw InputError(fmt::format("{}, line {}: '{}' is no table: write {}", source_, table.line, table.key, place_));
}

void Keys::declare(const std::string& key, Kind kind, const OptionHelp& help, const std::string& allowed, Text text,
                   Convert convert, Meanings meanings) {
    Declared declared{without_dashes(key), kind, help, allowed, std::move(text), std::move(convert), std::move(meanings), {}};
    declared.default_text = declared.text();
    const ConfigNode* node = table_ ? table_->find(declared.key) : nullptr;
    if (node != nullptr) {
        const auto shown = [&] { return node->is_array() || node->is_table() ? to_toml(*node) : visible(node->text); };
        try {
            declared.convert(declared.text_of(*node));
            declared.source = Source::scene_file;
        } catch (const InputError& error) {
            throw InputError(
                fmt::format("{}, line {}: {} {} = {}: {}", source_, node->line, place_, declared.key, shown(), error.what()));
        }
    } else if (table_ != nullptr && help.required) {
        throw InputError(fmt::format("{}, line {}: {} lacks the key '{}': {}", source_, table_->line, place_, declared.key,
                                     declared.description()));
    }
    declared_.push_back(std::move(declared));
}

void Keys::option(const std::string& key, double& value, const OptionHelp& help) {
    declare(
        key, Kind::number, help, help.allowed.describe(), [&value] { return to_text(value); },
        [&value, allowed = help.allowed](const std::string& text) { value = parse_number(text, allowed); });
}

void Keys::option(const std::string& key, int& value, const OptionHelp& help) {
    const auto convert = [&value, allowed = help.allowed](const std::string& text) {
        Limits whole = allowed;
        whole.lowest = std::max(whole.lowest, static_cast<double>(std::numeric_limits<int>::min()));
        whole.highest = std::min(whole.highest, static_cast<double>(std::numeric_limits<int>::max()));
        value = static_cast<int>(parse_integer(text, whole));
    };
    declare(
        key, Kind::integer, help, help.allowed.describe(), [&value] { return fmt::format("{}", value); }, convert);
}

void Keys::option(const std::string& key, std::int64_t& value, const OptionHelp& help) {
    declare(
        key, Kind::integer, help, help.allowed.describe(), [&value] { return fmt::format("{}", value); },
        [&value, allowed = help.allowed](const std::string& text) { value = parse_integer(text, allowed); });
}

void Keys::option(const std::string& key, bool& value, const OptionHelp& help) {
    const auto convert = [&value](const std::string& text) {
        if (text != "true" && text != "false")
            throw InputError("it must be true or false");
        value = text == "true";
    };
    declare(
        key, Kind::boolean, help, "", [&value] { return value ? "true" : "false"; }, convert);
}

void Keys::option(const std::string& key, std::string& value, const OptionHelp& help) {
    declare(
        key, Kind::text, help, "", [&value] { return value; },
        [&value](const std::string& text) {
            check_storable(text);
            value = text;
        });
}

void Keys::option(const std::string& key, std::filesystem::path& value, const OptionHelp& help) {
    declare(
        key, Kind::path, help, "", [&value] { return value.string(); },
        [&value](const std::string& text) {
            check_storable(text);
            value = text;
        });
}

void Keys::input_file(const std::string& key, std::filesystem::path& value, const OptionHelp& help) {
    declare(
        key, Kind::path, help, "", [&value] { return value.string(); },
        [this, &value](const std::string& text) {
            check_storable(text);
            value = text.empty() ? text : std::filesystem::absolute(folder_ / text).lexically_normal().string();
        });
}

void Keys::option(const std::string& key, CellCount& value, const OptionHelp& help) {
    declare(
        key, Kind::cells, help, "N for both or MxN", [&value] { return to_text(value); },
        [&value](const std::string& text) { value = parse_cell_count(text); });
}

void Keys::option(const std::string& key, std::vector<double>& value, const OptionHelp& help) {
    declare(
        key, Kind::number_list, help, help.allowed.describe(), [&value] { return to_text(value); },
        [&value, allowed = help.allowed](const std::string& text) { value = parse_number_list(text, allowed); });
}

void Keys::number_or_auto(const std::string& key, std::string& value, const OptionHelp& help) {
    const auto convert = [&value, allowed = help.allowed](const std::string& text) {
        try {
            if (text != "auto")
                (void)parse_number(text, allowed);
        } catch (const InputError& error) {
            throw InputError(fmt::format("{}; or auto", error.what()));
        }
        value = text;
    };
    declare(
        key, Kind::number_or_auto, help, help.allowed.describe(), [&value] { return value; }, convert);
}

void Keys::choose(const std::string& key, const Meanings& words, const OptionHelp& help, Text text, const Convert& convert) {
    std::vector<std::string> names;
    for (const auto& [word, meaning] : words)
        names.push_back(word);
    const std::string all = fmt::format("{}", fmt::join(names, ", "));
    const auto check = [names, all, convert](const std::string& word) {
        if (std::ranges::find(names, word) == names.end())
            throw InputError(fmt::format("it must be one of {}{}", all, did_you_mean(word, names)));
        convert(word);
    };
    declare(key, Kind::text, help, "one of " + all, std::move(text), check, words);
}

void Keys::toml(const std::string& key, const OptionHelp& help, const std::string& allowed, Text text, Convert convert) {
    declare(key, Kind::toml, help, allowed, std::move(text), std::move(convert));
}

void Keys::refuse_unknown() const {
    for (const ConfigNode& child : table_->children)
        if (std::ranges::find(declared_, child.key, &Declared::key) == declared_.end())
            throw InputError(fmt::format("{}, line {}: {}: unknown key '{}'{}; it has {}", source_, child.line, place_,
                                         visible(child.key), did_you_mean(child.key, names()), fmt::join(names(), ", ")));
}

bool Keys::has_default(const std::string& key) const {
    const auto declared = std::ranges::find(declared_, without_dashes(key), &Declared::key);
    return declared->text() == declared->default_text;
}

Source Keys::source(const std::string& key) const {
    return std::ranges::find(declared_, without_dashes(key), &Declared::key)->source;
}

Keys::Declared* Keys::find(const std::string& key) {
    const auto found = std::ranges::find(declared_, key, &Declared::key);
    return found == declared_.end() ? nullptr : &*found;
}

std::vector<std::string> Keys::names(const std::string& prefix) const {
    std::vector<std::string> result;
    for (const Declared& declared : declared_)
        result.push_back(prefix + declared.key);
    return result;
}

std::string Keys::Declared::description() const {
    return help.meaning + (help.units.empty() ? "" : fmt::format(" [{}]", help.units)) +
           (allowed.empty() ? "" : fmt::format("; {}", allowed));
}

std::string Keys::Declared::help_lines() const {
    std::string lines = description() + (default_text.empty() ? "" : fmt::format(" (default {})", default_text));
    for (const auto& [word, meaning] : meanings)
        if (!meaning.empty())
            lines += fmt::format("\n  {}: {}", word, meaning);
    return lines;
}

std::string Keys::Declared::toml_value() const {
    const std::string value = text();
    switch (kind) {
    case Kind::number:
    case Kind::integer:
    case Kind::boolean:
    case Kind::toml:
        return value;
    case Kind::number_list:
        return fmt::format("[{}]", value);
    case Kind::number_or_auto:
        return value == "auto" ? toml_quoted(value) : to_text(parse_number(value));
    case Kind::text:
    case Kind::path:
    case Kind::cells:
        break;
    }
    return toml_quoted(value);
}

std::string Keys::Declared::text_of(const ConfigNode& node) const {
    if (kind == Kind::toml)
        return to_toml(node);
    if (node.is_table())
        throw InputError("a table stands here: it must have one value");
    if (!node.is_array())
        return node.text;
    if (kind != Kind::number_list)
        throw InputError(fmt::format("key '{}' is an array: it must have one value", key));
    std::vector<std::string> elements;
    for (const ConfigNode& element : node.children) {
        if (element.is_array() || element.is_table())
            throw InputError("arrays in arrays are not used");
        elements.push_back(element.text);
    }
    return fmt::format("{}", fmt::join(elements, ","));
}

} // namespace ductile::io
