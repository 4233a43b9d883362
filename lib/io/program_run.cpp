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

std::string Program::config_text() const {
    std::string config = fmt::format("# {}, ductile {}: all options with their values.\n# {}\n", name_, version(), description_);
    std::vector<std::string> groups;
    for (const Declared& declared : declared_)
        if (std::ranges::find(groups, declared.option->get_group()) == groups.end())
            groups.push_back(declared.option->get_group());
    for (const std::string& group : groups) {
        config += fmt::format("\n# {}\n", group);
        for (const Declared& declared : declared_)
            if (declared.option->get_group() == group)
                config += fmt::format("\n# {}\n{}={}\n", declared.option->get_description(), declared.key, toml_value(declared));
    }
    return config;
}

bool Program::has_default(const std::string& flag) const {
    const auto declared = std::ranges::find(declared_, flag.substr(2), &Declared::key);
    return declared->text() == declared->default_text;
}

std::string Program::toml_value(const Declared& declared) {
    const std::string text = declared.text();
    switch (declared.kind) {
    case Kind::number:
    case Kind::integer:
    case Kind::boolean:
        return text;
    case Kind::number_list:
        return fmt::format("[{}]", text);
    case Kind::number_or_auto:
        return text == "auto" ? toml_quoted(text) : to_text(parse_number(text));
    case Kind::text:
    case Kind::cells:
        break;
    }
    return toml_quoted(text);
}

nlohmann::ordered_json Program::parameters() const {
    nlohmann::ordered_json json = nlohmann::ordered_json::object();
    for (const Declared& declared : declared_) {
        const std::string text = declared.text();
        switch (declared.kind) {
        case Kind::number:
            json[declared.key] = parse_number(text);
            break;
        case Kind::integer:
            json[declared.key] = parse_integer(text);
            break;
        case Kind::boolean:
            json[declared.key] = text == "true";
            break;
        case Kind::number_list:
            json[declared.key] = parse_number_list(text);
            break;
        case Kind::text:
        case Kind::cells:
        case Kind::number_or_auto:
            json[declared.key] = text;
            break;
        }
    }
    return json;
}

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
        say(warning_line(warning));
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
    say(fmt::format("\n{}", describe(summary, folder.path())));
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
