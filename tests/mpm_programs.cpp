// SPDX-License-Identifier: GPL-3.0-or-later
// The programs of the material point method as their users meet them: processes with options, files, messages and an exit status.
#include "capture.hpp"
#include "child_process.hpp"
#include "messages.hpp"

#include <ductile/io/checkpoint.hpp>
#include <ductile/io/hdf5.hpp>
#include <ductile/io/history.hpp>

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

namespace mpm_programs_suite {

using namespace ductile;
using namespace ductile::io;
using scratch::Arguments;
using scratch::ChildProcess;
using scratch::Outcome;
using scratch::operator+;
using scratch::command;
using scratch::run;
namespace fs = std::filesystem;

namespace {

void run_well(const std::string& program, const Arguments& arguments) {
    const Outcome outcome = run(program, arguments + Arguments{"--quiet"});
    CAPTURE(program);
    CAPTURE(outcome.errors);
    REQUIRE(outcome.status == 0);
}

/// summary.json, with what only this scene knows on the same level as the rest.
nlohmann::json summary(const fs::path& folder) {
    nlohmann::json json = nlohmann::json::parse(scratch::read(folder / "summary.json"));
    json.update(json.at("extra"));
    return json;
}

/// All numbers of a run that do not depend on the wall clock.
struct Result {
    std::string history;
    std::map<std::string, std::vector<double>> vectors = {};
    std::map<std::string, std::int64_t> counters = {};
    std::string shortened_by = {};

    bool operator==(const Result&) const = default;
};

Result result_in(const fs::path& folder, const std::string& program) {
    Result result{.history = scratch::read(folder / "history.csv")};
    const CheckpointReader checkpoint(folder / "checkpoint.h5", program);
    for (const char* name : {"x", "y", "velocity_x", "velocity_y", "density", "stress_xx", "stress_yy", "stress_zz", "stress_xy",
                             "energy", "temperature"})
        result.vectors[name] = checkpoint.vector(std::string("particles/") + name);
    if (program != "elastic_bar" && program != "colliding_disks" && program != "vibrating_bar") // elastic ones have none
        result.vectors["internal_1"] = checkpoint.vector("particles/internal_1");
    const std::vector<std::int64_t> id = checkpoint.integer_vector("particles/id");
    result.vectors["id"].assign(id.begin(), id.end());
    for (const char* name :
         {"step", "newton_iterations", "linear_iterations", "residual_evaluations", "rejected_without_convergence",
          "steps_cut_by_rigid_travel", "steps_ended_at_contact", "steps_with_many_newton_iterations"})
        result.counters[name] = checkpoint.counter(name);
    result.shortened_by = checkpoint.text("shortened_by");
    result.vectors["planned_dt"] = {checkpoint.scalar("planned_dt")};
    const std::vector<std::int64_t> touching = checkpoint.integer_vector("touching");
    result.vectors["touching"].assign(touching.begin(), touching.end());
    const Hdf5File fields = Hdf5File::open(folder / "fields.h5");
    for (const std::string& snapshot : fields.members("snapshots"))
        for (const std::string& name : fields.members("snapshots/" + snapshot))
            if (fields.shape("snapshots/" + snapshot + "/" + name).size() == 1)
                result.vectors[snapshot + name] = fields.read_doubles("snapshots/" + snapshot + "/" + name);
    return result;
}

} // namespace

TEST_SUITE_BEGIN("mpm_programs");

TEST_CASE("explicit runs take the paper's numbers of steps") {
    const scratch::Folder folder;
    run_well("elastic_bar", {"--method", "explicit", "--stable-step", "bar", "--output", folder / "elastic"});
    CHECK(summary(folder / "elastic")["steps"] == 2108);
    run_well("plastic_bar",
             {"--method", "explicit", "--stable-step", "bar", "--history-every", "100", "--output", folder / "plastic"});
    CHECK(summary(folder / "plastic")["steps"] == 5024);
    run_well("colliding_disks", {"--method", "explicit", "--stable-step", "bar", "--history-every", "100", "--snapshots", "0",
                                 "--output", folder / "disks"});
    CHECK(summary(folder / "disks")["steps"] == 6152);
}

TEST_CASE("explicit steps choose a stable length by themselves; longer ones, and weights below 1/2, are warned of by number") {
    const scratch::Folder folder;
    run_well("elastic_bar",
             {"--method", "explicit", "--poisson-ratio", "0.49", "--history-every", "100", "--output", folder / "bar"});
    // (1 - nu)/((1 + nu)(1 - 2 nu)) = 17.1141: the paper's 2108 steps times its root, and sqrt(2) for square cells
    CHECK_FALSE(contains(summary(folder / "bar")["warnings"].dump(), "stable in cells full of particles"));
    CHECK(summary(folder / "bar")["steps"].get<double>() == doctest::Approx(2108 * std::sqrt(2.0 * 17.1141)).epsilon(1e-3));
    run_well("elastic_bar", {"--method", "explicit", "--stable-step", "bar", "--poisson-ratio", "0.49", "--duration", "0.01",
                             "--output", folder / "long"});
    CHECK(contains(summary(folder / "long")["warnings"].dump(), "2.83 times")); // 0.484015 sqrt(2 * 17.1141)
    // 2/w = 0.00484/0.484015/sqrt(2) = 0.00707 s bounds explicit steps in the momentum form, 1/sqrt(2) times that in the velocity
    // form, and twice as much for mu = 0.375; 0.861 times as much with B-splines
    for (const auto& [how, shorter, longer] : {std::tuple{Arguments{"--method", "explicit"}, "0.0070", "0.0072"},
                                               {Arguments{"--method", "explicit", "--shape", "bspline"}, "0.0060", "0.0062"},
                                               {Arguments{"--method", "explicit", "--form", "velocity"}, "0.0049", "0.0051"},
                                               {Arguments{"--mu", "0.375", "--form", "momentum"}, "0.0140", "0.0142"},
                                               {Arguments{"--mu", "0.375"}, "0.0099", "0.0101"}})
        for (const std::string dt : {shorter, longer}) {
            CAPTURE_BINDING(how);
            run_well("elastic_bar",
                     how + Arguments{"--poisson-ratio", "0", "--dt", dt, "--duration", "0.1", "--output", folder / "run"});
            CHECK(contains(summary(folder / "run")["warnings"].dump(), "full of particles") == (dt == longer));
            fs::remove_all(folder / "run");
        }
}

TEST_CASE("the elastic bar without lateral contraction has the stress of (3.1.1), whatever the step") {
    const scratch::Folder folder;
    for (const Arguments& how : {Arguments{"--method", "explicit"},
                                 {"--dt", "0.5", "--dt-start", "0.0048"},
                                 {"--dt", "0.5"},
                                 {"--form", "momentum", "--dt", "0.1"},
                                 {"--method", "quasi-static", "--dt", "0.1"}}) {
        run_well("elastic_bar", how + Arguments{"--poisson-ratio", "0", "--output", folder / "run"});
        const nlohmann::json s = summary(folder / "run");
        const double expected = 1000.0 * 1e-3 * s["simulated_time_s"].get<double>() / 0.3; // E v t/L
        CHECK(s["final_mean_stress_xx_Pa"].get<double>() == doctest::Approx(expected).epsilon(0.01));
        fs::remove_all(folder / "run");
    }
}

TEST_CASE("the plastic bar under plane stress follows the uniaxial closed form while the strain is small") {
    // sigma = Y + E H/(E + H) (eps - Y/E), on the deformed length: the grid's strain is logarithmic once particles move with it
    const scratch::Folder folder;
    run_well("plastic_bar", {"--geometry", "plane-stress", "--poisson-ratio", "0", "--dt", "0.1", "--duration", "9", "--output",
                             folder / "run"});
    const nlohmann::json s = summary(folder / "run");
    const double strain = s["final_nominal_strain"].get<double>();
    CHECK(s["final_mean_stress_xx_Pa"].get<double>() ==
          doctest::Approx(6.0 + 1000.0 * 5000.0 / 6000.0 * (strain - 0.006)).epsilon(0.06));
}

TEST_CASE("upsetting: explicit and implicit runs press the billet alike; failing steps are repeated and counted") {
    const scratch::Folder folder;
    const Arguments scene = {"--duration", "3e-3", "--snapshots", "", "--history-every", "10"};
    run_well("upsetting", scene + Arguments{"--method", "explicit", "--stable-step", "bar", "--history-every", "200", "--output",
                                            folder / "explicit"});
    run_well("upsetting", scene + Arguments{"--dt", "5e-5", "--output", folder / "implicit"});
    const nlohmann::json a = summary(folder / "explicit"), b = summary(folder / "implicit");
    for (const char* name : {"final_radius_m", "final_height_m"})
        CHECK(b[name].get<double>() == doctest::Approx(a[name].get<double>()).epsilon(0.005));
    CHECK(b["mean_load_of_last_3_percent_N"].get<double>() ==
          doctest::Approx(a["mean_load_of_last_3_percent_N"].get<double>()).epsilon(0.03));
    // the momentum form takes every step, too: its line search goes by work, not by the momentum's own components
    run_well("upsetting", scene + Arguments{"--dt", "1e-4", "--form", "momentum", "--output", folder / "momentum"});
    CHECK(summary(folder / "momentum")["rejected_steps"] == 0);
    // a step of more than a cell is cut; a tolerance below round-off cannot be met by any step
    run_well("upsetting", scene + Arguments{"--dt", "1e-2", "--output", folder / "long"});
    CHECK(summary(folder / "long")["steps"].get<int>() >= 4);
    const nlohmann::json cut = summary(folder / "long");
    // all but the last, which lands on the end
    CHECK(cut.value("steps_cut_by_rigid_travel", 0) + cut.value("steps_ended_at_contact", 0) == cut["steps"].get<int>() - 1);
    const Outcome outcome = run("upsetting", scene + Arguments{"--newton-iterations", "8", "--residual-scale", "none",
                                                               "--newton-tolerance", "1e-300", "--output", folder / "hopeless"});
    CHECK(outcome.status == 1);
    CHECK(contains(outcome.errors, "failed even with dt = "));
    CHECK(summary(folder / "hopeless")["status"] == "failed");
    CHECK(summary(folder / "hopeless")["rejected_steps"].get<int>() > 20);
    CHECK(summary(folder / "hopeless")["rejected_without_convergence"] == summary(folder / "hopeless")["rejected_steps"]);
}

TEST_CASE("upsetting without friction is uniaxial compression: the load follows the hardening law on the spread section") {
    const scratch::Folder folder;
    run_well("upsetting", {"--frictionless", "--shape", "bspline", "--dt", "2e-5", "--duration", "4e-3", "--snapshots", "0",
                           "--output", folder / "run"});
    const nlohmann::json s = summary(folder / "run");
    // logarithmic strain of the height, corrected for the elastic part; the volume of the billet stays but for the elastic change
    const double strain = std::log(14.75e-3 / s["final_height_m"].get<double>()); // of the uppermost particles
    const double sigma = (0.7e9 + 0.3e9 * strain) / (1.0 + 0.3 / 200.0);
    const double section = std::numbers::pi * 10e-3 * 10e-3 * std::exp(strain);
    CHECK(s["mean_load_of_last_3_percent_N"].get<double>() == doctest::Approx(sigma * section).epsilon(0.04));
}

TEST_CASE("the bar of Taylor's test and the vibrating one end where others found them") {
    const scratch::Folder folder;
    run_well("taylor_bar", {"--output", folder / "taylor"});
    const nlohmann::json taylor = summary(folder / "taylor");
    CHECK(taylor["final_length_m"].get<double>() == doctest::Approx(21.45e-3).epsilon(0.005)); // 21.42-21.47 mm in the literature
    CHECK(taylor["warnings"].empty());
    CHECK(taylor["final_foot_radius_m"].get<double>() == doctest::Approx(7.15e-3).epsilon(0.015)); // 7.1-7.24 mm
    run_well("vibrating_bar", {"--duration", "30", "--output", folder / "vibrating"});
    const nlohmann::json vibrating = summary(folder / "vibrating");
    CHECK(vibrating["period_s"].get<double>() == doctest::Approx(10.0).epsilon(0.001));
    CHECK(vibrating["largest_tip_displacement_m"].get<double>() == doctest::Approx(0.15915).epsilon(0.003));
}

TEST_CASE("no number of the summary depends on which rows are written; snapshots are at the times asked for") {
    const scratch::Folder folder;
    const auto numbers = [&](const std::string& program, const Arguments& how, const std::string& every) {
        run_well(program, how + Arguments{"--history-every", every, "--output", folder / "run"});
        nlohmann::json s = summary(folder / "run");
        s["rows"] = std::ranges::count(scratch::read(folder / "run/history.csv"), '\n') - 1;
        const Hdf5File fields = Hdf5File::open(folder / "run" / "fields.h5");
        for (const std::string& snapshot : fields.members("snapshots"))
            s["times"].push_back(fields.double_attribute("snapshots/" + snapshot, "time_s"));
        fs::remove_all(folder / "run");
        return s;
    };
    for (const auto& [program, how] : {std::pair<std::string, Arguments>{"colliding_disks", {}},
                                       {"upsetting", {"--duration", "3e-3"}},
                                       {"plastic_bar", {"--dt", "0.25"}},
                                       {"vibrating_bar", {"--duration", "30"}},
                                       {"taylor_bar", {"--duration", "5e-6"}}}) {
        CAPTURE_BINDING(program);
        const nlohmann::json all = numbers(program, how, "1"), few = numbers(program, how, "100000");
        CHECK(all["extra"] == few["extra"]);
        CHECK(all["warnings"] == few["warnings"]);
        CHECK(all["rows"] == all["steps"].get<int>() + 1); // and the start
        CHECK(few["rows"] == 2);
        if (program == "colliding_disks") {
            CHECK(few["energy_kept"].get<double>() == doctest::Approx(0.37283).epsilon(1e-4));
            CHECK(few["times"] == nlohmann::json{0.0, 25.0, 75.0, 100.0, 150.0});
        }
        if (program == "upsetting")
            CHECK(few["times"] == nlohmann::json{0.0, 3e-3});
    }
}

TEST_CASE("every method knows what lies within its steps, and changes none for it") {
    const scratch::Folder folder;
    for (const std::string method : {"explicit", "implicit", "midpoint", "quasi-static"}) {
        CAPTURE(method);
        run_well("elastic_bar",
                 {"--method", method, "--dt", "0.0048", "--snapshots", "0,0.1,0.1000000000000001,0.25,0.30000000000000004,7",
                  "--duration", "0.3", "--output", folder / "run"});
        const nlohmann::json s = summary(folder / "run");
        CHECK(s["simulated_time_s"] == 0.3);
        CHECK(s["steps"] == 63); // 0.3/0.0048
        const Hdf5File fields = Hdf5File::open(folder / "run" / "fields.h5");
        std::vector<double> times;
        for (const std::string& snapshot : fields.members("snapshots"))
            times.push_back(fields.double_attribute("snapshots/" + snapshot, "time_s"));
        REQUIRE(times.size() == 4);
        CHECK(times[0] == 0.0);
        CHECK(times[1] == doctest::Approx(0.1).epsilon(1e-14));
        CHECK(times[2] == 0.25);
        CHECK(times[3] == 0.3);
        fs::remove_all(folder / "run");
    }
}

TEST_CASE("snapshots and rows at equal times change no bit of a run") {
    for (const auto& [program, how] :
         {std::pair{std::string("upsetting"), Arguments{"--dt", "1e-4", "--duration", "2e-3"}},
          {"upsetting", Arguments{"--method", "explicit", "--duration", "1e-3", "--history-every", "50"}},
          {"colliding_disks", Arguments{"--dt", "1", "--method", "midpoint", "--duration", "75"}}}) {
        CAPTURE_BINDING(program);
        CAPTURE_BINDING(how);
        const scratch::Folder folder;
        run_well(program, how + Arguments{"--snapshots", "", "--output", folder / "bare"});
        const double end = summary(folder / "bare")["simulated_time_s"], interval = end / 7.0;
        run_well(program, how + Arguments{"--snapshots", "", "--snapshots-every", fmt::format("{:.17g}", interval), "--output",
                                          folder / "snapshots"});
        run_well(program, how + Arguments{"--snapshots", "", "--rows-every", fmt::format("{:.17g}", interval), "--output",
                                          folder / "rows"});
        CHECK(scratch::read(folder / "snapshots/history.csv") == scratch::read(folder / "bare/history.csv"));
        for (const char* key : {"steps", "warnings"})
            CHECK(summary(folder / "rows")[key] == summary(folder / "bare")[key]);
        CHECK(Hdf5File::open(folder / "snapshots/fields.h5").members("snapshots").size() == 8);
        const HistoryTable rows = read_history(folder / "rows/history.csv"), bare = read_history(folder / "bare/history.csv");
        REQUIRE(rows.column("time_s").size() == 8);
        for (std::size_t k = 0; k < 8; ++k) {
            CHECK(rows.column("time_s")[k] == doctest::Approx(static_cast<double>(k) * interval).epsilon(1e-12));
            const std::vector<double> times = bare.column("time_s"), energies = bare.column("total_energy_J");
            const auto place = std::ranges::lower_bound(times, static_cast<double>(k) * interval * (1.0 - 1e-12));
            const auto after = static_cast<std::size_t>(place - times.begin());
            const double a = energies[after > 0 ? after - 1 : 0], b = energies[after];
            CHECK(std::abs(rows.column("total_energy_J")[k] - 0.5 * (a + b)) <= 1.5 * std::abs(b - a) + 1e-9 * std::abs(a));
        }
        CHECK(rows.column("total_energy_J").back() == bare.column("total_energy_J").back());
    }
}

TEST_CASE("the programs' own runs are not doubted; what is doubtful is said with its figure") {
    const scratch::Folder folder;
    // what implicit steps damp away is what these programs show, and particles cross cells
    std::string damped, crossed, of_law;
    const auto warnings = [&](const std::string& program, const Arguments& how) {
        run_well(program, how + Arguments{"--output", folder / "run"});
        std::string all;
        damped.clear();
        crossed.clear();
        of_law.clear();
        const nlohmann::json s = summary(folder / "run");
        for (const auto& warning : s["warnings"]) {
            const auto text = warning.get<std::string>();
            (contains(text, "the steps have damped")                ? damped
             : contains(text, "of it because the law in rate form") ? of_law
             : contains(text, "have crossed into other cells")      ? crossed
                                                                    : all) += text + "\n";
        }
        fs::remove_all(folder / "run");
        return all;
    };
    for (const auto& [program, damps] : {std::pair{"elastic_bar", false},
                                         {"plastic_bar", false},
                                         {"colliding_disks", true},
                                         {"upsetting", true},
                                         {"vibrating_bar", false}}) {
        CAPTURE_BINDING(program);
        CHECK(warnings(program, {}) == "");
        CHECK(damped.empty() == !damps);
        CHECK(of_law.empty() == (program != std::string("plastic_bar")));
        CHECK(crossed.empty() == (program != std::string("colliding_disks") && program != std::string("upsetting")));
    }
    CHECK(warnings("colliding_disks", {"--method", "midpoint", "--dt", "0.05"}) == "");
    CHECK(damped.empty());
    CHECK(warnings("elastic_bar", {"--method", "explicit"}) == "");
    const auto by_method = [&](const char* mu) { // of the work
        run_well("elastic_bar", Arguments{"--mu", mu, "--output", folder / "mu"});
        const nlohmann::json s = summary(folder / "mu");
        fs::remove_all(folder / "mu");
        return s["extra"]["numerical_dissipation_J"].get<double>() / s["extra"]["work_of_rigid_bodies_J"].get<double>();
    };
    CHECK(std::abs(by_method("1")) < 2e-3);   // by the mean of the forces at both ends
    CHECK(std::abs(by_method("0.5")) < 2e-3); // which is the force itself
    const std::string soft = warnings("upsetting", {"--young-modulus", "200", "--method", "quasi-static", "--duration", "1e-3"});
    CHECK(contains(soft, "the material has Young's modulus 200 Pa at a density of 7800 kg/m^3"));
    CHECK(contains(soft, "3.5e+06 times Young's modulus"));
    for (const Arguments& how : {Arguments{"--method", "implicit"}, {"--method", "quasi-static"}, {"--shape", "gimp"}}) {
        CAPTURE(how);
        CHECK(contains(warnings("plastic_bar", how + Arguments{"--yield-stress", ".06", "--hardening", "0"}),
                       "the particles lock"));
    }
    CHECK(contains(warnings("elastic_bar", {"--poisson-ratio", "0.49"}), "the particles lock"));
    CHECK(contains(warnings("plastic_bar", {"--particles-per-side", "1", "--cell-size", "0.025", "--duration", "14"}),
                   "the rigid body 'grip' let go of the particles"));
    CHECK(warnings("plastic_bar", {"--yield-stress", ".06", "--hardening", "0", "--particles-per-side", "1"}) == "");
    CHECK(contains(warnings("elastic_bar", {"--dt", "0.1", "--duration", "2", "--snapshots", "0,1,3"}),
                   "the snapshot at 3 s lies beyond the end at 2 s"));
    CHECK(warnings("elastic_bar", {"--dt", "0.1", "--duration", "2"}) == ""); // nobody asked for those

    const Outcome header = run("elastic_bar", {"--dt", "0.5", "--output", folder / "run"});
    CHECK(contains(header.output, "material  E = 1000 Pa, nu = 0.3, rho = 10 kg/m^3, wave speed 11.6 m/s"));
}

TEST_CASE("times and speeds out of all proportion end a run and do not stall it") {
    const scratch::Folder folder;
    const Outcome outcome = run("elastic_bar", {"--speed", "1e300", "--output", folder / "run"});
    CHECK(outcome.status == 2);
    CHECK(contains(outcome.errors, "the rigid body 'grip' would cross 1.02e+302 cells of the grid in the run"));
}

TEST_CASE("wrong options end with status 2 and a message, and leave nothing behind") {
    const scratch::Folder folder;
    const fs::path output = folder / "out";
    const auto refused = [&](const std::string& program, const Arguments& arguments, const std::string& message) {
        const Outcome outcome = run(program, arguments + Arguments{"--output", output});
        CAPTURE(program);
        CAPTURE(arguments);
        CAPTURE(outcome.errors);
        CHECK(outcome.status == 2);
        CHECK(outcome.errors.starts_with("error: "));
        CHECK(contains(outcome.errors, message));
        CHECK_FALSE(fs::exists(output));
    };
    refused("elastic_bar", {"--cell-size", "0.03"}, "--cell-size 0.03: it must divide a third of the bar, 0.1 m");
    refused("upsetting", {"--cell-size", "3e-4"}, "--cell-size 0.0003: it must divide a tenth of the billet's radius, 0.001 m");
    refused("taylor_bar", {"--cell-size", "3e-4"}, "--cell-size 0.0003");
    refused("vibrating_bar", {"--cell-size", "7"}, "--cell-size 7");
    refused("colliding_disks", {"--cell-size", "0.3"}, "--cell-size 0.3");
    refused("elastic_bar", {"--poisson-ratio", "0.5"}, "--poisson-ratio 0.5");
    refused("elastic_bar", {"--dt", "soon"}, "--dt soon: it must be a finite number above 0; or auto");
    refused("elastic_bar", {"--dt", "0.1", "--dt-start", "0.2"}, "the first step must not be longer than --dt");
    refused("elastic_bar", {"--mu", "1.5"}, "--mu 1.5");
    refused("elastic_bar", {"--linear-tolerance", "-1"}, "--linear-tolerance -1");
    refused("plastic_bar", {"--solver", "newton-cg", "--form", "momentum"}, "conjugate gradients need the symmetric Jacobian");
    refused("plastic_bar", {"--method", "quasi-static", "--form", "momentum"}, "the quasi-static method has no momentum");
    refused("plastic_bar", {"--hardening", "-1"}, "--hardening -1");
    refused("upsetting", {"--shape", "cubic"}, "--shape cubic: it must be one of linear, gimp, bspline");
    refused("upsetting", {"--particles-per-side", "0"}, "--particles-per-side 0");
    refused("elastic_bar", {"--restart", folder / "none.h5"}, "none.h5: there is no such file");
}

TEST_CASE("the automatic preconditioner: the tangent for long steps, sooner near incompressibility, later in the momentum form") {
    const scratch::Folder folder;
    const auto iterations = [&](const Arguments& how) {
        run_well("plastic_bar", Arguments{"--cell-size", "0.025", "--yield-stress", "0.01", "--snapshots", "0"} + how +
                                    Arguments{"--output", folder / "run"});
        const auto count = summary(folder / "run")["linear_iterations"].get<int>();
        fs::remove_all(folder / "run");
        return count;
    };
    const Arguments long_step = {"--dt", "0.012", "--duration", "0.12"};    // 10 explicit steps
    const Arguments short_step = {"--dt", "0.0014", "--duration", "0.014"}; // 1.2
    for (const auto& [how, chosen] : {std::pair{long_step, "tangent"},
                                      {short_step, "diagonal"},
                                      {short_step + Arguments{"--poisson-ratio", "0.49"}, "tangent"},
                                      {Arguments{"--dt", "0.006", "--duration", "0.06"}, "tangent"}, // 5
                                      {Arguments{"--dt", "0.006", "--duration", "0.06", "--form", "momentum"}, "diagonal"}}) {
        CAPTURE_BINDING(how);
        const int automatic = iterations(how), tangent = iterations(how + Arguments{"--preconditioner", "tangent"}),
                  diagonal = iterations(how + Arguments{"--preconditioner", "diagonal"});
        CHECK(tangent != diagonal);
        CHECK(automatic == (std::string(chosen) == "tangent" ? tangent : diagonal));
    }
}

TEST_CASE("a run that cannot go on ends with status 1, says why, and leaves whole files") {
    const Arguments hopeless = {"--residual-scale",    "none", "--newton-tolerance", "1e-300",
                                "--newton-iterations", "3",    "--krylov-vectors",   "3"};
    for (const auto& [program, how, message] :
         {std::tuple{"elastic_bar", hopeless + Arguments{"--dt", "0.1"}, "failed even with dt = "},
          {"plastic_bar", hopeless + Arguments{"--dt", "0.1", "--form", "momentum"}, "failed even with dt = "},
          {"colliding_disks", {"--dt", "0.5", "--method", "midpoint", "--duration", "1e3"}, "would leave the background grid"},
          {"colliding_disks",
           {"--method", "explicit", "--dt", "auto", "--duration", "1e3", "--history-every", "100"},
           "would leave the background grid"},
          {"upsetting", {"--method", "explicit", "--dt", "1e-6"}, "the step is too long for the explicit method"},
          {"vibrating_bar", hopeless, "failed even with dt = "},
          {"taylor_bar", {"--dt", "1e-6"}, "the step is too long for the explicit method"}}) {
        CAPTURE_BINDING(program);
        const scratch::Folder folder;
        const Outcome outcome = run(program, how + Arguments{"--snapshots", "0", "--output", folder / "run"});
        CAPTURE(outcome.errors);
        CHECK(outcome.status == 1);
        CHECK(contains(outcome.errors, message));
        CHECK(summary(folder / "run")["status"] == "failed");
        CHECK(contains(summary(folder / "run")["reason"].get<std::string>(), message));
        CHECK(Hdf5File::open(folder / "run" / "fields.h5").members("snapshots").size() == 1);
        CHECK_FALSE(fs::exists(folder / "run" / "fields.h5.partial"));
        // the state before the step that failed is kept, with every particle in the grid
        CHECK(contains(outcome.errors, "the last good state is in " + (folder / "run/checkpoint.h5").string()));
        const CheckpointReader kept(folder / "run/checkpoint.h5", program);
        CHECK(kept.counter("step") == summary(folder / "run")["steps"]);
        for (const char* coordinate : {"particles/x", "particles/y"})
            for (const double place : kept.vector(coordinate))
                CHECK((place >= 0.0 && place <= (program == std::string("colliding_disks") ? 1.0 : 27.0)));
    }
}

TEST_CASE("a checkpoint that does not fit is refused") {
    const scratch::Folder folder;
    run_well("elastic_bar", {"--dt", "0.5", "--output", folder / "run"});
    const fs::path checkpoint = folder / "run/checkpoint.h5";
    for (const auto& [arguments, message] :
         {std::pair{Arguments{"--duration", "9"}, std::string("the checkpoint is at t = 10 s already")},
          {Arguments{"--cell-size", "0.05", "--duration", "20"}, "--cell-size: the checkpoint has 0.1, this run asks for 0.05"},
          {Arguments{"--speed", "2e-3", "--duration", "20"}, "--speed: the checkpoint has 0.001, this run asks for 0.002"},
          {Arguments{"--shape", "gimp", "--duration", "20"}, "--shape: the checkpoint has linear, this run asks for gimp"}}) {
        const Outcome outcome = run("elastic_bar", Arguments{"--restart", checkpoint} + arguments);
        CAPTURE(outcome.errors);
        CHECK(outcome.status == 2);
        CHECK(contains(outcome.errors, message));
    }
    CHECK(contains(run("plastic_bar", {"--restart", checkpoint}).errors, "written by elastic_bar"));
}

TEST_CASE("a run that no machine ends is refused") {
    const scratch::Folder folder;
    for (const Arguments& how : {Arguments{"--dt", "1e-300"},
                                 {"--dt", "1e-9"},
                                 {"--dt-start", "1e-9", "--step-growth", "1"},
                                 {"--dt-start", "1e-300", "--step-growth", "1.0000001"},
                                 {"--method", "explicit", "--safety", "1e-30"},
                                 {"--method", "explicit", "--young-modulus", "1e30"}}) {
        const Outcome outcome = run("elastic_bar", how + Arguments{"--output", folder / "run"});
        CAPTURE(outcome.errors);
        CHECK(outcome.status == 2);
        CHECK(contains(outcome.errors, "steps, which no machine ends"));
    }
}

TEST_CASE("a restart of a restart gives the bits of the uninterrupted run, for every program") {
    const auto compare = [](const std::string& program, const std::vector<std::string>& durations, const Arguments& how,
                            const std::string& snapshots = "") {
        CAPTURE(program);
        CAPTURE(how);
        const scratch::Folder folder;
        // the whole run ends a step where the parts begin
        const std::string joints = durations[0] + "," + durations[1] + (snapshots.empty() ? "" : ",") + snapshots;
        const Arguments scene = how + Arguments{"--snapshots", joints};
        run_well(program, scene + Arguments{"--duration", durations[2], "--output", folder / "whole"});
        run_well(program, scene + Arguments{"--duration", durations[0], "--output", folder / "parts"});
        for (std::size_t k : {1, 2})
            run_well(program, {"--restart", folder / "parts/checkpoint.h5", "--duration", durations[k]});
        CHECK(result_in(folder / "parts", program) == result_in(folder / "whole", program));
        CHECK(result_in(folder / "parts", program).counters["step"] > 3);
        CHECK(summary(folder / "parts")["extra"] == summary(folder / "whole")["extra"]);
        CHECK(summary(folder / "parts")["warnings"] == summary(folder / "whole")["warnings"]);
    };
    const std::vector<std::string> bar{"3", "5", "8"};
    for (const Arguments& how : {Arguments{"--method", "explicit"}, {"--dt", "0.5", "--dt-start", "0.01"}})
        compare("elastic_bar", bar, how, "0,4,6");
    for (const Arguments& how :
         {Arguments{}, {"--solver", "kinsol-gmres"}, {"--form", "momentum"}, {"--geometry", "plane-stress"}})
        compare("plastic_bar", bar, how + Arguments{"--dt", "0.25"}, "4");
    compare("colliding_disks", {"66", "69", "72"}, {"--dt", "0.5"}, "70");
    compare("colliding_disks", {"66", "69", "72"}, {"--method", "explicit", "--dt", "auto"}, "70");
    compare("upsetting", {"6e-4", "1.2e-3", "2e-3"}, {"--dt", "1e-4"}, "1e-3");
    compare("upsetting", {"6e-4", "1.2e-3", "2e-3"}, {"--dt", "3e-4", "--krylov-vectors", "8", "--preconditioner", "diagonal"},
            "1e-3");
    // stopped once before contact and once in the ramp after it
    compare("upsetting", {"2e-4", "4e-4", "7e-4"}, {"--dt", "1e-4", "--dt-start", "2e-5", "--many-newton", "4"});
    compare("vibrating_bar", {"3", "5", "8"}, {"--dt", "0.2"});
    compare("taylor_bar", {"4e-6", "8e-6", "12e-6"}, {"--history-every", "1"}, "6e-6");
}

TEST_CASE("a run that was killed after its last checkpoint is brought to its end") {
    for (const Arguments& rows : {Arguments{}, {"--history-every", "1000"}, {"--history-every", "4"}}) {
        CAPTURE(rows);
        const scratch::Folder folder;
        const fs::path run_folder = folder / "run";
        run_well("upsetting",
                 rows + Arguments{"--dt", "1e-4", "--duration", "1e-3", "--snapshots", "5e-4,1e-3", "--output", run_folder});
        const auto whole = result_in(run_folder, "upsetting");
        const auto told = summary(run_folder);
        scratch::leave_as_killed(run_folder);
        for (int repeat = 0; repeat < 2; ++repeat) { // harmless where there is nothing left to do
            run_well("upsetting", {"--restart", run_folder / "checkpoint.h5"});
            CHECK(result_in(run_folder, "upsetting") == whole);
            CHECK_FALSE(fs::exists(run_folder / "history.csv.partial"));
            CHECK_FALSE(fs::exists(run_folder / "fields.h5.partial"));
            for (const char* key : {"status", "steps", "newton_iterations", "extra", "warnings"})
                CHECK(summary(run_folder)[key] == told[key]);
        }
    }
}

TEST_CASE("an interrupted run ends with status 130, and goes on as if it had never stopped") {
    const scratch::Folder folder;
    const Arguments scene = {"--dt", "1e-5", "--duration", "2e-3", "--snapshots", "1e-3"};
    run_well("upsetting", scene + Arguments{"--output", folder / "whole"});
    // A checkpoint at every step makes the run slow enough to be hit.
    ChildProcess process(command("upsetting", scene + Arguments{"--output", folder / "parts", "--checkpoint-every", "1e-9"}));
    for (int wait = 0; wait < 10'000 && !fs::exists(folder / "parts/checkpoint.h5"); ++wait)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    process.signal(SIGINT);
    REQUIRE(process.wait() == 130);
    CHECK(summary(folder / "parts")["status"] == "interrupted");
    CHECK(result_in(folder / "parts", "upsetting").counters["step"] < 200);
    run_well("upsetting", {"--restart", folder / "parts/checkpoint.h5", "--checkpoint-every", "600"});
    CHECK(result_in(folder / "parts", "upsetting") == result_in(folder / "whole", "upsetting"));
}

TEST_CASE("a full disk ends a run with status 1; what it had written is whole") {
    for (const rlim_t bytes : {1'000, 20'000, 60'000}) {
        CAPTURE(bytes);
        const scratch::Folder folder;
        const Outcome outcome = run("upsetting", {"--dt", "1e-4", "--output", folder / "run"}, bytes);
        CAPTURE(outcome.errors);
        CHECK(outcome.status == 1);
        CHECK(contains(outcome.errors, (folder / "run").string()));
        for (const char* file : {"fields.h5", "checkpoint.h5"})
            if (fs::exists(folder / "run" / file))
                CHECK_NOTHROW((void)Hdf5File::open(folder / "run" / file).members("/"));
    }
}

TEST_SUITE_END();

} // namespace mpm_programs_suite
