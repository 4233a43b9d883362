// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/timer.hpp>

#include <nlohmann/json.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace ductile::io {

enum class RunStatus { completed, interrupted, failed };

/// What a run did; the content of summary.json. Counts that a scene does not have stay zero.
struct RunSummary {
    std::string program = {};
    std::string version = {};
    nlohmann::ordered_json parameters = nlohmann::ordered_json::object();
    RunStatus status = RunStatus::completed;
    std::string reason = {}; ///< why a run failed
    /// What the run knows to be doubtful about its numbers: each a sentence with a figure and what to change.
    std::vector<std::string> warnings = {};
    std::int64_t steps = 0;
    std::int64_t rejected_steps = 0;
    std::int64_t elliptic_solves = 0;
    std::int64_t pointwise_substeps = 0;
    std::int64_t newton_iterations = 0;
    std::int64_t linear_iterations = 0;
    std::int64_t residual_evaluations = 0;
    std::int64_t jacobian_products = 0;
    double wall_seconds = 0.0;
    double processor_seconds = 0.0; ///< of all threads, from the start of the process
    PhaseSeconds phase_seconds = {};
    std::int64_t peak_memory_bytes = 0;
    nlohmann::ordered_json extra = nlohmann::ordered_json::object(); ///< what only this scene knows; keys carry units
    std::string drawing = {}; ///< what the terminal shows below the summary: a curve; not in summary.json
};

[[nodiscard]] nlohmann::ordered_json to_json(const RunSummary& summary);
/// Throws RunError; an earlier file then stays as it was.
void write_summary(const std::filesystem::path& path, const RunSummary& summary);
/// The lines for the end of a run: what it did, where its time went, which files are in the folder.
[[nodiscard]] std::string describe(const RunSummary& summary, const std::filesystem::path& folder, std::size_t columns = 0);

/// The time that processors have spent on this process so far, all threads together.
[[nodiscard]] double processor_seconds();
/// The largest memory this process has held so far.
[[nodiscard]] std::int64_t peak_memory_bytes();

} // namespace ductile::io
