// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/config_file.hpp>
#include <ductile/io/interrupt.hpp>
#include <ductile/io/program.hpp>
#include <ductile/io/text.hpp>
#include <ductile/io/version.hpp>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <new>

namespace ductile::io {

std::string Program::config_text(std::size_t options) const {
    // lines of a file, wherever it is read
    const auto comment = [](const std::string& text) { return wrapped(text, 100, "# ") + "\n"; };
    std::string config =
        fmt::format("# {}, ductile {}: all options with their values.\n{}", name_, version(), comment(description_));
    if (!carrier_.empty())
        config +=
            fmt::format("\n# grid: quasi-static, on a grid that stays; points: material points\ncarrier=\"{}\"\n", carrier_);
    const auto shown = [&](const Declared& declared) {
        return &declared < declared_.data() + options || declared.help.group == general;
    };
    std::vector<std::string> groups;
    for (const Declared& declared : declared_)
        if (shown(declared) && std::ranges::find(groups, declared.help.group) == groups.end())
            groups.push_back(declared.help.group);
    for (const std::string& group : groups) {
        config += fmt::format("\n# {}\n", group);
        for (const Declared& declared : declared_)
            if (shown(declared) && declared.help.group == group)
                config += fmt::format("\n{}{}={}\n", comment(declared.help_lines()), declared.key, declared.toml_value());
    }
    if (visit_) {
        Tables tables;
        visit_(tables);
        config += tables.text();
    }
    return config;
}

namespace {

nlohmann::ordered_json to_json(const ConfigNode& node) {
    if (node.is_array()) {
        auto array = nlohmann::ordered_json::array();
        for (const ConfigNode& child : node.children)
            array.push_back(to_json(child));
        return array;
    }
    if (node.is_table()) {
        auto object = nlohmann::ordered_json::object();
        for (const ConfigNode& child : node.children)
            object[child.key] = to_json(child);
        return object;
    }
    return node.kind == ConfigNode::Kind::quoted ? nlohmann::ordered_json(node.text) : nlohmann::ordered_json::parse(node.text);
}

} // namespace

nlohmann::ordered_json Program::parameters() const { return to_json(read_config(config_text(), name_)); }

std::optional<CheckpointReader> Program::open_restart(int format) const {
    if (common_.restart.empty())
        return std::nullopt;
    return CheckpointReader(common_.restart, name_, format);
}

void Program::say(const std::string& text) const {
    if (common_.quiet)
        return;
    // Nobody may read on: run_main() tells of that, and SIGPIPE ends the run in good order.
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
}

int Program::run(const std::function<RunStatus(const OutputFolder&, RunSummary&)>& body,
                 const std::vector<std::string>& warnings) const {
    install_signal_handlers();
    const OutputFolder folder(common_.output, common_.restart);
    if (folder.earlier_run_moved_to())
        say(fmt::format("{} held an earlier run, which is now in {}\n", folder.path().string(),
                        folder.earlier_run_moved_to()->string()));
    RunSummary summary;
    summary.program = name_;
    summary.version = version();
    summary.parameters = parameters();
    summary.warnings = warnings;
    for (const std::string& warning : warnings)
        say(warning_line(warning, terminal_columns(STDOUT_FILENO).value_or(0)));
    const auto start = std::chrono::steady_clock::now();
    const auto write = [&] {
        summary.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        summary.processor_seconds = processor_seconds();
        summary.peak_memory_bytes = peak_memory_bytes();
        write_summary(folder.summary(), summary);
    };
    try {
        summary.status = body(folder, summary);
    } catch (const std::exception& error) {
        summary.status = RunStatus::failed;
        summary.reason = error.what();
        try {
            write();
        } catch (const Error&) {
            // The failure that ended the run is the one to tell.
        }
        throw;
    }
    write();
    say(fmt::format("\n{}", describe(summary, folder.path(), terminal_columns(STDOUT_FILENO).value_or(0))));
    if (!summary.drawing.empty())
        say(fmt::format("\n{}", summary.drawing));
    return summary.status == RunStatus::interrupted ? interrupted_exit_status : 0;
}

int run_main(const std::function<int()>& body) {
    const auto report = [](const std::string& message, int status) {
        std::fflush(stdout);
        fmt::print(stderr, "error: {}\n", message);
        return status;
    };
    try {
        const int status = body();
        if (status != interrupted_exit_status && (std::fflush(stdout) != 0 || std::ferror(stdout) != 0))
            return report("cannot write to the standard output", 1);
        return status;
    } catch (const Error& error) {
        return report(error.what(), error.exit_status());
    } catch (const std::bad_alloc&) {
        return report("there is not enough memory: use fewer cells or particles", 1);
    } catch (const std::exception& error) {
        return report(error.what(), 1);
    }
}

} // namespace ductile::io
