#include <ductile/base/error.hpp>
#include <ductile/io/toml.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace ductile::io {
namespace {

struct Value {
    TomlType type;
    std::string text;
    bool array_of_numbers = false;
};

class Reader {
public:
    Reader(std::string_view text, const std::string& source) : rest_(text), source_(source) {}

    std::vector<TomlEntry> entries() {
        std::vector<TomlEntry> found;
        for (skip_space(true); !rest_.empty(); skip_space(true)) {
            const int line = line_;
            const std::string key = read_key();
            skip_space(false);
            if (!take('='))
                fail(fmt::format("expected '=' after '{}': lines have the form key = value", key));
            skip_space(false);
            Value value = read_value();
            skip_space(false);
            if (!rest_.empty() && rest_.front() != '\n')
                fail(fmt::format("unexpected text after the value of '{}'", key));
            const auto same = std::ranges::find(found, key, &TomlEntry::key);
            if (same != found.end())
                fail(fmt::format("key '{}' is given twice (first in line {})", key, same->line));
            found.push_back({key, value.type, std::move(value.text), value.array_of_numbers, line});
        }
        return found;
    }

private:
    [[noreturn]] void fail(const std::string& what) const {
        throw InputError(fmt::format("{}, line {}: {}", source_, line_, what));
    }

    bool take(char wanted) {
        if (rest_.empty() || rest_.front() != wanted)
            return false;
        rest_.remove_prefix(1);
        return true;
    }

    /// Blanks and comments; also line ends if these do not matter.
    void skip_space(bool lines) {
        while (!rest_.empty()) {
            const char c = rest_.front();
            if (c == '#')
                rest_.remove_prefix(std::min(rest_.find('\n'), rest_.size()));
            else if (c == ' ' || c == '\t' || c == '\r')
                rest_.remove_prefix(1);
            else if (c == '\n' && lines)
                ++line_, rest_.remove_prefix(1);
            else
                return;
        }
    }

    /// The longest beginning made of letters, digits and `others`.
    std::string take_word(std::string_view others) {
        const auto end = std::ranges::find_if_not(
            rest_, [&](char c) { return std::isalnum(static_cast<unsigned char>(c)) || others.find(c) != others.npos; });
        const auto length = static_cast<std::size_t>(end - rest_.begin());
        std::string word(rest_.substr(0, length));
        rest_.remove_prefix(length);
        return word;
    }

    std::string read_key() {
        if (rest_.front() == '[')
            fail("tables are not used here: all keys stand at the top level");
        std::string key = take_word("-_");
        if (key.empty())
            fail("expected a key: lines have the form key = value");
        return key;
    }

    Value read_value() {
        if (take('"'))
            return {TomlType::text, read_string('"')};
        if (take('\''))
            return {TomlType::text, read_string('\'')};
        if (take('['))
            return read_array();
        const std::string word = take_word("+-_.:");
        if (word == "true" || word == "false")
            return {TomlType::boolean, word};
        return read_number(word);
    }

    Value read_number(const std::string& word) const {
        std::string digits = word;
        std::erase(digits, '_');
        const std::string_view unsigned_digits = std::string_view(digits).substr(digits.find_first_of("+-") == 0 ? 1 : 0);
        if (unsigned_digits == "inf" || unsigned_digits == "nan")
            return {TomlType::number, digits};
        const bool starts_well = !unsigned_digits.empty() && std::isdigit(static_cast<unsigned char>(unsigned_digits.front()));
        if (!starts_well || digits.find_first_not_of("0123456789+-.eE") != digits.npos)
            fail(fmt::format("'{}' is no value: texts stand in \"quotes\", numbers are decimal", word));
        const bool whole = unsigned_digits.find_first_not_of("0123456789") == unsigned_digits.npos;
        return {whole ? TomlType::integer : TomlType::number, digits};
    }

    std::string read_string(char quote) {
        std::string text;
        while (!take(quote)) {
            if (rest_.empty() || rest_.front() == '\n')
                fail("a text has no closing quote");
            char c = rest_.front();
            rest_.remove_prefix(1);
            if (c == '\\' && quote == '"')
                c = read_escape();
            text += c;
        }
        return text;
    }

    char read_escape() {
        constexpr std::string_view letters = "\"\\nt", meanings = "\"\\\n\t";
        const std::size_t which = rest_.empty() ? letters.npos : letters.find(rest_.front());
        if (which == letters.npos)
            fail("unknown escape in a text: write \\\\ for a backslash, or use 'single quotes'");
        rest_.remove_prefix(1);
        return meanings[which];
    }

    Value read_array() {
        Value array{TomlType::array, {}, true};
        skip_space(true);
        for (bool first = true; !take(']'); first = false) {
            if (!first && !take(','))
                fail("expected ',' or ']' in an array");
            skip_space(true);
            if (!first && take(']'))
                break;
            const Value element = read_value();
            array.array_of_numbers &= element.type == TomlType::integer || element.type == TomlType::number;
            array.text += (first ? "" : ",") + element.text;
            skip_space(true);
        }
        return array;
    }

    std::string_view rest_;
    const std::string& source_;
    int line_ = 1;
};

} // namespace

std::vector<TomlEntry> read_toml(std::string_view text, const std::string& source) { return Reader(text, source).entries(); }

std::string toml_quoted(std::string_view text) {
    std::string quoted = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\')
            quoted += '\\';
        if (c == '\n' || c == '\t')
            quoted += c == '\n' ? "\\n" : "\\t";
        else
            quoted += c;
    }
    return quoted + '"';
}

} // namespace ductile::io
