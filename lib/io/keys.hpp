// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/config_file.hpp>
#include <ductile/io/option_values.hpp>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace ductile::io {

/// Whether a run that goes on from a checkpoint may change an option. Only those may be changed that leave the meaning of the
/// stored state alone: when and where to stop and write, how steps are taken and solved.
enum class Restart { keeps, may_change };

/// Where a value comes from, the strongest first.
enum class Source { command_line, config, scene_file, checkpoint, declaration };

/// A word that stands for a value, and what it means, where that is not plain.
template <class Value> struct Choice {
    std::string word;
    Value value;
    std::string meaning = {};
};

/// Words that stand for themselves.
[[nodiscard]] std::vector<Choice<std::string>> plain_words(const std::vector<std::string>& words);

/// What a reader of --help and --print-config learns about a key.
struct OptionHelp {
    std::string group;
    std::string meaning;
    std::string units = {};           ///< SI units, empty for pure numbers
    Limits allowed = any_number;      ///< for numbers, and for each number of a list
    Restart restart = Restart::keeps; ///< an option belongs to the scene unless it says otherwise
    bool required = false;            ///< in a table of a scene file
};

/// Keys bound to variables, which must outlive them: the options of a program, or a table of a scene file. One declaration serves
/// command line, files, --print-config, --help and the comparison with a checkpoint.
class Keys {
public:
    /// To be given values later.
    Keys() = default;
    /// A table of a file, `place` in messages: each key takes its value when it is declared, so that a later declaration may
    /// depend on an earlier value. Paths in it are relative to the file's folder.
    Keys(const ConfigNode& table, std::string source, std::string place);

    /// `key` may be written as the option that it is, `--a-name`. In a table these throw InputError, with source and line, for a
    /// value that is not allowed and a required key that is missing.
    void option(const std::string& key, double& value, const OptionHelp& help);
    void option(const std::string& key, int& value, const OptionHelp& help);
    void option(const std::string& key, std::int64_t& value, const OptionHelp& help);
    void option(const std::string& key, bool& value, const OptionHelp& help);
    void option(const std::string& key, std::string& value, const OptionHelp& help);
    void option(const std::string& key, std::filesystem::path& value, const OptionHelp& help);
    void option(const std::string& key, CellCount& value, const OptionHelp& help);
    void option(const std::string& key, std::vector<double>& value, const OptionHelp& help);
    /// A file to be read; one that a file names is looked for beside it.
    void input_file(const std::string& key, std::filesystem::path& value, const OptionHelp& help);
    /// A number, or the word auto.
    void number_or_auto(const std::string& key, std::string& value, const OptionHelp& help);
    /// One of a few words.
    template <class Value>
    void choice(const std::string& key, Value& value, const std::vector<Choice<Value>>& choices, const OptionHelp& help);
    using Text = std::function<std::string()>;
    using Convert = std::function<void(const std::string&)>;
    /// A value of another form, which `text` writes as TOML (empty: none) and `convert` reads, or throws InputError.
    void toml(const std::string& key, const OptionHelp& help, const std::string& allowed, Text text, Convert convert);

    /// Throws InputError for a key of the table that nobody declared.
    void refuse_unknown() const;
    /// Whether a key has the value it was declared with.
    [[nodiscard]] bool has_default(const std::string& key) const;
    [[nodiscard]] Source source(const std::string& key) const;

protected:
    friend class Tables;
    using Meanings = std::vector<std::pair<std::string, std::string>>; // of words
    enum class Kind { number, integer, boolean, text, path, cells, number_list, number_or_auto, toml };
    struct Declared {
        std::string key;
        Kind kind;
        OptionHelp help;
        std::string allowed;
        Text text; ///< the variable's value
        Convert convert;
        Meanings meanings;
        std::string default_text;
        Source source = Source::declaration;

        [[nodiscard]] bool given() const { return source != Source::declaration; }
        /// "meaning [units]; allowed"
        [[nodiscard]] std::string description() const;
        /// The same with the default, and a line with two spaces at its head for each word that has a meaning of its own.
        [[nodiscard]] std::string help_lines() const;
        /// The value as TOML writes it; empty if it has none.
        [[nodiscard]] std::string toml_value() const;
        /// The text that a value of a file stands for. Throws InputError for a value of the wrong form.
        [[nodiscard]] std::string text_of(const ConfigNode& node) const;
    };

    [[nodiscard]] Declared* find(const std::string& key);
    [[nodiscard]] std::vector<std::string> names(const std::string& prefix = {}) const;

    std::vector<Declared> declared_;
    std::filesystem::path folder_; // of the file whose values are being taken

private:
    void declare(const std::string& key, Kind kind, const OptionHelp& help, const std::string& allowed, Text text,
                 Convert convert, Meanings meanings = {});
    void choose(const std::string& key, const Meanings& words, const OptionHelp& help, Text text, const Convert& convert);

    const ConfigNode* table_ = nullptr;
    std::string source_, place_;
};

template <class Value>
void Keys::choice(const std::string& key, Value& value, const std::vector<Choice<Value>>& choices, const OptionHelp& help) {
    Meanings words;
    for (const Choice<Value>& choice : choices)
        words.emplace_back(choice.word, choice.meaning);
    const auto word_of_value = [&value, choices] {
        const auto found = std::ranges::find(choices, value, &Choice<Value>::value);
        return found == choices.end() ? std::string() : found->word; // none yet, where a key is required
    };
    const auto take = [&value, choices](const std::string& word) {
        value = std::ranges::find(choices, word, &Choice<Value>::word)->value;
    };
    choose(key, words, help, word_of_value, take);
}

/// Throws InputError for a text that checkpoints and summaries cannot keep.
void check_storable(const std::string& text);
/// For messages: what a terminal would not show.
[[nodiscard]] std::string visible(const std::string& text);

} // namespace ductile::io
