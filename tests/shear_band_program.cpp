// SPDX-License-Identifier: GPL-3.0-or-later
// The program shear_band as its users meet it: a process with options, files, messages and an exit status.
#include "child_process.hpp"
#include "messages.hpp"

#include <ductile/io/checkpoint.hpp>
#include <ductile/io/hdf5.hpp>
#include <ductile/io/history.hpp>
#include <ductile/quasistatic/checkpoint.hpp>

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>
#include <map>
#include <string>
#include <thread>
#include <vector>

namespace shear_band_program_suite {

using namespace ductile;
using namespace ductile::io;
using scratch::Arguments;
using scratch::ChildProcess;
using scratch::Outcome;
using scratch::operator+;
namespace fs = std::filesystem;

namespace {

/// A run that goes well into the plastic flow in a few dozen steps.
const Arguments fixed_steps = {"--step", "fixed", "--dt", "0.01"};
const Arguments small = {"--cells", "16x12", "--threads", "1", "--snapshots", "0,0.5,1", "--duration", "1"};
const Arguments quick = small + fixed_steps;

Arguments command(const Arguments& arguments) { return scratch::command("shear_band", arguments); }

Outcome run(const Arguments& arguments, rlim_t largest_file = RLIM_INFINITY) {
    return scratch::run("shear_band", arguments, largest_file);
}

void run_well(const Arguments& arguments) {
    const Outcome outcome = run(arguments + Arguments{"--quiet"});
    CAPTURE(outcome.errors);
    REQUIRE(outcome.status == 0);
}

/// Every file of a folder by name.
std::map<std::string, std::string> contents(const fs::path& folder) {
    std::map<std::string, std::string> files;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder))
        files[entry.path().filename()] = scratch::read(entry.path());
    return files;
}

nlohmann::json summary(const fs::path& folder) { return nlohmann::json::parse(scratch::read(folder / "summary.json")); }

/// All numbers of a run that do not depend on the wall clock: the history as text, checkpoint and snapshots as doubles.
struct Result {
    std::string history;
    std::map<std::string, std::vector<double>> arrays = {};
    std::int64_t steps = 0, substeps = 0, solves = 0;

    bool operator==(const Result&) const = default;
};

void read_group(const Hdf5File& file, const std::string& group, Result& result) {
    for (const std::string& name : file.members(group)) {
        const std::string path = group + "/" + name;
        const std::vector<std::size_t> shape = file.shape(path);
        const auto rows = static_cast<int>(shape[0]), columns = static_cast<int>(shape[1]);
        std::vector<double>& values = result.arrays[path];
        values.resize(shape[0] * shape[1]);
        file.read(path, {values.data(), rows, columns, columns});
    }
}

Result result_in(const fs::path& folder) {
    Result result{.history = scratch::read(folder / "history.csv")};
    const CheckpointReader checkpoint(folder / "checkpoint.h5", "shear_band");
    result.steps = checkpoint.counter("step");
    result.substeps = checkpoint.counter("pointwise_substeps");
    result.solves = checkpoint.counter("elliptic_solves");
    read_group(Hdf5File::open(folder / "checkpoint.h5"), "arrays", result);
    const Hdf5File fields = Hdf5File::open(folder / "fields.h5");
    for (const std::string& snapshot : fields.members("snapshots"))
        read_group(fields, "snapshots/" + snapshot, result);
    return result;
}

} // namespace

TEST_SUITE_BEGIN("shear_band_program");

TEST_CASE("wrong options end with status 2 and a message, and leave nothing behind") {
    const scratch::Folder folder;
    const fs::path config = folder / "a.toml", output = folder / "out";
    const auto refused = [&](const Arguments& arguments, const std::string& message) {
        const Outcome outcome = run(arguments + Arguments{"--output", output});
        CAPTURE(arguments);
        CAPTURE(outcome.errors);
        CHECK(outcome.status == 2);
        CHECK(outcome.errors.starts_with("error: "));
        CHECK(contains(outcome.errors, message));
        CHECK(outcome.output.empty());
        CHECK_FALSE(fs::exists(output));
    };
    for (const char* cells : {"-8", "0", "12.5", "8x", "8x-8", "8x8x8", "1e3", "99999999", "many"})
        refused({"--cells", cells}, std::string("--cells ") + cells + ": it must be N or MxN");
    refused({"--cells", "3"}, "at least 4 cells");
    refused({"--cells", "1000000"}, "GB of memory, this machine has");
    for (const char* dt : {"0", "-1", "nan", "inf", "soon"})
        refused({"--step", "fixed", "--dt", dt}, std::string("--dt ") + dt + ": it must be a finite number above 0; or auto");
    for (const char* option : {"--bulk-modulus", "--shear-modulus", "--yield-stress", "--width", "--height", "--tolerance",
                               "--duration", "--stz-bath-temperature", "--stz-steady-temperature", "--dt-max"})
        for (const char* value : {"0", "-1", "nan"})
            refused({option, value}, std::string(option) + " " + value + ": it must be a finite number above 0");
    refused({"--initial", "uniform", "--initial-base", "0"},
            "the initial effective temperature is 0 at cell (0, 0): it must be from 1 to 21000 K");
    refused({"--initial-base", "-640"}, "it must be from 1 to 21000 K; change --initial-base");
    refused({"--initial-amplitude", "-700"}, "--initial-amplitude");
    refused({"--dt-min", "1", "--dt-max", "0.5", "--scheme", "incremental"}, "--dt-min 1 exceeds --dt-max 0.5");
    refused({"--wall-history", "0:1,x"}, "--wall-history");
    refused({"--dt", "0.01"}, "--dt 0.01: adaptive steps have no fixed length");
    refused({"--scheme", "cvode-bdf", "--step", "fixed"}, "--step fixed");
    refused({"--scheme", "mri", "--step", "adaptive"}, "--step adaptive");
    for (const char* scheme : {"auto", "chebyshev", "dormand-prince", "arkode-3", "cvode-bdf", "ida"})
        refused({"--operator", "full", "--scheme", scheme},
                std::string("--operator full: with this stiffness the scheme ") + scheme);
    refused({"--operator", "full"}, "--operator exact, or a projection scheme (--scheme incremental)");
    refused({"--operator", "full", "--scheme", "extrapolated"}, "is unstable at every step length: use --operator exact");
    refused({"--scheme", "leapfrog"}, "--scheme leapfrog: it must be one of auto, euler, substepped, incremental");
    refused({"--snapshots", "0,-1"}, "element '-1' is wrong");
    const Arguments elements = {"--space", "elements", "--cells", "16x24"};
    refused(elements + Arguments{"--degree", "7"},
            "take 21 or 28 rows (--space, --cells, --degree, --element-edges, --adapt-elements)");
    refused(elements + Arguments{"--degree", "1"}, "take the staggered space");
    refused(elements + Arguments{"--degree", "8", "--element-edges", "0.001"}, "1 edges make 2 elements");
    for (const auto& [option, value] : {std::array{"--equilibrium", "cholesky"}, {"--operator", "full"}, {"--advection", "eno2"}})
        refused(elements + Arguments{"--degree", "8", option, value}, "are of the staggered grid");
    refused({"--element-edges", "0.001"}, "add --space elements");
    refused({"--adapt-elements"}, "add --space elements");
    refused(elements + Arguments{"--degree", "12", "--adapt-elements"}, "2 elements of degree 12 cannot be adapted");
    const Arguments accuracy = {"--accuracy", "1e-3"};
    refused(accuracy + Arguments{"--cells", "32"}, "--accuracy 0.001 and --cells: the one finds the other");
    refused(accuracy + Arguments{"--cells", "128"}, "--accuracy 0.001 and --cells"); // the default, said aloud
    refused(accuracy + Arguments{"--space", "staggered"}, "--accuracy 0.001 and --space");
    refused(accuracy + Arguments{"--tolerance", "1e-5"}, "--accuracy 0.001 and --tolerance");
    refused(accuracy + Arguments{"--element-edges", "0.001"}, "--accuracy 0.001 and --element-edges");
    refused(accuracy + Arguments{"--scheme", "incremental"}, "take --scheme auto");
    refused(accuracy + fixed_steps, "take --scheme auto");
    refused({"--accuracy", "0.5"}, "--accuracy 0.5");
    refused({"--snapshot-cells", "8x"}, "--snapshot-cells 8x");
    refused({"--initial", "blocks", "--initial-length", "1e-9"}, "blocks");
    refused({"--threads", "0"}, "--threads 0");
    refused({"--colour"}, "--colour");

    refused({"--config", folder / "none.toml"}, "none.toml: the file cannot be read");
    refused({"--config", folder / ""}, "the file cannot be read");
    scratch::write(config, "dt = 0.02\nsteps = 3\n");
    refused({"--config", config}, "a.toml, line 2: unknown key 'steps'");
    scratch::write(config, "threads = \"two\"\n");
    refused({"--config", config}, "a.toml, line 1: --threads two: it must be a whole number");
    scratch::write(config, "cells = 16\ncells = 32\n");
    refused({"--config", config}, "a.toml, line 2: ");
    scratch::write(config, "[grid]\ncells = 16\n");
    refused({"--config", config}, "tables are not used");
}

TEST_CASE("an output folder that cannot be written is refused") {
    const scratch::Folder folder;
    scratch::write(folder / "file", "mine");
    for (const fs::path& output : {folder / "file", folder / "file/below", fs::path("/proc/none")}) {
        const Outcome outcome = run(quick + Arguments{"--output", output});
        CAPTURE(outcome.errors);
        CHECK(outcome.status == 2);
        CHECK(contains(outcome.errors, "output folder " + output.string()));
        CHECK(contains(outcome.errors, "choose another one with --output"));
    }
    CHECK(scratch::read(folder / "file") == "mine");
}

TEST_CASE("a checkpoint that does not fit is refused and keeps its folder as it was") {
    const scratch::Folder folder;
    run_well(quick + Arguments{"--output", folder / "run"});
    const std::string good = scratch::read(folder / "run/checkpoint.h5");
    const auto before = contents(folder / "run");
    const fs::path bad = folder / "bad.h5";
    const auto refused = [&](const fs::path& checkpoint, const Arguments& arguments, const std::string& message) {
        const Outcome outcome = run(Arguments{"--restart", checkpoint} + arguments);
        CAPTURE(outcome.errors);
        CHECK(outcome.status == 2);
        CHECK(contains(outcome.errors, message));
        CHECK(contents(folder / "run") == before);
    };
    refused(folder / "run/checkpoint.h5", {"--cells", "24"}, "--cells: the checkpoint has 16x12, this run asks for 24");
    refused(folder / "run/checkpoint.h5", {"--duration", "0.9"}, "--duration 0.9: the checkpoint is at t = 0.99");
    refused(folder / "run/checkpoint.h5", {"--duration", "0.5"}, "a longer --duration goes on from there");
    refused(folder / "run/checkpoint.h5", {"--plasticity", "perzyna", "--duration", "2"},
            "--plasticity: the checkpoint has stz, this run asks for perzyna");
    for (const auto& [option, value, message] :
         {std::tuple{"--yield-stress", "4.25e8", "the checkpoint has 850000000, this run asks for 425000000"},
          {"--wall-velocity", "1e-3", "--wall-velocity: the checkpoint has 0.00049"},
          {"--wall-history", "0:1e-3", "--wall-history: the checkpoint has"},
          {"--height", "0.01", "--height: the checkpoint has 0.02, this run asks for 0.01"},
          {"--model", "reduced", "--model: the checkpoint has full, this run asks for reduced"},
          {"--initial-base", "650", "--initial-base: the checkpoint has auto, this run asks for 650"}})
        refused(folder / "run/checkpoint.h5", {option, value, "--duration", "2"}, message);
    refused(folder / "none.h5", {}, "none.h5: there is no such file");
    refused(folder / "run/fields.h5", {}, "this is not a checkpoint");
    for (const std::size_t length : {std::size_t{0}, std::size_t{100}, good.size() / 2, good.size() - 1}) {
        scratch::write(bad, good.substr(0, length));
        refused(bad, {}, "bad.h5: ");
    }
    scratch::write(bad, "cells = 16\n");
    refused(bad, {}, "bad.h5: "); // a text file
    write_checkpoint(bad, {.program = "shear_band", .format = 999});
    refused(bad, {}, "bad.h5: this checkpoint has format 999");
    write_checkpoint(bad, {.program = "upsetting"});
    refused(bad, {}, "written by upsetting");
    for (std::size_t at = 0; at < good.size(); at += good.size() / 7) {
        std::string damaged = good;
        damaged[at] = static_cast<char>(damaged[at] ^ 1);
        scratch::write(bad, damaged);
        refused(bad, {"--duration", "2"}, "bad.h5: this checkpoint is damaged");
    }
    // as a run of another kind would have left it: whole, but not finite, or without a field
    const std::vector<double> wrong(12 * 16, std::numeric_limits<double>::quiet_NaN());
    const CheckpointReader reader(folder / "run/checkpoint.h5", "shear_band");
    Checkpoint content{.program = "shear_band", .format = quasistatic::checkpoint_format, .config = reader.config()};
    content.scalars = {{"time", reader.scalar("time")}};
    content.counters = {{"step", 1}, {"cells_x", 16}, {"cells_y", 12}};
    content.history = reader.history().mark;
    write_checkpoint(bad, content);
    refused(bad, {"--duration", "2"}, "bad.h5: 'arrays/p' is missing");
    content.arrays = {{"p", {wrong.data(), 12, 16, 16}}};
    write_checkpoint(bad, content);
    refused(bad, {"--duration", "2"}, "bad.h5: 'p' has a value that is not finite");
}

TEST_CASE("a second run into a folder moves the first one aside, whole") {
    const scratch::Folder folder;
    const Arguments arguments = quick + Arguments{"--output", folder / "run"};
    run_well(arguments);
    const auto first = contents(folder / "run");
    for (const char* file : {"summary.json", "history.csv", "fields.h5", "fields.xdmf", "checkpoint.h5"})
        CHECK(first.contains(file));
    const Outcome second = run(arguments);
    CHECK(second.status == 0);
    CHECK(contains(second.output, "held an earlier run, which is now in " + (folder / "run.1").string()));
    CHECK(contains(second.output, "shear traction on the wall [MPa]"));
    CHECK(contents(folder / "run.1") == first);
    CHECK(result_in(folder / "run") == result_in(folder / "run.1"));
    CHECK(Hdf5File::open(folder / "run/fields.h5").double_attribute("/", "yield_stress_Pa") == 0.85e9);
}

TEST_CASE("a full disk ends a run with status 1; what it had written is whole") {
    for (const rlim_t bytes : {1'000, 6'000, 20'000, 50'000}) {
        CAPTURE(bytes);
        const scratch::Folder folder;
        const Outcome outcome = run(quick + Arguments{"--output", folder / "run"}, bytes);
        CAPTURE(outcome.errors);
        CHECK(outcome.status == 1);
        CHECK(contains(outcome.errors, (folder / "run").string()));
        CHECK(contains(outcome.errors, "free space"));
        for (const char* file : {"fields.h5", "checkpoint.h5"})
            if (fs::exists(folder / "run" / file))
                CHECK_NOTHROW((void)Hdf5File::open(folder / "run" / file).members("/"));
    }
}

TEST_CASE("a step that goes wrong ends the run with its time, advice, and finished files") {
    const scratch::Folder folder;
    const Outcome outcome = run({"--cells", "16", "--scheme", "euler", "--step", "fixed", "--dt", "0.3", "--duration", "100",
                                 "--snapshots", "0,0.3", "--output", folder / "run"});
    CAPTURE(outcome.errors);
    CHECK(outcome.status == 1);
    for (const char* part : {"error: step ", " at t = ", " s with dt = 0.3 s", "use a smaller --dt"})
        CHECK(contains(outcome.errors, part));
    CHECK(summary(folder / "run")["status"] == "failed");
    CHECK(contains(outcome.errors, summary(folder / "run")["reason"].get<std::string>()));
    CHECK(contains(scratch::read(folder / "run/history.csv"), "\n0.3,1,0.3,"));
    CHECK(Hdf5File::open(folder / "run/fields.h5").members("snapshots").size() == 2);
    // the state before the step that failed is kept
    CHECK(contains(outcome.errors, "the last good state is in " + (folder / "run/checkpoint.h5").string()));
    CHECK(CheckpointReader(folder / "run/checkpoint.h5", "shear_band").counter("step") == summary(folder / "run")["steps"]);
}

TEST_CASE("SUNDIALS' own steps are doubted where they are so many that their errors add up") {
    const scratch::Folder folder;
    const auto doubted = [&](const char* factor_of_speed, const char* duration) {
        const Outcome done = run({"--cells", "4", "--scheme", "arkode-3", "--wall-velocity", factor_of_speed, "--duration",
                                  duration, "--output", folder / "run"});
        REQUIRE(done.status == 0);
        const nlohmann::json all = summary(folder / "run");
        const auto steps = all["extra"]["inner_steps"].get<long long>();
        CAPTURE(steps);
        const bool said = std::ranges::any_of(all["warnings"], [&](const auto& warning) {
            return contains(warning.template get<std::string>(), fmt::format("SUNDIALS took {} steps", steps));
        });
        CHECK(said == (steps > 15'000));
        return said;
    };
    CHECK_FALSE(doubted("4.94e-4", "1.0"));
    CHECK(doubted("1e-8", "70000"));
}

TEST_CASE("an interrupted run ends with status 130, and goes on as if it had never stopped") {
    const Arguments scene = {"--cells", "32x24", "--threads", "1", "--snapshots", "0.5,1", "--duration", "1"};
    for (const Arguments& how : {Arguments{"--step", "fixed", "--dt", "0.004", "--scheme", "incremental"},
                                 Arguments{"--scheme", "incremental"}, Arguments{"--tolerance", "1e-6"}}) {
        const scratch::Folder folder;
        const fs::path whole = folder / "whole", parts = folder / "parts";
        run_well(scene + how + Arguments{"--output", whole});
        // A checkpoint at every step makes the run slow enough to be hit.
        ChildProcess process(command(scene + how + Arguments{"--output", parts, "--checkpoint-every", "1e-9"}));
        for (int wait = 0; wait < 10'000 && !fs::exists(parts / "checkpoint.h5"); ++wait)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        process.signal(SIGINT);
        REQUIRE(process.wait() == 130);
        CHECK(contains(process.output(), "shear_band: interrupted"));
        CHECK(summary(parts)["status"] == "interrupted");
        CHECK(result_in(parts).steps < result_in(whole).steps);
        run_well({"--restart", parts / "checkpoint.h5", "--checkpoint-every", "600"});
        CHECK(summary(parts)["status"] == "completed");
        CHECK(result_in(parts) == result_in(whole));
    }
}

TEST_CASE("a run that was killed after its last checkpoint is brought to its end") {
    for (const Arguments& rows : {Arguments{}, {"--history-every", "1000"}, {"--history-every", "4"}}) {
        CAPTURE(rows);
        const scratch::Folder folder;
        const fs::path run_folder = folder / "run";
        run_well(quick + rows + Arguments{"--snapshots", "0.5,1", "--output", run_folder});
        const Result whole = result_in(run_folder);
        const auto told = summary(run_folder);
        if (rows.empty()) // names, the start, every step once
            CHECK(std::ranges::count(scratch::read(run_folder / "history.csv"), '\n') == told["steps"].get<int>() + 2);
        scratch::leave_as_killed(run_folder);
        for (int repeat = 0; repeat < 2; ++repeat) { // harmless where there is nothing left to do
            run_well({"--restart", run_folder / "checkpoint.h5"});
            CHECK(result_in(run_folder) == whole);
            CHECK_FALSE(fs::exists(run_folder / "history.csv.partial"));
            CHECK_FALSE(fs::exists(run_folder / "fields.h5.partial"));
            for (const char* key : {"status", "steps", "extra", "warnings"})
                CHECK(summary(run_folder)[key] == told[key]);
        }
    }
}

TEST_CASE("snapshots and rows at equal times change no bit of a run, and rows lie on its curve") {
    for (const Arguments& how : {Arguments{},
                                 {"--scheme", "incremental", "--step", "fixed", "--dt", "0.01"},
                                 {"--scheme", "euler", "--step", "fixed", "--dt", "0.005"},
                                 {"--scheme", "extrapolated"},
                                 {"--scheme", "cvode-bdf"},
                                 {"--scheme", "arkode-3"},
                                 {"--scheme", "ida"},
                                 {"--scheme", "mri", "--step", "fixed", "--dt", "0.01"}}) {
        CAPTURE(how);
        const scratch::Folder folder;
        const Arguments scene = Arguments{"--cells", "12x10", "--threads", "1", "--duration", "0.9"} + how;
        run_well(scene + Arguments{"--snapshots", "", "--output", folder / "bare"});
        run_well(scene + Arguments{"--snapshots", "0.1,0.5,0.6,0.77", "--output", folder / "snapshots"});
        run_well(scene + Arguments{"--snapshots", "", "--rows-every", "0.1", "--output", folder / "rows"});
        CHECK(scratch::read(folder / "snapshots/history.csv") == scratch::read(folder / "bare/history.csv"));
        for (const char* key : {"steps", "warnings"})
            CHECK(summary(folder / "rows")[key] == summary(folder / "bare")[key]);
        const io::HistoryTable rows = io::read_history(folder / "rows/history.csv"),
                               bare = io::read_history(folder / "bare/history.csv");
        const std::vector<double> time = rows.column("time_s"), traction = rows.column("wall_shear_traction_Pa"),
                                  strain = rows.column("wall_strain"), work = rows.column("wall_work_J");
        REQUIRE(time.size() == 10);
        for (std::size_t k = 0; k < 10; ++k) {
            CHECK(time[k] == doctest::Approx(0.1 * static_cast<double>(k)).epsilon(1e-12));
            CHECK(strain[k] == doctest::Approx(strain.back() * time[k] / 0.9).epsilon(1e-9).scale(1e-9));
        }
        // elastic up to there, as the first rows of a run without errors: tau = mu gamma, work = tau gamma/2
        CHECK(traction[1] == doctest::Approx(37.4e9 * strain[1]).epsilon(2e-3));
        CHECK(work[2] == doctest::Approx(0.5 * traction[2] * strain[2] * 0.02 * 0.02).epsilon(5e-3));
        CHECK(traction.back() == bare.column("wall_shear_traction_Pa").back());
        CHECK(work.back() == bare.column("wall_work_J").back());
    }
}

TEST_CASE("a restart of a restart gives the bits of the uninterrupted run") {
    const auto compare = [](const Arguments& how) {
        CAPTURE(how);
        const scratch::Folder folder;
        const Arguments scene = small + how;
        run_well(scene + Arguments{"--output", folder / "whole"});
        run_well(scene + Arguments{"--duration", "0.5", "--output", folder / "parts"});
        CHECK(result_in(folder / "parts").steps > 0);
        run_well({"--restart", folder / "parts/checkpoint.h5", "--duration", "0.8"});
        run_well({"--restart", folder / "parts/checkpoint.h5", "--duration", "1"});
        CHECK(result_in(folder / "parts") == result_in(folder / "whole"));
    };
    // the uninterrupted run lands on the ends of the others, too
    const Arguments stops = {"--snapshots", "0,0.5,0.8,1"};
    for (const auto& [scheme, step, model] : {std::array{"euler", "fixed", "full"},
                                              {"euler", "adaptive", "reduced"},
                                              {"substepped", "fixed", "reduced"},
                                              {"substepped", "adaptive", "full"},
                                              {"incremental", "fixed", "full"},
                                              {"incremental", "fixed", "reduced"},
                                              {"incremental", "adaptive", "full"},
                                              {"incremental", "adaptive", "reduced"},
                                              {"extrapolated", "fixed", "full"},
                                              {"extrapolated", "adaptive", "full"},
                                              {"ralston", "adaptive", "full"},
                                              {"bogacki-shampine", "adaptive", "reduced"},
                                              {"dormand-prince", "adaptive", "full"},
                                              {"auto", "adaptive", "full"},
                                              {"chebyshev", "adaptive", "full"},
                                              {"chebyshev", "fixed", "full"},
                                              {"arkode-2", "fixed", "full"},
                                              {"arkode-3", "adaptive", "full"},
                                              {"arkode-4", "adaptive", "reduced"},
                                              {"arkode-5", "fixed", "reduced"},
                                              {"cvode-adams", "adaptive", "full"},
                                              {"cvode-bdf", "adaptive", "full"},
                                              {"ida", "adaptive", "full"},
                                              {"mri", "fixed", "full"}})
        compare(stops + Arguments{"--scheme", scheme, "--model", model} +
                (step == std::string("fixed") ? Arguments{"--step", "fixed", "--dt", "0.01"} : Arguments{"--step", step}));
    compare(stops + fixed_steps + Arguments{"--equilibrium", "cholesky"});
    const Arguments elements = {"--space", "elements", "--degree", "6", "--element-edges", "0.004"};
    for (const char* scheme : {"auto", "incremental", "extrapolated", "chebyshev", "arkode-3", "cvode-bdf"})
        compare(stops + elements + Arguments{"--scheme", scheme});
    compare(stops + elements + Arguments{"--shear-traction", "9e8"});
    compare(stops + Arguments{"--initial-stress", "1e8", "--snapshot-cells", "7x5"});
    compare(stops + fixed_steps + Arguments{"--threads", "2"});
    compare(stops + Arguments{"--threads", "2", "--equilibrium", "cholesky"});
    compare(stops + Arguments{"--wall-history", "0:5e-4,0.6:5e-4,0.6:-5e-4"});
    compare(stops + fixed_steps + Arguments{"--wall-history", "0:5e-4,0.6:5e-4,0.6:-5e-4"});
    compare(stops + Arguments{"--plasticity", "perzyna", "--initial", "uniform", "--initial-base", "0", "--history-every", "3"});
}

TEST_CASE("a run says whether its space shows all there is, and draws fields on the cells that are asked for") {
    const scratch::Folder folder;
    const auto warned = [&](const Arguments& how) {
        run_well(how + Arguments{"--duration", "1.4175", "--output", folder / "out"});
        return contains(scratch::read(folder / "out/summary.json"), "the finest scales of the space in y hold");
    };
    CHECK(warned({"--cells", "12"}));
    CHECK_FALSE(warned({"--cells", "48"}));
    CHECK(warned({"--space", "elements", "--cells", "16x12", "--degree", "6"}));
    CHECK_FALSE(warned({"--space", "elements", "--cells", "32x48", "--snapshot-cells", "5x4"}));
    const io::Hdf5File file = io::Hdf5File::open(folder / "out/fields.h5");
    CHECK(file.shape("snapshots/000000/tau") == std::vector<std::size_t>{4, 5});
    CHECK(file.shape("snapshots/000000/velocity_x") == std::vector<std::size_t>{5, 6});
    CHECK(file.read_doubles("grid/y_centre").size() == 4);
}

TEST_CASE("a band that the space does not show is said, though the fields at the end look smooth on it") {
    // five elements of degree 16: 0.06 of the yield stress off; on elements that follow the band 6e-4. The walls turn back in the
    // end, so that nothing flows there
    const scratch::Folder folder;
    const auto summary_of = [&](const Arguments& how) {
        run_well(Arguments{"--initial",
                           "disc",
                           "--initial-base",
                           "600",
                           "--initial-amplitude",
                           "300",
                           "--initial-length",
                           "3e-3",
                           "--initial-transition",
                           "1e-3",
                           "--duration",
                           "1.15",
                           "--wall-history",
                           "0:1e-3,1:1e-3,1:-1e-3",
                           "--snapshots",
                           "",
                           "--space",
                           "elements",
                           "--output",
                           folder / "out"} +
                 how);
        return nlohmann::json::parse(scratch::read(folder / "out/summary.json"));
    };
    const auto wrong = summary_of({"--cells", "40x80", "--degree", "16"});
    CHECK(wrong.at("extra").at("unresolved_flow").get<double>() == doctest::Approx(0.18).epsilon(0.1));
    CHECK(std::ranges::any_of(wrong.at("warnings"), [](const nlohmann::json& warning) {
        return contains(warning.get<std::string>(), "s the finest scales of the space in y held 0.1");
    }));
    const auto right = summary_of({"--cells", "24x128", "--degree", "8", "--adapt-elements"});
    CHECK(right.at("extra").at("unresolved_flow").get<double>() < 0.1);
    CHECK(right.at("warnings").empty());
}

TEST_CASE("elements that follow a band show it five times better, and go on from a checkpoint with the same bits") {
    const scratch::Folder folder;
    const Arguments scene = {"--initial",        "disc",     "--initial-base", "600",    "--initial-amplitude", "300",
                             "--initial-length", "3e-3",     "--initial-y",    "-0.004", "--threads",           "1",
                             "--space",          "elements", "--degree",       "8",      "--snapshot-cells",    "20x60",
                             "--snapshots",      "0.85,1"};
    const Arguments end = {"--duration", "1"}, coarse = {"--cells", "24x96"}, adapted = {"--adapt-elements"};
    run_well(scene + end + Arguments{"--cells", "24x288", "--output", folder / "exact"});
    run_well(scene + end + coarse + Arguments{"--output", folder / "even"});
    run_well(scene + end + coarse + adapted + Arguments{"--output", folder / "whole"});
    const auto velocity = [&](const char* name) { return result_in(folder / name).arrays.at("snapshots/000001/velocity_x"); };
    const std::vector<double> exact = velocity("exact");
    const auto error = [&](const char* name) {
        double sum = 0.0;
        const std::vector<double> there = velocity(name);
        for (std::size_t k = 0; k < exact.size(); ++k)
            sum += (there[k] - exact[k]) * (there[k] - exact[k]);
        return std::sqrt(sum);
    };
    CHECK(error("whole") < 0.2 * error("even"));
    const nlohmann::json said = summary(folder / "whole"), of_even = summary(folder / "even");
    CHECK(said["warnings"].empty());
    CHECK(said["extra"]["edge_moves"].get<double>() > 0.0);
    CHECK(said["extra"]["edge_corrections"].get<double>() > 0.0);
    CHECK(said["extra"]["edge_corrections"].get<double>() < 1e-4);
    CHECK(std::abs(said["extra"]["energy_error_of_work"].get<double>()) < 1e-5);
    CHECK_FALSE(of_even["extra"].contains("edge_moves"));
    // equilibrium to round-off in every row, whatever has moved before it
    std::istringstream rows(scratch::read(folder / "whole/history.csv"));
    std::size_t column = 0, residuals = 0;
    for (std::string line; std::getline(rows, line);) {
        if (line.starts_with('#'))
            continue;
        std::vector<std::string> values;
        std::istringstream cells(line);
        for (std::string value; std::getline(cells, value, ',');)
            values.push_back(value);
        if (line.starts_with("time_s")) {
            column = static_cast<std::size_t>(std::ranges::find(values, "equilibrium_residual") - values.begin());
            continue;
        }
        CHECK(std::stod(values.at(column)) < 1e-11);
        ++residuals;
    }
    CHECK(residuals > 50);
    // edges have moved when the first part ends; also under a load, and with projection schemes
    for (const Arguments& how : {Arguments{}, {"--shear-traction", "9e8"}, {"--scheme", "extrapolated", "--tolerance", "1e-3"}}) {
        CAPTURE(how);
        const Arguments all = scene + how + coarse + adapted;
        if (!how.empty())
            run_well(all + end + Arguments{"--output", folder / "whole"});
        run_well(all + Arguments{"--duration", "0.85", "--output", folder / "parts"});
        const auto moves = [&](const char* name) { return summary(folder / name)["extra"]["edge_moves"].get<double>(); };
        CHECK(moves("parts") > 0.0);
        CHECK(moves("whole") >= moves("parts") + (how.empty() ? 1 : 0));
        run_well({"--restart", folder / "parts/checkpoint.h5", "--duration", "1"});
        CHECK(result_in(folder / "parts") == result_in(folder / "whole"));
    }
}

TEST_CASE("the error that --accuracy states is the error there is, within a factor of three") {
    const scratch::Folder folder;
    const Arguments scene = {"--initial", "gaussian", "--initial-amplitude", "60",  "--duration",       "0.9",
                             "--threads", "1",        "--snapshots",         "0.9", "--snapshot-cells", "48x96"};
    run_well(scene + Arguments{"--space", "elements", "--cells", "72x144", "--tolerance", "1e-8", "--output", folder / "exact"});
    const Result exact = result_in(folder / "exact");
    for (const double asked : {1e-3, 1e-4}) {
        run_well(scene + Arguments{"--accuracy", fmt::format("{}", asked), "--output", folder / "out"});
        const nlohmann::json said = summary(folder / "out");
        CHECK(said["warnings"].empty());
        CHECK(said["parameters"]["space"] == "elements");
        const Result result = result_in(folder / "out");
        const auto square = [&](const std::string& name) {
            const auto &there = result.arrays.at("snapshots/000000/" + name),
                       &truth = exact.arrays.at("snapshots/000000/" + name);
            double sum = 0.0;
            for (std::size_t k = 0; k < truth.size(); ++k)
                sum += (there[k] - truth[k]) * (there[k] - truth[k]);
            return sum / static_cast<double>(truth.size());
        };
        const double yield_stress = 0.85e9;
        const double stress =
            std::sqrt(3.0 * square("pressure") + 2.0 * (square("s") + square("tau")) + 6.0 * square("q")) / yield_stress;
        const double internal = std::sqrt(square("effective_temperature")) / 900.0;
        CAPTURE(asked);
        CHECK(stress < asked);
        CHECK(said["extra"]["estimated_error_stress"].get<double>() > stress / 3.0);
        CHECK(said["extra"]["estimated_error_stress"].get<double>() < stress * 3.0);
        CHECK(said["extra"]["estimated_error_internal"].get<double>() > internal / 3.0);
        CHECK(said["extra"]["estimated_error_internal"].get<double>() < internal * 3.0);
    }
    // nothing depends on points
    run_well({"--initial", "uniform", "--duration", "0.9", "--accuracy", "1e-4", "--snapshots", "", "--output", folder / "even"});
    CHECK(summary(folder / "even")["warnings"].empty());
    CHECK(summary(folder / "even")["extra"]["estimated_error_stress"].get<double>() < 1e-4);
    run_well({"--restart", folder / "out/checkpoint.h5", "--duration", "0.92"});
    CHECK(contains(summary(folder / "out")["warnings"].dump(), "the error of a run that goes on from a checkpoint"));
}

TEST_CASE("an eigenstress is of the size that is asked for and in equilibrium, on either space") {
    const scratch::Folder folder;
    for (const Arguments& space :
         {Arguments{"--cells", "24x30"}, Arguments{"--cells", "24x30", "--space", "elements", "--degree", "6"}}) {
        run_well(space +
                 Arguments{"--initial", "uniform", "--initial-stress", "2e8", "--duration", "0.001", "--output", folder / "out"});
        const HistoryTable history = read_table(folder / "out/history.csv");
        CHECK(history.column("equilibrium_residual").front() < 1e-12);
        CHECK(history.column("mean_deviatoric_magnitude_Pa").front() > 0.5e8);
        CHECK(history.column("mean_deviatoric_magnitude_Pa").front() < 4e8);
    }
}

TEST_CASE("snapshots that begin after a restart say that they lack what has accumulated") {
    const scratch::Folder folder;
    run_well(quick + Arguments{"--duration", "0.3", "--snapshots", "", "--output", folder / "run"});
    run_well({"--restart", folder / "run/checkpoint.h5", "--duration", "0.5", "--snapshots", "0.5"});
    CHECK(contains(summary(folder / "run")["warnings"].dump(), "the snapshots lack the accumulated plastic strain"));
    CHECK_FALSE(result_in(folder / "run").arrays.contains("snapshots/000000/displacement_x"));
}

TEST_CASE("a continued run may write into another folder and leaves the first one as it was") {
    const scratch::Folder folder;
    run_well(quick + Arguments{"--output", folder / "whole"});
    run_well(quick + Arguments{"--duration", "0.5", "--output", folder / "first"});
    const auto before = contents(folder / "first");
    run_well({"--restart", folder / "first/checkpoint.h5", "--duration", "1", "--output", folder / "second"});
    CHECK(contents(folder / "first") == before);
    const Result whole = result_in(folder / "whole"), second = result_in(folder / "second");
    CHECK(second.history == whole.history);
    CHECK(second.arrays.at("arrays/effective_temperature") == whole.arrays.at("arrays/effective_temperature"));
}

TEST_SUITE_END();

} // namespace shear_band_program_suite
