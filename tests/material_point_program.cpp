// SPDX-License-Identifier: GPL-3.0-or-later
// The program material_point as its users meet it: a process with options, files, messages and an exit status.
#include "child_process.hpp"
#include "messages.hpp"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

namespace material_point_program_suite {

using scratch::Outcome;
namespace fs = std::filesystem;

namespace {

Outcome run(const scratch::Arguments& arguments, rlim_t largest_file = RLIM_INFINITY) {
    return scratch::run("material_point", arguments, largest_file);
}

std::vector<std::string> lines_of(const fs::path& file) {
    std::istringstream text(scratch::read(file));
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);)
        lines.push_back(line);
    return lines;
}

} // namespace

TEST_SUITE_BEGIN("material_point_program");

TEST_CASE("by default a metallic glass is sheared through yield by all methods") {
    const scratch::Folder folder;
    const Outcome outcome = run({"--output", folder / "run"});
    CAPTURE(outcome.errors);
    REQUIRE(outcome.status == 0);
    for (const char* part : {"K = 122 GPa", "accumulated shear strain 0.07", "tolerance", "rk21", "arkode-5-dormand-prince",
                             "cvode-bdf", "material_point: completed", "sbar [MPa]"})
        CHECK(contains(outcome.output, part));
    const auto summary = nlohmann::json::parse(scratch::read(folder / "run/summary.json"));
    CHECK(summary["status"] == "completed");
    CHECK(summary["parameters"]["path"] == "simple-shear");
    const auto table = lines_of(folder / "run/work_precision.csv");
    REQUIRE(table.size() == 1 + 3 * 8);
    CHECK(table[0] == "method,tolerance,steps,rejected,evaluations,largest_error,wall_s");
    const auto rows = lines_of(folder / "run/history.csv");
    CHECK(rows[0] == "method,tolerance,time_s,accumulated_shear_strain,pressure_Pa,s_Pa,tau_Pa,q_Pa,deviatoric_magnitude_Pa,"
                     "effective_temperature_K");
    CHECK(rows[1] == "rk21,0.0001,0,0,0,0,0,0,0,640");
    CHECK(static_cast<long long>(rows.size()) == 1 + 3 * 8 + summary["steps"].get<long long>());
}

TEST_CASE("histories, materials, quiet") {
    const scratch::Folder folder;
    const Outcome outcome = run({"--gradient-history", "0.5:0:0.05:0:0,1:0:-0.05:0:0", "--plasticity", "perzyna",
                                 "--perzyna-rate", "1", "--tolerance", "1e-5", "--quiet", "--output", folder / "run"});
    CAPTURE(outcome.errors);
    CHECK(outcome.status == 0);
    CHECK(outcome.output.empty());
    CHECK(lines_of(folder / "run/history.csv")[0].ends_with(",plastic_strain"));
    CHECK(lines_of(folder / "run/work_precision.csv").size() == 1 + 8);
}

TEST_CASE("wrong options end with status 2 and a message, and leave nothing behind") {
    const scratch::Folder folder;
    const auto refused = [&](std::vector<std::string> arguments, const std::string& message) {
        arguments.insert(arguments.end(), {"--output", folder / "run"});
        const Outcome outcome = run(arguments);
        CAPTURE(arguments);
        CAPTURE(outcome.errors);
        CHECK(outcome.status == 2);
        CHECK(outcome.errors.starts_with("error: "));
        CHECK(contains(outcome.errors, message));
        CHECK(outcome.output.empty());
        CHECK_FALSE(fs::exists(folder / "run"));
    };
    refused({"--path", "bending"}, "--path bending: it must be one of simple-shear, shear-without-spin, pure-shear, compression");
    for (const char* option : {"--rate", "--duration", "--shear-modulus", "--stz-bath-temperature"})
        for (const char* value : {"0", "-1", "nan"})
            refused({option, value}, std::string(option) + " " + value + ": it must be a finite number above 0");
    refused({"--initial-temperature", "0"}, "--initial-temperature 0: it must be a finite number at least 1");
    refused({"--tolerance", "1e-6,0"}, "--tolerance 1e-6,0: ");
    refused({"--tolerance", "1e-20"}, "--tolerance 1e-20: ");
    refused({"--gradient-history", "1:2"}, "--gradient-history: '1:2'");
    refused({"--restart", "checkpoint.h5"}, "--restart"); // its runs are too short for checkpoints
    refused({"--cells", "8"}, "--cells");
}

TEST_CASE("a full disk and a hopeless problem end with status 1") {
    const scratch::Folder folder;
    const Outcome full = run({"--output", folder / "full"}, 20'000);
    CHECK(full.status == 1);
    CHECK(contains(full.errors, "history.csv"));
    const Outcome hopeless = run({"--plasticity", "perzyna", "--perzyna-rate", "1e30", "--output", folder / "hopeless"});
    CHECK(hopeless.status == 1);
    CHECK(contains(hopeless.errors, "tolerance 0.0001, segment 1 of the loading: "));
    CHECK(nlohmann::json::parse(scratch::read(folder / "hopeless/summary.json"))["status"] == "failed");
}

TEST_SUITE_END();

} // namespace material_point_program_suite
