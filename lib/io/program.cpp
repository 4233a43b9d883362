#include <ductile/base/error.hpp>
#include <ductile/base/threads.hpp>
#include <ductile/io/config_file.hpp>
#include <ductile/io/nearest_name.hpp>
#include <ductile/io/program.hpp>
#include <ductile/io/version.hpp>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <fstream>
#include <iterator>

namespace ductile::io {
namespace {

constexpr const char* general = "General";

/// Checkpoints and summaries keep every option as text.
void check_storable(const std::string& text) {
    try {
        (void)read_config("text = " + toml_quoted(text), "");
    } catch (const InputError&) {
        throw InputError("it must be UTF-8 text without control characters");
    }
}

/// For messages: what a terminal would not show.
std::string visible(const std::string& text) {
    std::string result;
    for (const char c : text)
        result += static_cast<unsigned char>(c) < ' ' ? fmt::format("\\x{:02x}", c) : std::string(1, c);
    return result;
}

std::string read_whole(const std::filesystem::path& path) {
    std::ifstream file(path);
    if (!file || std::filesystem::is_directory(path))
        throw InputError(fmt::format("--config {}: the file cannot be read", path.string()));
    return {std::istreambuf_iterator<char>(file), {}};
}

} // namespace

Program::Program(std::string name, std::string description, Checkpoints checkpoints)
    : name_(std::move(name)), description_(std::move(description)), checkpoints_(checkpoints),
      app_(std::make_unique<CLI::App>(description_, name_)) {
    common_.output = std::filesystem::path("out") / name_;
    common_.threads = thread_count();
    app_->set_help_flag(); // declared last, with the other general options
    app_->get_formatter()->column_width(34);
}

Program::~Program() = default;

CLI::Option* Program::declare(const std::string& flag, Kind kind, const OptionHelp& help, const std::string& allowed, Text text,
                              const Convert& convert) {
    const std::string units = help.units.empty() ? "" : fmt::format(" [{}]", help.units);
    const std::string range = allowed.empty() ? "" : fmt::format("; {}", allowed);
    const auto callback = [flag, convert](const CLI::results_t& results) {
        try {
            convert(results.back());
        } catch (const InputError& error) {
            throw InputError(fmt::format("{} {}: {}", flag, visible(results.back()), error.what()));
        }
        return true;
    };
    constexpr std::array<const char*, 7> types = {"NUMBER", "N", "", "TEXT", "N|MxN", "A,B,...", "NUMBER|auto"};
    const std::string standard = text().empty() ? "" : fmt::format(" (default {})", text());
    const std::string shown = help.meaning + units + range + standard;
    CLI::Option* option = kind == Kind::boolean ? app_->add_flag(flag, shown) : app_->add_option(flag, callback, shown);
    if (kind == Kind::boolean)
        option->each([callback](const std::string& word) { callback({word}); });
    option->option_text(types[static_cast<std::size_t>(kind)])->group(help.group)->take_last()->run_callback_for_default();
    const std::string default_text = text();
    declared_.push_back({flag.substr(2), kind, std::move(text), default_text, option, help.restart});
    return option;
}

void Program::option(const std::string& flag, double& value, const OptionHelp& help) {
    declare(
        flag, Kind::number, help, help.allowed.describe(), [&value] { return to_text(value); },
        [&value, allowed = help.allowed](const std::string& text) { value = parse_number(text, allowed); });
}

void Program::option(const std::string& flag, int& value, const OptionHelp& help) {
    const auto convert = [&value, allowed = help.allowed](const std::string& text) {
        Limits whole = allowed;
        whole.lowest = std::max(whole.lowest, static_cast<double>(std::numeric_limits<int>::min()));
        whole.highest = std::min(whole.highest, static_cast<double>(std::numeric_limits<int>::max()));
        value = static_cast<int>(parse_integer(text, whole));
    };
    declare(
        flag, Kind::integer, help, help.allowed.describe(), [&value] { return fmt::format("{}", value); }, convert);
}

void Program::option(const std::string& flag, std::int64_t& value, const OptionHelp& help) {
    declare(
        flag, Kind::integer, help, help.allowed.describe(), [&value] { return fmt::format("{}", value); },
        [&value, allowed = help.allowed](const std::string& text) { value = parse_integer(text, allowed); });
}

void Program::option(const std::string& flag, bool& value, const OptionHelp& help) {
    const auto convert = [&value](const std::string& text) {
        if (text != "true" && text != "false")
            throw InputError("it must be true or false");
        value = text == "true";
    };
    declare(
        flag, Kind::boolean, help, "", [&value] { return value ? "true" : "false"; }, convert);
}

void Program::option(const std::string& flag, std::string& value, const OptionHelp& help) {
    declare(
        flag, Kind::text, help, "", [&value] { return value; },
        [&value](const std::string& text) {
            check_storable(text);
            value = text;
        });
}

void Program::option(const std::string& flag, std::filesystem::path& value, const OptionHelp& help) {
    declare(
        flag, Kind::text, help, "", [&value] { return value.string(); },
        [&value](const std::string& text) {
            check_storable(text);
            value = text;
        })
        ->option_text("PATH");
}

void Program::option(const std::string& flag, CellCount& value, const OptionHelp& help) {
    declare(
        flag, Kind::cells, help, "N for both or MxN", [&value] { return to_text(value); },
        [&value](const std::string& text) { value = parse_cell_count(text); });
}

void Program::option(const std::string& flag, std::vector<double>& value, const OptionHelp& help) {
    declare(
        flag, Kind::number_list, help, help.allowed.describe(), [&value] { return to_text(value); },
        [&value, allowed = help.allowed](const std::string& text) { value = parse_number_list(text, allowed); });
}

void Program::number_or_auto(const std::string& flag, std::string& value, const OptionHelp& help) {
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
        flag, Kind::number_or_auto, help, help.allowed.describe(), [&value] { return value; }, convert);
}

void Program::choice(const std::string& flag, std::string& value, const std::vector<std::string>& words, const OptionHelp& help) {
    choose(
        flag, words, help, [&value] { return value; }, [&value](const std::string& word) { value = word; });
}

void Program::choose(const std::string& flag, const std::vector<std::string>& words, const OptionHelp& help, Text text,
                     const Convert& convert) {
    const std::string all = fmt::format("{}", fmt::join(words, ", "));
    const auto check = [words, all, convert](const std::string& word) {
        if (std::ranges::find(words, word) == words.end())
            throw InputError(fmt::format("it must be one of {}{}", all, did_you_mean(word, words)));
        convert(word);
    };
    declare(flag, Kind::text, help, "one of " + all, std::move(text), check);
}

void Program::declare_common() {
    const bool checkpoints = checkpoints_ == Checkpoints::written;
    const auto help = [](std::string meaning, std::string units = {}, Limits allowed = any_number) {
        return OptionHelp{general, std::move(meaning), std::move(units), allowed, Restart::may_change};
    };
    option("--output", common_.output,
           help(std::string("folder for the files of the run") +
                (checkpoints ? "; a continued run stays in the checkpoint's" : "")));
    option("--threads", common_.threads, help("number of threads", "", between(1, 4096)));
    option("--quiet", common_.quiet, help("print errors only"));
    if (checkpoints) {
        option("--restart", common_.restart,
               help("checkpoint.h5 of an earlier run to go on from, with its options; those of the scene cannot be changed"));
        option("--checkpoint-every", common_.checkpoint_every_s, help("wall time between two checkpoints", "s", positive));
    }
    const auto set_config = [this](const CLI::results_t& results) {
        config_files_ = results;
        return true;
    };
    app_->add_option("--config", set_config,
                     "TOML file with options; the command line goes before it, and of several files the last")
        ->option_text("FILE")
        ->type_size(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
        ->configurable(false)
        ->group(general);
    const std::string print_config = "print all options as a TOML file and end";
    app_->add_flag("--print-config", print_config)->configurable(false)->group(general);
    app_->set_version_flag("--version", fmt::format("{} (ductile) {}", name_, version()), "print the version and end")
        ->group(general);
    app_->set_help_flag("-h,--help", "print this help and end")->group(general);
}

bool Program::parse(int argc, const char* const* argv) {
    declare_common();
    app_->allow_extras();
    try {
        app_->parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        fmt::print("{}", app_->help());
        return false;
    } catch (const CLI::CallForVersion& version_text) {
        fmt::print("{}\n", version_text.what());
        return false;
    } catch (const CLI::ParseError& error) {
        throw InputError(fmt::format("{}: {} --help lists all options", error.what(), name_));
    }
    refuse_unknown_arguments();
    for (auto file = config_files_.rbegin(); file != config_files_.rend(); ++file)
        apply_config(read_whole(*file), *file, {});
    if (!common_.restart.empty())
        apply_restart();
    if (common_.output.empty())
        throw InputError("--output: it must name a folder");
    set_thread_count(common_.threads);
    if (app_->count("--print-config") > 0) {
        fmt::print("{}", config_text());
        return false;
    }
    return true;
}

std::vector<std::string> Program::names(const std::string& prefix) const {
    std::vector<std::string> result;
    for (const Declared& declared : declared_)
        result.push_back(prefix + declared.key);
    return result;
}

void Program::refuse_unknown_arguments() const {
    const std::vector<std::string> unknown = app_->remaining();
    if (unknown.empty())
        return;
    const auto option = std::ranges::find_if(unknown, [](const std::string& word) { return word.starts_with('-'); });
    if (option == unknown.end())
        throw InputError(
            fmt::format("'{}' was not expected: options begin with --; {} --help lists all", visible(unknown.front()), name_));
    std::vector<std::string> known = names("--");
    for (const char* more : {"--config", "--print-config", "--version", "--help"})
        known.emplace_back(more);
    const std::string word = option->substr(0, option->find('='));
    throw InputError(
        fmt::format("there is no option {}{}; {} --help lists all", visible(word), did_you_mean(word, known), name_));
}

/// Options that already have a value keep it: sources are read from the strongest to the weakest.
void Program::apply_config(const std::string& text, const std::string& source, const std::vector<std::string>& skipped_keys) {
    for (const ConfigEntry& entry : read_config(text, source)) {
        const std::string where = fmt::format("{}, line {}: ", source, entry.line);
        const auto found = std::ranges::find(declared_, entry.key, &Declared::key);
        if (found == declared_.end())
            throw InputError(fmt::format("{}unknown key '{}'{}: {} --print-config lists all keys", where, visible(entry.key),
                                         did_you_mean(entry.key, names("")), name_));
        if (found->kind != Kind::number_list && entry.is_array)
            throw InputError(fmt::format("{}key '{}' is an array: it must have one value", where, entry.key));
        if (found->option->count() > 0 || std::ranges::find(skipped_keys, entry.key) != skipped_keys.end())
            continue;
        try {
            found->option->add_result(fmt::format("{}", fmt::join(entry.values, ",")));
            found->option->run_callback();
        } catch (const InputError& error) {
            throw InputError(where + error.what());
        }
    }
}

/// Of each option of the scene that was given, the checkpoint must have the same value.
void Program::require_same_scene(const std::string& config) const {
    std::vector<std::string> differences;
    for (const ConfigEntry& entry : read_config(config, common_.restart.string())) {
        const auto found = std::ranges::find(declared_, entry.key, &Declared::key);
        if (found == declared_.end() || found->restart == Restart::may_change || found->option->count() == 0)
            continue;
        const std::string asked = found->text();
        found->option->add_result(fmt::format("{}", fmt::join(entry.values, ",")));
        found->option->run_callback();
        if (const std::string stored = found->text(); stored != asked)
            differences.push_back(fmt::format("--{}: the checkpoint has {}, this run asks for {}", entry.key,
                                              stored.empty() ? "none" : stored, asked.empty() ? "none" : asked));
    }
    if (!differences.empty())
        throw InputError(
            fmt::format("{}: the state in it belongs to another scene: {}; leave that out to go on, or start a new run",
                        common_.restart.string(), fmt::join(differences, "; ")));
}

void Program::apply_restart() {
    const CheckpointReader checkpoint(common_.restart, name_);
    require_same_scene(checkpoint.config());
    apply_config(checkpoint.config(), common_.restart.string(), {"restart", "output", "quiet"});
    if (std::ranges::find(declared_, "output", &Declared::key)->option->count() == 0)
        common_.output = common_.restart.has_parent_path() ? common_.restart.parent_path() : ".";
}

} // namespace ductile::io
