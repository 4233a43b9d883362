// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/io/atomic_file.hpp>
#include <ductile/io/summary.hpp>
#include <ductile/io/text.hpp>
#include <ductile/io/version.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <sys/resource.h>

namespace ductile::io {
namespace {

const char* name(RunStatus status) {
    switch (status) {
    case RunStatus::completed:
        return "completed";
    case RunStatus::interrupted:
        return "interrupted";
    case RunStatus::failed:
        break;
    }
    return "failed";
}

using Counts = std::array<std::pair<const char*, std::int64_t>, 8>;

Counts counts(const RunSummary& summary) {
    return {{{"steps", summary.steps},
             {"rejected_steps", summary.rejected_steps},
             {"elliptic_solves", summary.elliptic_solves},
             {"pointwise_substeps", summary.pointwise_substeps},
             {"newton_iterations", summary.newton_iterations},
             {"linear_iterations", summary.linear_iterations},
             {"residual_evaluations", summary.residual_evaluations},
             {"jacobian_products", summary.jacobian_products}}};
}

std::string files_in(const std::filesystem::path& folder) {
    std::string found;
    for (const char* file : {"summary.json", "history.csv", "work_precision.csv", "fields.h5", "fields.xdmf", "checkpoint.h5"})
        if (std::filesystem::exists(folder / file))
            found += (found.empty() ? "" : ", ") + std::string(file);
    return fmt::format("{} ({})", folder.string(), found);
}

/// "load_N": 3.5 as "load" and "3.5 N".
std::pair<std::string, std::string> readable(std::string key, const nlohmann::ordered_json& value) {
    std::string text = value.is_number_float() ? fmt::format("{:.6g}", value.get<double>())
                       : value.is_string()     ? value.get<std::string>()
                                               : value.dump();
    for (const char* unit : {"_s", "_m", "_N", "_Pa", "_K", "_J", "_rad"})
        if (key.ends_with(unit)) {
            text += fmt::format(" {}", unit + 1);
            key.resize(key.rfind('_'));
        }
    std::ranges::replace(key, '_', ' ');
    return {key, text};
}

} // namespace

nlohmann::ordered_json to_json(const RunSummary& summary) {
    nlohmann::ordered_json json;
    json["program"] = summary.program;
    json["version"] = summary.version;
    json["commit"] = commit();
    json["compiler"] = compiler();
    json["machine"] = machine();
    json["status"] = name(summary.status);
    if (!summary.reason.empty())
        json["reason"] = summary.reason;
    json["warnings"] = summary.warnings;
    for (const auto& [key, count] : counts(summary))
        json[key] = count;
    json["wall_seconds"] = summary.wall_seconds;
    json["processor_seconds"] = summary.processor_seconds;
    json["phase_seconds"] = nlohmann::ordered_json::object();
    for (const auto& [phase, seconds] : summary.phase_seconds)
        json["phase_seconds"][phase] = seconds;
    json["peak_memory_bytes"] = summary.peak_memory_bytes;
    json["extra"] = summary.extra;
    json["parameters"] = summary.parameters;
    return json;
}

void write_summary(const std::filesystem::path& path, const RunSummary& summary) {
    constexpr auto replace_invalid_utf8 = nlohmann::ordered_json::error_handler_t::replace;
    write_text_atomically(path, to_json(summary).dump(2, ' ', false, replace_invalid_utf8) + "\n");
}

std::string describe(const RunSummary& summary, const std::filesystem::path& folder, std::size_t columns) {
    LabelledLines lines;
    for (const auto& [key, count] : counts(summary))
        if (count != 0)
            lines.push_back(readable(key, count));
    for (const auto& [key, value] : summary.extra.items())
        if (value != 0)
            lines.push_back(readable(key, value));
    lines.emplace_back("wall time", human_duration(summary.wall_seconds));
    for (const auto& [phase, seconds] : summary.phase_seconds)
        lines.emplace_back("  " + phase, fmt::format("{} ({:.0f} %)", human_duration(seconds),
                                                     100.0 * seconds / std::max(summary.wall_seconds, 1e-9)));
    lines.emplace_back("peak memory", human_bytes(static_cast<double>(summary.peak_memory_bytes)));
    lines.emplace_back("files", files_in(folder));
    std::string text = aligned_lines(fmt::format("{}: {}", summary.program, name(summary.status)), lines);
    for (const std::string& warning : summary.warnings)
        text += warning_line(warning, columns);
    return text;
}

double processor_seconds() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

std::int64_t peak_memory_bytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::int64_t>(usage.ru_maxrss) * 1024;
}

} // namespace ductile::io
