// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/checkpoint.hpp>
#include <ductile/io/keys.hpp>
#include <ductile/io/output_folder.hpp>
#include <ductile/io/summary.hpp>
#include <ductile/io/tables.hpp>

#include <nlohmann/json.hpp>

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
} // namespace CLI

namespace ductile::io {

/// Values of the options that every program has.
struct CommonOptions {
    std::filesystem::path output; ///< default: `out/PROGRAM`; for a continued run the checkpoint's folder
    std::filesystem::path restart;
    int threads = 1;
    double checkpoint_every_s = 600.0; ///< wall time
    bool quiet = false;
};

/// What all programs share: options from command line, configuration or scene file and checkpoint, and the frame of a run.
///
/// An option given on the command line goes before --config (of several files the last goes first), which goes before a scene
/// file, which goes before the options stored in the --restart checkpoint, which (but for the place and the silence of that run)
/// go before the defaults (the values variables have when they are declared). What belongs to the scene, its tables included, is
/// refused where it differs from the checkpoint's. Every option `--a-name` has the TOML key `a-name`. No option is ever required;
/// check combinations after parse().
class Program : public Keys {
public:
    /// Whether the runs of a program write checkpoints and go on from them; if not, it has no options about them.
    enum class Checkpoints { written, none };

    Program(std::string name, std::string description, Checkpoints checkpoints = Checkpoints::written);
    ~Program();
    Program(const Program&) = delete;
    Program& operator=(const Program&) = delete;

    /// What a scene has besides options: tables, which `visit` reads or writes, empty if there are none.
    using Visit = std::function<void(Tables&)>;
    /// --print-config writes a scene file of this carrier. Options declared from here on are the program's own: the tables say
    /// what they come to. `visit` is called once all options are known.
    void writes_scene(std::string carrier, Visit visit);
    /// Options and tables are those of a scene file of this carrier; without a file those of the checkpoint.
    void reads_scene(std::string carrier, Visit visit, std::filesystem::path file);

    /// Reads all options. Returns false when --help, --version or --print-config was asked for and answered.
    /// Throws InputError, naming the option (or file and line) and what is allowed. Sets the number of threads.
    [[nodiscard]] bool parse(int argc, const char* const* argv);

    [[nodiscard]] const std::string& name() const { return name_; }
    [[nodiscard]] const CommonOptions& common() const { return common_; }
    /// All options and tables, their values and meanings: what a checkpoint keeps.
    [[nodiscard]] std::string config_text() const { return config_text(declared_.size()); }
    /// All options and tables, their values by key.
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
    static constexpr const char* general = "General"; // the group of options that every program has

    [[nodiscard]] std::string config_text(std::size_t options) const;
    void declare_common();
    void offer_options();
    void refuse_unknown_arguments() const;
    /// Options that already have a value keep it: sources are read from the strongest to the weakest. `file` is for messages.
    void apply_config(const ConfigNode& config, Source source, const std::string& file, bool with_tables,
                      const std::vector<std::string>& skipped_keys);
    void apply_restart();
    void apply_tables();
    void require_same_scene(const ConfigNode& config);

    std::string name_, description_;
    Checkpoints checkpoints_;
    CommonOptions common_;
    std::vector<std::string> config_files_;
    std::string carrier_; // empty: not a scene's
    Visit visit_;
    bool reads_tables_ = false;
    std::size_t own_ = 0; // place of the first of the program's own options
    std::filesystem::path scene_file_;
    std::unique_ptr<CLI::App> app_;
};

/// The whole of a main function: calls `body`, turns every exception into "error: ..." on the standard error stream, and
/// returns the exit status: that of `body`, 2 for bad input, 1 for a failed run.
[[nodiscard]] int run_main(const std::function<int()>& body);

} // namespace ductile::io
