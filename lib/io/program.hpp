#pragma once
#include <ductile/io/checkpoint.hpp>
#include <ductile/io/option_values.hpp>
#include <ductile/io/output_folder.hpp>
#include <ductile/io/summary.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace CLI {
class App;
class Option;
} // namespace CLI

namespace ductile::io {

/// Whether a run that goes on from a checkpoint may change an option. Only those may be changed that leave the meaning of the
/// stored state alone: when and where to stop and write, how steps are taken and solved.
enum class Restart { keeps, may_change };

/// What a reader of --help and --print-config learns about an option.
struct OptionHelp {
    std::string group;
    std::string meaning;
    std::string units = {};           ///< SI units, empty for pure numbers
    Limits allowed = any_number;      ///< for numbers, and for each number of a list
    Restart restart = Restart::keeps; ///< an option belongs to the scene unless it says otherwise
};

/// Values of the options that every program has.
struct CommonOptions {
    std::filesystem::path output; ///< default: out/<program>; for a continued run the checkpoint's folder
    std::filesystem::path restart;
    int threads = 1;
    double checkpoint_every_s = 600.0; ///< wall time
    bool quiet = false;
};

/// What all programs share: options from command line, configuration file and checkpoint, and the frame of a run.
///
/// An option given on the command line goes before --config (of several files the last goes first), which goes before the options
/// stored in the --restart checkpoint, which (but for the place and the silence of that run) go before the defaults (the values
/// variables have when they are declared). What belongs to the scene is refused where it differs from the checkpoint's. Every
/// option
/// `--a-name` has the TOML key `a-name`. No option is ever required; check combinations after parse().
class Program {
public:
    /// Whether the runs of a program write checkpoints and go on from them; if not, it has no options about them.
    enum class Checkpoints { written, none };

    Program(std::string name, std::string description, Checkpoints checkpoints = Checkpoints::written);
    ~Program();
    Program(const Program&) = delete;
    Program& operator=(const Program&) = delete;

    /// Declares an option `--a-name` bound to a variable, which must outlive the program object.
    void option(const std::string& flag, double& value, const OptionHelp& help);
    void option(const std::string& flag, int& value, const OptionHelp& help);
    void option(const std::string& flag, std::int64_t& value, const OptionHelp& help);
    void option(const std::string& flag, bool& value, const OptionHelp& help);
    void option(const std::string& flag, std::string& value, const OptionHelp& help);
    void option(const std::string& flag, std::filesystem::path& value, const OptionHelp& help);
    void option(const std::string& flag, CellCount& value, const OptionHelp& help);
    void option(const std::string& flag, std::vector<double>& value, const OptionHelp& help);
    /// A number, or the word auto.
    void number_or_auto(const std::string& flag, std::string& value, const OptionHelp& help);
    /// One of a few words.
    void choice(const std::string& flag, std::string& value, const std::vector<std::string>& words, const OptionHelp& help);
    /// One of a few words that stand for values of an enumeration.
    template <class Enum>
    void choice(const std::string& flag, Enum& value, const std::vector<std::pair<std::string, Enum>>& table,
                const OptionHelp& help);

    /// Reads all options. Returns false when --help, --version or --print-config was asked for and answered.
    /// Throws InputError, naming the option (or file and line) and what is allowed. Sets the number of threads.
    [[nodiscard]] bool parse(int argc, const char* const* argv);

    [[nodiscard]] const std::string& name() const { return name_; }
    /// Whether an option has the value it was declared with.
    [[nodiscard]] bool has_default(const std::string& flag) const;
    [[nodiscard]] const CommonOptions& common() const { return common_; }
    /// All options, their values and meanings: a valid configuration file that reproduces the run.
    [[nodiscard]] std::string config_text() const;
    /// All options and their values by key.
    [[nodiscard]] nlohmann::ordered_json parameters() const;

    /// The checkpoint to go on from, if --restart was given. Throws InputError unless it fits this program and format.
    [[nodiscard]] std::optional<CheckpointReader> open_restart(int format) const;

    /// Prints to the standard output unless --quiet.
    void say(const std::string& text) const;

    /// The frame of a run: claims the output folder, installs the signal handlers, calls `body`, and whatever happens writes
    /// summary.json; prints the summary. `body` gets the folder and a summary to fill in, and returns completed or interrupted.
    /// `warnings`, what is doubtful before the first step, are said at once and begin those of the summary.
    /// Returns the exit status; exceptions go on to run_main() once the summary says "failed".
    [[nodiscard]] int run(const std::function<RunStatus(const OutputFolder&, RunSummary&)>& body,
                          const std::vector<std::string>& warnings = {}) const;

private:
    enum class Kind { number, integer, boolean, text, cells, number_list, number_or_auto };
    struct Declared {
        std::string key;
        Kind kind;
        std::function<std::string()> text; ///< the variable's value
        std::string default_text;
        CLI::Option* option;
        Restart restart;
    };
    static std::string toml_value(const Declared& declared);

    using Text = std::function<std::string()>;
    using Convert = std::function<void(const std::string&)>;

    CLI::Option* declare(const std::string& flag, Kind kind, const OptionHelp& help, const std::string& allowed, Text text,
                         const Convert& convert);
    void choose(const std::string& flag, const std::vector<std::string>& words, const OptionHelp& help, Text text,
                const Convert& convert);
    void declare_common();
    [[nodiscard]] std::vector<std::string> names(const std::string& prefix) const;
    void refuse_unknown_arguments() const;
    void apply_config(const std::string& text, const std::string& source, const std::vector<std::string>& skipped_keys);
    void apply_restart();
    void require_same_scene(const std::string& config) const;

    std::string name_, description_;
    Checkpoints checkpoints_;
    CommonOptions common_;
    std::vector<std::string> config_files_;
    std::unique_ptr<CLI::App> app_;
    std::vector<Declared> declared_;
};

template <class Enum>
void Program::choice(const std::string& flag, Enum& value, const std::vector<std::pair<std::string, Enum>>& table,
                     const OptionHelp& help) {
    std::vector<std::string> names;
    for (const auto& entry : table)
        names.push_back(entry.first);
    const auto word_of_value = [&value, table] {
        return std::ranges::find(table, value, &std::pair<std::string, Enum>::second)->first;
    };
    const auto take = [&value, table](const std::string& word) {
        value = std::ranges::find(table, word, &std::pair<std::string, Enum>::first)->second;
    };
    choose(flag, names, help, word_of_value, take);
}

/// The whole of a main function: calls `body`, turns every exception into "error: ..." on the standard error stream, and
/// returns the exit status: that of `body`, 2 for bad input, 1 for a failed run.
[[nodiscard]] int run_main(const std::function<int()>& body);

} // namespace ductile::io
