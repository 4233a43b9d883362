// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/base/threads.hpp>
#include <ductile/io/nearest_name.hpp>
#include <ductile/io/program.hpp>
#include <ductile/io/text.hpp>
#include <ductile/io/version.hpp>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>
#include <unistd.h>

namespace ductile::io {
namespace {

std::string read_whole(const std::string& path) {
    try {
        return read_config_file(path);
    } catch (const InputError& error) {
        throw InputError(fmt::format("--config {}", error.what()));
    }
}

/// Columns of the help: those of the terminal, or what COLUMNS says, or 100, but no more than are good to read.
std::size_t help_columns() {
    constexpr std::size_t fewest = 60, usual = 100, most = 120;
    if (const auto columns = terminal_columns(STDOUT_FILENO))
        return std::clamp(*columns, fewest, most);
    const char* const told = std::getenv("COLUMNS");
    const long columns = told != nullptr ? std::strtol(told, nullptr, 10) : 0;
    return columns > 0 ? std::clamp(static_cast<std::size_t>(columns), fewest, most) : usual;
}

/// Names of options on the left, what they mean on the right, broken between words.
class HelpFormatter final : public CLI::Formatter {
public:
    explicit HelpFormatter(std::size_t columns) : columns_(columns) {}

    std::string make_option(const CLI::Option* option, bool is_positional) const override {
        constexpr std::size_t left = 34;
        const std::string name = "  " + make_option_name(option, is_positional) + make_option_opts(option);
        const std::string margin(left, ' ');
        const std::string text = wrapped(make_option_desc(option), columns_, margin) + "\n";
        return name.size() < left ? name + text.substr(name.size()) : name + "\n" + text;
    }

    std::string make_description(const CLI::App* app) const override { return wrapped(app->get_description(), columns_) + "\n"; }

private:
    std::size_t columns_;
};

} // namespace

Program::Program(std::string name, std::string description, Checkpoints checkpoints)
    : name_(std::move(name)), description_(std::move(description)), checkpoints_(checkpoints),
      app_(std::make_unique<CLI::App>(description_, name_)) {
    common_.output = std::filesystem::path("out") / name_;
    common_.threads = thread_count();
    app_->set_help_flag(); // declared last, with the other general options
    app_->formatter(std::make_shared<HelpFormatter>(help_columns()));
}

Program::~Program() = default;

void Program::writes_scene(std::string carrier, Visit visit) {
    carrier_ = std::move(carrier);
    visit_ = std::move(visit);
    own_ = declared_.size();
}

void Program::reads_scene(std::string carrier, Visit visit, std::filesystem::path file) {
    writes_scene(std::move(carrier), std::move(visit));
    reads_tables_ = true;
    scene_file_ = std::move(file);
    if (!scene_file_.empty())
        common_.output = std::filesystem::path("out") / scene_file_.stem();
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
}

/// To the command line.
void Program::offer_options() {
    constexpr std::array<const char*, 9> types = {"NUMBER", "N", "", "TEXT", "PATH", "N|MxN", "A,B,...", "NUMBER|auto", "TOML"};
    for (Declared& declared : declared_) {
        const std::string flag = "--" + declared.key;
        const std::string shown = declared.help_lines();
        const auto callback = [&declared, flag](const CLI::results_t& results) {
            try {
                declared.convert(results.back());
            } catch (const InputError& error) {
                throw InputError(fmt::format("{} {}: {}", flag, visible(results.back()), error.what()));
            }
            declared.source = Source::command_line;
            return true;
        };
        CLI::Option* option =
            declared.kind == Kind::boolean ? app_->add_flag(flag, shown) : app_->add_option(flag, callback, shown);
        if (declared.kind == Kind::boolean)
            option->each([callback](const std::string& word) { callback({word}); });
        option->option_text(types[static_cast<std::size_t>(declared.kind)])->group(declared.help.group)->take_last();
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
    offer_options();
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
        apply_config(read_config(read_whole(*file), *file), Source::config, *file, false, {});
    apply_tables();
    if (common_.output.empty())
        throw InputError("--output: it must name a folder");
    set_thread_count(common_.threads);
    if (app_->count("--print-config") > 0) {
        fmt::print("{}", config_text(carrier_.empty() ? declared_.size() : own_));
        return false;
    }
    return true;
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

void Program::apply_config(const ConfigNode& config, Source source, const std::string& file, bool with_tables,
                           const std::vector<std::string>& skipped_keys) {
    for (const ConfigNode& entry : config.children) {
        const std::string where = fmt::format("{}, line {}: ", file, entry.line);
        Declared* found = find(entry.key);
        if (found == nullptr && entry.key == "carrier" && !carrier_.empty()) {
            if (entry.text != carrier_)
                throw InputError(fmt::format("{}carrier = {}: here it is {}; ./ductile scene FILE runs the scenes of both", where,
                                             to_toml(entry), carrier_));
            continue;
        }
        if (found == nullptr &&
            (entry.is_table() || (entry.is_array() && !entry.children.empty() && entry.children.front().is_table()))) {
            if (!with_tables)
                throw InputError(
                    fmt::format("{}tables are not used here ('{}'), all keys stand at the top level, as key = value: "
                                "it is ./ductile scene FILE that runs a scene with tables",
                                where, entry.key));
            continue;
        }
        if (found == nullptr)
            throw InputError(fmt::format("{}unknown key '{}'{}: {} --print-config lists all keys", where, visible(entry.key),
                                         did_you_mean(entry.key, names()), name_));
        if (found->given() || std::ranges::find(skipped_keys, entry.key) != skipped_keys.end())
            continue;
        std::string text;
        try {
            text = found->text_of(entry);
        } catch (const InputError& error) {
            throw InputError(where + error.what());
        }
        try {
            found->convert(text);
            found->source = source;
        } catch (const InputError& error) {
            throw InputError(fmt::format("{}--{} {}: {}", where, entry.key, visible(text), error.what()));
        }
    }
}

/// Of what belongs to the scene and was given, the checkpoint must have the same.
void Program::require_same_scene(const ConfigNode& config) {
    const std::string source = common_.restart.string();
    std::vector<std::string> differences;
    const auto compare = [&](const std::string& name, const std::string& stored, const std::string& asked) {
        if (stored != asked)
            differences.push_back(fmt::format("{}: the checkpoint has {}, this run asks for {}", name,
                                              stored.empty() ? "none" : stored, asked.empty() ? "none" : asked));
    };
    for (const ConfigNode& entry : config.children) {
        Declared* found = find(entry.key);
        if (found == nullptr || found->help.restart == Restart::may_change || !found->given())
            continue;
        const std::string asked = found->text();
        found->convert(found->text_of(entry));
        compare("--" + entry.key, found->text(), asked);
    }
    if (!scene_file_.empty() && visit_) {
        Tables asked, reader(config, source), stored;
        visit_(asked);
        visit_(reader);
        visit_(stored);
        const auto value = [](const Tables& tables, const std::string& name) {
            const auto found = std::ranges::find(tables.entries(), name, &std::pair<std::string, std::string>::first);
            return found == tables.entries().end() ? std::string() : found->second;
        };
        for (const auto& [name, text] : stored.entries())
            compare(name, text, value(asked, name));
        for (const auto& [name, text] : asked.entries())
            if (value(stored, name).empty())
                compare(name, "", text);
    }
    if (!differences.empty())
        throw InputError(
            fmt::format("{}: the state in it belongs to another scene: {}; leave that out to go on, or start a new run", source,
                        fmt::join(differences, "; ")));
}

void Program::apply_tables() {
    ConfigNode scene;
    const std::string file = scene_file_.string();
    if (!file.empty()) {
        scene = read_config(read_config_file(file), file);
        folder_ = scene_file_.parent_path();
        apply_config(scene, Source::scene_file, file, reads_tables_ && visit_, {});
        if (visit_) {
            Tables tables(scene, file);
            visit_(tables);
            tables.refuse_unknown();
        }
    }
    if (!common_.restart.empty())
        apply_restart();
}

void Program::apply_restart() {
    const CheckpointReader checkpoint(common_.restart, name_);
    const ConfigNode config = read_config(checkpoint.config(), common_.restart.string());
    require_same_scene(config);
    apply_config(config, Source::checkpoint, common_.restart.string(), true, {"restart", "output", "quiet"});
    if (reads_tables_ && visit_) {
        Tables tables(config, common_.restart.string());
        visit_(tables);
    }
    if (!find("output")->given())
        common_.output = common_.restart.has_parent_path() ? common_.restart.parent_path() : ".";
}

} // namespace ductile::io
