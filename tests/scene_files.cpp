// SPDX-License-Identifier: GPL-3.0-or-later
// Scene files as their users meet them: every program prints one, ./ductile scene runs it with the same bits, and says what is
// wrong.
#include "capture.hpp"
#include "child_process.hpp"
#include "messages.hpp"

#include <ductile/io/config_file.hpp>
#include <ductile/io/hdf5.hpp>
#include <ductile/io/history.hpp>
#include <ductile/io/option_values.hpp>

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <string>
#include <tuple>
#include <vector>

namespace scene_files_suite {

using namespace ductile;
using namespace ductile::io;
using scratch::Arguments;
using scratch::Outcome;
using scratch::operator+;
using scratch::run;
namespace fs = std::filesystem;

namespace {

const fs::path scenes = DUCTILE_SCENES;

void run_well(const std::string& program, const Arguments& arguments) {
    const Outcome outcome = run(program, arguments + Arguments{"--quiet"});
    CAPTURE(program);
    CAPTURE(arguments);
    CAPTURE(outcome.errors);
    REQUIRE(outcome.status == 0);
}

/// Every dataset of the snapshots.
std::map<std::string, std::vector<double>> fields_in(const fs::path& folder) {
    std::map<std::string, std::vector<double>> fields;
    const Hdf5File file = Hdf5File::open(folder / "fields.h5");
    for (const std::string& snapshot : file.members("snapshots"))
        for (const std::string& name : file.members("snapshots/" + snapshot))
            if (const std::string path = "snapshots/" + snapshot + "/" + name; name != "position") {
                const std::vector<std::size_t> shape = file.shape(path);
                const auto rows = static_cast<int>(shape.size() == 2 ? shape[0] : 1), columns = static_cast<int>(shape.back());
                std::vector<double>& values = fields[snapshot + "/" + name];
                values.resize(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns));
                if (shape.size() == 2)
                    file.read(path, {values.data(), rows, columns, columns});
                else
                    values = file.read_doubles(path);
            }
    return fields;
}

/// Whether they are the same to the last bit; NaN equals itself.
bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

void check_same_run(const fs::path& a, const fs::path& b) {
    const HistoryTable first = read_history(a / "history.csv"), second = read_history(b / "history.csv");
    REQUIRE(first.rows() > 3);
    REQUIRE(first.rows() == second.rows());
    for (const std::string& column : first.columns)
        if (std::ranges::find(second.columns, column) != second.columns.end()) {
            CAPTURE(column);
            CHECK(same_bits(first.column(column), second.column(column)));
        }
    const auto fields = fields_in(a), others = fields_in(b);
    REQUIRE(!fields.empty());
    CHECK(fields.size() == others.size());
    for (const auto& [name, values] : fields) {
        CAPTURE_BINDING(name);
        REQUIRE(others.contains(name));
        CHECK(same_bits(values, others.at(name)));
    }
}

/// The lines that are no comments.
std::string values_of(const std::string& text) {
    std::string values;
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        if (text[begin] != '#')
            values += text.substr(begin, end - begin) + "\n";
        begin = end + 1;
    }
    return values;
}

/// A short scene of points, with a line changed or added.
std::string billet(const std::string& from = {}, const std::string& to = {}) {
    std::string text = R"(carrier = "points"
cell-size = 2e-3
dt = 1e-4
duration = 2e-3

[grid]
geometry = "axisymmetric"
width = 0.024
height = 0.018

[sides]
left = "slip"
bottom = "slip"

[materials.steel]
law = "von-mises"
young-modulus = 200e9
poisson-ratio = 0.3
density = 7800
yield-stress = 0.7e9

[[bodies]]
name = "billet"
material = "steel"
shape = {rectangle = [0, 0, 0.01, 0.014]}

[[rigid-bodies]]
name = "platen"
shape = {rectangle = [0, 0.014, 0.024, 0.018]}
velocity = [0, -1]

[[observables]]
name = "load_N"
quantity = "force-y"
)";
    if (!from.empty())
        text.replace(text.find(from), from.size(), to);
    return text;
}

/// A scene stopped at 7e-4 s goes on to 2e-3 s with the same bits, and is the same when it has been printed and read again.
void check_goes_on(const scratch::Folder& folder, const std::string& text) {
    const std::string scene = folder / "scene.toml";
    scratch::write(scene, text);
    run_well("scene", {scene, "--snapshots", "7e-4,1.2e-3", "--output", folder / "whole"});
    run_well("scene", {scene, "--snapshots", "7e-4,1.2e-3", "--duration", "7e-4", "--output", folder / "parts"});
    run_well("scene", {"--restart", folder / "parts/checkpoint.h5", "--duration", "2e-3"});
    CHECK(scratch::read(folder / "whole/history.csv") == scratch::read(folder / "parts/history.csv"));
    check_same_run(folder / "whole", folder / "parts");
    scratch::write(folder / "printed.toml", run("scene", {scene, "--print-config"}).output);
    run_well("scene", {folder / "printed.toml", "--snapshots", "7e-4,1.2e-3", "--output", folder / "again"});
    CHECK(scratch::read(folder / "whole/history.csv") == scratch::read(folder / "again/history.csv"));
}

/// A text in a scene, another one instead, and what is said about it.
using Change = std::tuple<std::string, std::string, std::string>;
void check_refused(const scratch::Folder& folder, const std::string& text, const std::vector<Change>& changes) {
    for (const auto& [from, to, message] : changes) {
        std::string other = text;
        const std::size_t place = other.find(from);
        REQUIRE(place != std::string::npos);
        other.replace(place, from.size(), to);
        scratch::write(folder / "other.toml", other);
        const Outcome outcome = run("scene", {folder / "other.toml", "--output", folder / "none"});
        CAPTURE(outcome.errors);
        CHECK(outcome.status == 2);
        CHECK(contains(outcome.errors, message));
    }
}

} // namespace

TEST_SUITE_BEGIN("scene_files");

TEST_CASE("what --print-config prints, scene runs with the same bits: own options are in the tables") {
    for (const auto& [program, how] :
         {std::pair<std::string, Arguments>{"elastic_bar", {"--dt", "0.5", "--speed", "2e-3", "--direction", "compression"}},
          {"plastic_bar", {"--dt", "0.5", "--geometry", "plane-stress", "--hardening", "100", "--form", "momentum"}},
          {"colliding_disks", {"--duration", "80", "--snapshots", "70,80", "--young-modulus", "1100"}},
          {"upsetting", {"--duration", "2e-3", "--snapshots", "1e-3", "--frictionless", "--speed", "1.5"}},
          {"vibrating_bar", {"--duration", "5", "--snapshots", "5", "--length", "20", "--particles-per-side", "3"}},
          {"taylor_bar", {"--duration", "4e-6", "--snapshots", "4e-6", "--speed", "200", "--history-every", "1"}},
          {"shear_band",
           {"--cells", "24x16", "--duration", "0.9", "--snapshots", "0.5,0.9", "--initial", "random", "--initial-amplitude",
            "10"}}}) {
        CAPTURE_BINDING(program);
        const scratch::Folder folder;
        const Outcome printed = run(program, how + Arguments{"--print-config"});
        REQUIRE(printed.status == 0);
        scratch::write(folder / "scene.toml", printed.output);
        for (const std::string key : {"speed", "direction", "frictionless"})
            CHECK_FALSE(contains(printed.output, "\n" + key + "="));
        run_well(program, how + Arguments{"--output", folder / "program"});
        run_well("scene", {folder / "scene.toml", "--output", folder / "scene"});
        CHECK(scratch::read(folder / "program/history.csv") == scratch::read(folder / "scene/history.csv"));
        check_same_run(folder / "program", folder / "scene");
        // and once more: what scene prints is that scene
        const Outcome again = run("scene", {folder / "scene.toml", "--print-config"});
        scratch::write(folder / "again.toml", again.output);
        CHECK(values_of(run("scene", {folder / "again.toml", "--print-config"}).output) == values_of(again.output));
        CHECK(values_of(again.output) == values_of(printed.output));
        const Outcome refused = run(program, {"--config", folder / "scene.toml"});
        if (program == "shear_band") {
            CHECK(run(program, {"--config", folder / "scene.toml", "--print-config"}).output == printed.output);
        } else {
            CHECK(refused.status == 2);
            CHECK(contains(refused.errors, "it is ./ductile scene FILE that runs a scene with tables"));
        }
    }
}

TEST_CASE("the scene files of the papers give the bits of the programs") {
    for (const auto& [program, file, how] :
         {std::tuple<std::string, std::string, Arguments>{"elastic_bar", "elastic-bar", {"--duration", "5", "--snapshots", "5"}},
          {"plastic_bar", "plastic-bar", {"--duration", "5", "--snapshots", "5"}},
          {"colliding_disks", "colliding-disks", {"--duration", "72", "--snapshots", "72"}},
          {"upsetting", "upsetting", {"--duration", "2e-3", "--snapshots", "2e-3"}},
          {"vibrating_bar", "vibrating-bar", {"--duration", "5", "--snapshots", "5"}},
          {"taylor_bar", "taylor-bar", {"--duration", "4e-6", "--snapshots", "4e-6"}},
          {"shear_band", "shear-band", {"--cells", "24", "--duration", "0.7", "--snapshots", "0.7"}}}) {
        CAPTURE_BINDING(file);
        const scratch::Folder folder;
        run_well(program, how + Arguments{"--output", folder / "program"});
        run_well("scene", Arguments{scenes / (file + ".toml")} + how + Arguments{"--output", folder / "scene"});
        check_same_run(folder / "program", folder / "scene");
    }
}

TEST_CASE("a run of another length shows its end, where nobody says when snapshots are taken") {
    for (const auto& [program, how, name, end] :
         {std::tuple<std::string, Arguments, const char*, double>{
              "shear_band", {"--cells", "16", "--duration", "0.5"}, "snapshots/000002", 0.5},
          {"elastic_bar", {"--duration", "5"}, "snapshots/000001", 5.0}}) {
        CAPTURE_BINDING(program);
        const scratch::Folder folder;
        run_well(program, how + Arguments{"--output", folder / "run"});
        CHECK(io::Hdf5File::open(folder / "run/fields.h5").double_attribute(name, "time_s") ==
              doctest::Approx(end).epsilon(1e-12));
    }
}

TEST_CASE("every scene file runs") {
    int files = 0;
    for (const auto& entry : fs::directory_iterator(scenes)) {
        const std::string file = entry.path().string();
        CAPTURE(file);
        REQUIRE(entry.path().extension() == ".toml");
        ++files;
        const std::string text = scratch::read(entry.path());
        CHECK(text.starts_with("# "));
        CHECK(contains(text.substr(0, text.find("carrier")), "Look at "));
        const double duration = parse_number(read_config(text, file).find("duration")->text);
        const bool grid = contains(text, "carrier = \"grid\""), elements = contains(text, "space = \"elements\"");
        const double share = contains(file, "finest") ? 0.002 : 0.02;
        const scratch::Folder folder;
        run_well("scene", Arguments{file, "--duration", fmt::format("{}", share * duration), "--output", folder / "run"} +
                              (grid && !elements ? Arguments{"--cells", "32"} : Arguments{}));
        CHECK(read_history(folder / "run/history.csv").rows() > 1);
        // nothing in it is doubtful, but that such a short run has few steps
        const auto summary = nlohmann::json::parse(scratch::read(folder / "run/summary.json"));
        for (const auto& warning : summary.at("warnings")) {
            const auto sentence = warning.get<std::string>();
            const bool known = contains(sentence, "beyond the end") || contains(sentence, "the steps have damped") ||
                               contains(sentence, "are lost in steps") || contains(sentence, "the finest scales of the space") ||
                               contains(sentence, "holds nodes half a cell beyond") ||
                               contains(sentence, "oscillates faster than the steps follow"); // explicit: looked at twice or so
            CHECK_MESSAGE(known, sentence);
        }
    }
    CHECK(files >= 20);
}

TEST_CASE("an accuracy goes before the cells of a scene's file, not before those beside it") {
    const scratch::Folder folder;
    const Arguments scene = {scenes / "wall-band.toml", "--duration", "0.05"};
    const Outcome outcome = run("scene", scene + Arguments{"--accuracy", "1e-2", "--output", folder / "run"});
    CAPTURE(outcome.errors);
    REQUIRE(outcome.status == 0);
    CHECK(contains(outcome.output, "accuracy  goes before what the file says of --cells, --element-edges\n"));
    const auto summary = nlohmann::json::parse(scratch::read(folder / "run/summary.json"));
    CHECK(summary.at("parameters").at("cells") != "48x112");
    CHECK(summary.at("extra").at("estimated_error_stress").get<double>() < 1e-2);
    const std::string file = folder / "both.toml";
    scratch::write(file, scratch::read(scenes / "wall-band.toml") + "accuracy = 1e-3\n");
    for (const Arguments& arguments : {Arguments{file}, scene + Arguments{"--accuracy", "1e-3", "--cells", "48x112"}}) {
        const Outcome refused = run("scene", arguments + Arguments{"--output", folder / "none"});
        CHECK(refused.status == 2);
        CHECK(contains(refused.errors, "--accuracy 0.001 and --cells: the one finds the other"));
        CHECK_FALSE(fs::exists(folder / "none"));
    }
}

TEST_CASE("a bar is pulled, held, let back and pulled again as its history says") {
    const scratch::Folder folder;
    run_well("scene", {scenes / "bar-load-unload-reload.toml", "--output", folder / "run"});
    const HistoryTable table = read_history(folder / "run/history.csv");
    const std::vector<double> time = table.column("time_s"), strain = table.column("nominal_strain"),
                              stress = table.column("mean_stress_xx_Pa");
    const auto at = [&](double t) {
        const auto found = std::ranges::find(time, t);
        REQUIRE(found != time.end()); // a step ends at each knot, exactly
        return static_cast<std::size_t>(found - time.begin());
    };
    const std::size_t held = at(8.0), back = at(10.0), again = at(12.0);
    CHECK(strain[at(1.0)] == doctest::Approx(0.5 / 300.0));
    CHECK(strain[held] == doctest::Approx(7.5 / 300.0));
    CHECK(strain[back] == strain[held]);
    CHECK(stress[back] == doctest::Approx(stress[held]).epsilon(0.03));
    CHECK(strain[again] == doctest::Approx(5.5 / 300.0));
    const double slope = (stress[back] - stress[again]) / (strain[back] - strain[again]); // elastic, on the clamped bar
    CHECK(slope == doctest::Approx(1000.0 / (1.0 - 0.3 * 0.3)).epsilon(0.12));
    CHECK(stress.back() > stress[held]);
    CHECK(stress.back() - stress[held] < 0.3 * slope * (strain.back() - strain[held])); // beyond yield anew
}

TEST_CASE("particles of a file make the body that the shape made") {
    const scratch::Folder folder;
    scratch::write(folder / "shape.toml", billet());
    std::string csv = "x,y,volume\n";
    for (int j = 0; j < 14; ++j)
        for (int i = 0; i < 10; ++i)
            csv += fmt::format("{},{},{}\n", 1e-3 * (i + 0.5), 1e-3 * (j + 0.5), 1e-6 * 1e-3 * (i + 0.5));
    scratch::write(folder / "billet.csv", csv);
    scratch::write(folder / "file.toml", billet("shape = {rectangle = [0, 0, 0.01, 0.014]}", "particles = \"billet.csv\""));
    for (const std::string name : {"shape", "file"})
        run_well("scene", {folder / (name + ".toml"), "--output", folder / name});
    const std::vector<double> load = read_history(folder / "shape/history.csv").column("load_N");
    const std::vector<double> other = read_history(folder / "file/history.csv").column("load_N");
    REQUIRE(load.size() == other.size());
    CHECK(load.back() > 1e4);
    for (std::size_t k = 0; k < load.size(); ++k)
        CHECK(other[k] == doctest::Approx(load[k]).epsilon(1e-4).scale(1e3));
}

TEST_CASE("a material may have any name, and a scene that is printed is read again") {
    const scratch::Folder folder;
    std::string text = billet("[materials.steel]", "[materials.\"steel 1.4301 \\\"hot\\\"\"]");
    text.replace(text.find("material = \"steel\""), 18, "material = 'steel 1.4301 \"hot\"'");
    scratch::write(folder / "scene.toml", text);
    const Outcome printed = run("scene", {folder / "scene.toml", "--print-config"});
    REQUIRE(printed.status == 0);
    scratch::write(folder / "printed.toml", printed.output);
    for (const std::string name : {"scene", "printed"})
        run_well("scene", {folder / (name + ".toml"), "--snapshots", "2e-3", "--output", folder / name});
    check_same_run(folder / "scene", folder / "printed");
}

TEST_CASE("what is wrong with a scene file is said with file and line, and what is allowed; nothing is left behind") {
    const scratch::Folder folder;
    for (const auto& [from, to, message] : {
             std::tuple{"carrier = \"points\"", "", "the key 'carrier' is missing"},
             {"carrier = \"points\"", "carrier = \"point\"", "line 1: carrier = \"point\": it must be one of grid, points"},
             {"cell-size = 2e-3", "cell-sise = 2e-3", "line 2: unknown key 'cell-sise'; did you mean cell-size?"},
             {"dt = 1e-4", "dt = -1", "line 3: --dt -1: it must be a finite number above 0; or auto"},
             {"cell-size = 2e-3", "cell-size = 5e-3", "--cell-size 0.005: it must divide the width of the grid"},
             {"cell-size = 2e-3", "cell-size = 1e-300", "into 2.4e+298: 20000 cells are possible at most"},
             {"cell-size = 2e-3", "cell-size = 2e-6\nparticles-per-side = 100",
              "billet may have 3.5e+11 points: this needs about"},
             {"[materials.steel]", "[materials.\"steel\\n4\"]", "the name: it must be UTF-8 text without control characters"},
             {"name = \"load_N\"", "name = \"load,N\"", "observables are called 'load,N': no name may have a comma"},
             {"name = \"load_N\"", "name = \"platen_force_y_N\"", "has the name of another column of history.csv"},
             {"name = \"platen\"", "name = \"platen, upper\"",
              "rigid bodies are called 'platen, upper': no name may have a comma"},
             {"name = \"platen\"", "name = \"up/platen\"", "a rigid body is called 'up/platen': its name must not have a slash"},
             {"velocity = [0, -1]", "velocity = [0, -1e300]", "the rigid body 'platen' would cross 1e+300 cells"},
             {"[[observables]]", "[curve]\nx = \"time_s\"\ny = \"load\"\n[[observables]]",
              "[curve]: there is no column 'load' in history.csv; did you mean load_N?"},
             {"[grid]", "[gird]", "line 6: there is no table 'gird'; did you mean grid?"},
             {"width = 0.024", "", "line 6: [grid] lacks the key 'width': a multiple of cell-size [m]"},
             {"width = 0.024", "width = \"wide\"", "line 8: [grid] width = wide: it must be a finite number above 0"},
             {"width = 0.024", "width = [1, 2]", "line 8: [grid] width = [1, 2]: key 'width' is an array"},
             {"axisymmetric", "axi", "[grid] geometry = axi: it must be one of plane-strain, plane-stress, axisymmetric"},
             {"left = \"slip\"", "left = \"slips\"", "line 12: [sides] left = slips: it must be one of free, slip, fixed"},
             {"law = \"von-mises\"", "law = \"von-misses\"", "line 16: [materials.steel] law = von-misses: it must be one of"},
             {"law = \"von-mises\"", "law = \"linear-elastic\"", "unknown key 'yield-stress'"},
             {"poisson-ratio = 0.3", "poisson-ratio = 0.5",
              "poisson-ratio = 0.5: it must be a finite number above -1 and below 0.5"},
             {"yield-stress = 0.7e9", "", "[materials.steel] lacks the key 'yield-stress'"},
             {"yield-stress = 0.7e9", "yield-stres = 0.7e9", "[materials.steel] lacks the key 'yield-stress'"},
             {"[materials.steel]", "[materials]", "is no table: write [materials.law]"},
             {"[[bodies]]", "[bodies]", "'bodies' must stand in tables of its own, each headed [[bodies]]"},
             {"material = \"steel\"", "material = \"steal\"",
              "[[bodies]] material = steal: it must be one of steel; did you mean"},
             {"shape = {rectangle = [0, 0, 0.01, 0.014]}", "", "the body 'billet' must have either a shape or a file"},
             {"[0, 0, 0.01, 0.014]", "[0, 0, 0.01]", "'[0, 0, 0.01]' must be 4 numbers in brackets"},
             {"[0, 0, 0.01, 0.014]", "[0, 0, 0.1, 0.014]", "billet crosses the edge of the grid"},
             {"shape = {rectangle = [0, 0, 0.01, 0.014]}", "particles = \"none.csv\"", "none.csv: the history cannot be read"},
             {"velocity = [0, -1]", "velocity = -1", "velocity = -1: '-1' must be 2 numbers in brackets"},
             {"velocity = [0, -1]", "history = [[0, 0, -1], [1, 0]]", "'[1, 0]' must be 3 numbers in brackets"},
             {"velocity = [0, -1]", "history = [[1, 0, 0], [0, 0, 1]]", "knot 2: time 0 lies before the previous knot's 1"},
             {"velocity = [0, -1]", "holds = [\"z\"]", "it must be a list of \"x\" and \"y\""},
             {"velocity = [0, -1]", "mass = 1", "[[rigid-bodies]]: unknown key 'mass'; it has name, shape"},
             {"quantity = \"force-y\"", "quantity = \"force\"", "quantity = force: it must be one of time, force-x"},
             {"quantity = \"force-y\"", "quantity = \"force-y\"\nof = \"platten\"", "did you mean platen?"},
             {"[[observables]]", "[curve]\nz = 1\n[[observables]]", "[curve]: unknown key 'z'"},
             {"duration = 2e-3", "duration = 2e-3\nsnapshots-every = 1e-12", "--snapshots-every 1e-12: these would be 2e+09"},
             {"duration = 2e-3", "duration = 2026-01-01", "line 4: dates and times of day are not used"},
         }) {
        scratch::write(folder / "bad.toml", billet(from, to));
        const Outcome outcome = run("scene", {folder / "bad.toml", "--output", folder / "out"});
        CAPTURE_BINDING(to);
        CAPTURE(outcome.errors);
        CHECK(outcome.status == 2);
        CHECK(contains(outcome.errors, message));
        CHECK_FALSE(fs::exists(folder / "out"));
    }
    for (const auto& [text, message] :
         {std::pair{"carrier = \"grid\"\n[grid]\nwidth = 1\n", "line 2: tables are not used here ('grid')"},
          {"carrier = \"grid\"\ncell-size = 1\n", "line 2: unknown key 'cell-size'"},
          {"carrier = \"grid\"\ninitial = \"file\"\n", "--initial file: which? add --initial-file FILE"},
          {"carrier = \"grid\"\ninitial-file = \"x.csv\"\n", "it is read with --initial file only"},
          {"carrier = \"grid\"\ninitial = \"file\"\ninitial-file = \"x.csv\"\n", "x.csv: the history cannot be read"}}) {
        scratch::write(folder / "bad.toml", text);
        const Outcome outcome = run("scene", {folder / "bad.toml", "--output", folder / "out"});
        CAPTURE(outcome.errors);
        CHECK(outcome.status == 2);
        CHECK(contains(outcome.errors, message));
        CHECK_FALSE(fs::exists(folder / "out"));
    }
    scratch::write(folder / "two\nlines.toml", billet());
    CHECK(contains(run("scene", {folder / "two\nlines.toml"}).errors,
                   "two\\x0alines.toml: the name of the file: it must be UTF-8"));
    CHECK(contains(run("scene", {"/dev/zero"}).errors, "/dev/zero: the file has more than 100 MB"));
    CHECK(contains(run("scene", {}).errors, "which scene? ./ductile scene FILE.toml"));
    CHECK(contains(run("scene", {folder / "none.toml"}).errors, "none.toml: the file cannot be read"));
    CHECK(contains(run("shear_band", {"--config", scenes / "upsetting.toml"}).errors, "carrier = \"points\": here it is grid"));
}

TEST_CASE("contact by surfaces, turning and rubbing, goes on from a checkpoint with the same bits") {
    const scratch::Folder folder;
    std::string text = billet("velocity = [0, -1]",
                              "history = [[0, 0.2, -1], [1e-3, 0.2, -1], [1e-3, 0, 0.5]]\ncontact = \"surface\"\nfriction = 0.1\n"
                              "spin = [[0, 0], [1e-3, 20]]\ncentre = [0.01, 0.02]");
    text.replace(text.find("geometry = \"axisymmetric\""), std::strlen("geometry = \"axisymmetric\""),
                 "geometry = \"plane-strain\"");
    check_goes_on(folder, text);
    const HistoryTable history = read_history(folder / "whole/history.csv");
    CHECK(history.column("friction_dissipation_J").back() > 0.0);
    CHECK(std::ranges::max(history.column("contact_energy_J")) > 0.0);
    check_refused(
        folder, text,
        {{"contact = \"surface\"", "contact = \"nodes\"", "holds nodes, and has a friction, a spin or a centre"},
         {"friction = 0.1", "friction = -0.1", "friction"},
         {"friction = 0.1", "holds = [\"y\"]", "says what it holds"},
         {"carrier", "form = \"momentum\"\ncarrier", "choose --form velocity"},
         {"shape = {rectangle = [0, 0.014, 0.024, 0.018]}",
          "shape = {union = [{disk = [0.01, 0.02, 0.002]}, {disk = [0.02, 0.02, 0.002]}]}", "its shape is made of several"}});
}

TEST_CASE("bodies that rub on each other go on from a checkpoint with the same bits") {
    const scratch::Folder folder;
    const std::string text = R"(carrier = "points"
cell-size = 2e-3
method = "midpoint"
dt = 1e-4
duration = 2e-3
[grid]
width = 0.024
height = 0.018
[sides]
bottom = "fixed"
[materials.steel]
law = "linear-elastic"
young-modulus = 200e9
poisson-ratio = 0.3
density = 7800
[[bodies]]
name = "base"
material = "steel"
shape = {rectangle = [0, 0, 0.024, 0.006]}
contact = "surface"
friction = 0.2
[[bodies]]
name = "block"
material = "steel"
shape = {rectangle = [0.004, 0.006, 0.012, 0.012]}
velocity = [0.5, -0.3]
contact = "surface"
)";
    check_goes_on(folder, text);
    const HistoryTable history = read_history(folder / "whole/history.csv");
    CHECK(history.column("friction_dissipation_J").back() > 0.0);
    CHECK(std::ranges::max(history.column("contact_energy_J")) > 0.0);
    const auto summary = nlohmann::json::parse(scratch::read(folder / "whole/summary.json"));
    CHECK(summary["extra"]["deepest_contact_cells"] > 0.0); // there is no rigid body
    check_refused(
        folder, text,
        {{"contact = \"surface\"\nfriction = 0.2", "friction = 0.2", "the body 'base' shares the nodes"},
         {"carrier", "solver = \"newton-cg\"\ncarrier", "friction between bodies makes it unsymmetric"},
         {"carrier", "form = \"momentum\"\ncarrier", "choose --form velocity"},
         {"shape = {rectangle = [0.004, 0.006,", "shape = {rectangle = [0.004, 0.004,", "cells within another at the start"},
         {text.substr(text.find("[[bodies]]\nname = \"block\"")), "", "there is no other"}});
}

TEST_CASE("a body without an edge in the grid, which tools would pass, is refused") {
    const scratch::Folder folder;
    scratch::write(folder / "scene.toml", R"(carrier = "points"
cell-size = 2e-3
dt = 1e-4
duration = 1e-3
[grid]
width = 0.024
height = 0.018
[sides]
left = "slip"
right = "slip"
bottom = "slip"
top = "slip"
[materials.steel]
law = "linear-elastic"
young-modulus = 200e9
poisson-ratio = 0.3
density = 7800
[[bodies]]
name = "fill"
material = "steel"
shape = {rectangle = [-0.024, -0.018, 0.048, 0.036]}
[[rigid-bodies]]
name = "tool"
shape = {rectangle = [0.01, 0.01, 0.012, 0.012]}
contact = "surface"
)");
    const Outcome outcome = run("scene", {folder / "scene.toml", "--output", folder / "none"});
    CHECK(outcome.status == 2);
    CHECK(contains(outcome.errors, "the body 'fill' has no point of its surface near a particle"));
}

TEST_CASE("loads by histories, of a body by name, go on from a checkpoint with the same bits") {
    const scratch::Folder folder;
    std::string text =
        billet("[[observables]]", "[[loads]]\nname = \"oil\"\nbody = \"billet\"\nregion = {rectangle = [0.009, 0, "
                                  "0.011, 0.02]}\npressure = [[0, 0], [1e-3, 0.2e9]]\n[[loads]]\nname = \"pull\"\nregion = "
                                  "{rectangle = [0, 0.0135, 0.02, 0.015]}\nforce = [[0, 0, 1e3]]\n[body-force]\nhistory = "
                                  "[[0, 0, 0], [1e-3, 0, -9.81]]\n[[observables]]");
    // the platen away, so that the pull is what the billet feels of it
    text.replace(text.find("shape = {rectangle = [0, 0.014, 0.024, 0.018]}"), std::strlen("shape = {rectangle = [0, 0.014"),
                 "shape = {rectangle = [0, 0.016");
    text.replace(text.find("velocity = [0, -1]"), std::strlen("velocity = [0, -1]"), "velocity = [0, 0]");
    check_goes_on(folder, text);
    CHECK(std::ranges::max(read_history(folder / "whole/history.csv").column("work_of_loads_J")) > 0.0);
    check_refused(folder, text,
                  {{"body = \"billet\"", "body = \"bilet\"", "did you mean billet?"},
                   {"region = {rectangle = [0.009, 0, 0.011, 0.02]}", "region = {rectangle = [0.001, 0.001, 0.002, 0.002]}",
                    "the load 'oil' acts on no edge"},
                   {"force = [[0, 0, 1e3]]", "force = [[0, 0, 1e3]]\ntraction = [[0, 0, 1e3]]", "both a traction and a force"},
                   {"name = \"pull\"", "name = \"oil\"", "loads are called 'oil'"},
                   {"carrier", "solver = \"newton-cg\"\ncarrier", "the pressure of the load 'oil' makes it unsymmetric"}});
}

TEST_CASE("a scene goes on from its checkpoint with the same bits, and refuses another scene, naming what differs") {
    const scratch::Folder folder;
    const std::string scene = folder / "scene.toml";
    const std::string history = "history = [[0, 0, -1], [1e-3, 0, -1], [1e-3, 0, 0.5]]";
    scratch::write(scene, billet("velocity = [0, -1]", history));
    run_well("scene", {scene, "--snapshots", "7e-4,1.2e-3", "--output", folder / "whole"});
    run_well("scene", {scene, "--snapshots", "7e-4,1.2e-3", "--duration", "7e-4", "--output", folder / "parts"});
    const fs::path checkpoint = folder / "parts/checkpoint.h5";
    run_well("scene", {"--restart", checkpoint, "--duration", "1.2e-3"}); // without the file
    run_well("scene", {scene, "--restart", checkpoint, "--duration", "2e-3"});
    CHECK(scratch::read(folder / "whole/history.csv") == scratch::read(folder / "parts/history.csv"));
    check_same_run(folder / "whole", folder / "parts");

    for (const auto& [from, to, message] :
         {std::tuple{"yield-stress = 0.7e9", "yield-stress = 0.8e9",
                     "[materials.steel] yield-stress: the checkpoint has 700000000, this run asks for 800000000"},
          {"cell-size = 2e-3", "cell-size = 1e-3", "--cell-size: the checkpoint has 0.002, this run asks for 0.001"},
          {"left = \"slip\"", "left = \"fixed\"", "[sides] left: the checkpoint has \"slip\", this run asks for \"fixed\""},
          {"0.014]", "0.012]", "[[bodies]] 1, shape: the checkpoint has {rectangle = [0, 0, 0.01, 0.014]}"},
          {"[[observables]]", "[[observables]]\nname = \"t\"\nquantity = \"time\"\n[[observables]]",
           "[[observables]] 2, name: the checkpoint has none, this run asks for \"load_N\""}}) {
        std::string other = billet("velocity = [0, -1]", history);
        other.replace(other.find(from), std::strlen(from), to);
        scratch::write(folder / "other.toml", other);
        const Outcome outcome = run("scene", {folder / "other.toml", "--restart", checkpoint, "--duration", "3e-3"});
        CAPTURE(outcome.errors);
        CHECK(outcome.status == 2);
        CHECK(contains(outcome.errors, message));
    }
    scratch::write(folder / "other.toml", billet()); // another history
    CHECK(contains(run("scene", {folder / "other.toml", "--restart", checkpoint}).errors,
                   "[[rigid-bodies]] 1, history: the checkpoint has"));

    // the other carrier
    const Arguments glass = {scenes / "shear-band.toml", "--cells", "16", "--snapshots", "0.3,0.6"};
    run_well("scene", glass + Arguments{"--duration", "0.6", "--output", folder / "grid"});
    run_well("scene", glass + Arguments{"--duration", "0.3", "--output", folder / "first"});
    run_well("scene", {"--restart", folder / "first/checkpoint.h5", "--duration", "0.6"});
    check_same_run(folder / "grid", folder / "first");
}

TEST_CASE("a run on the grid begins where a snapshot of another one ended, on its own grid or a finer one") {
    const scratch::Folder folder;
    const Arguments glass = {"--duration", "1", "--snapshots", "1", "--model", "reduced"};
    run_well("shear_band", glass + Arguments{"--cells", "32", "--output", folder / "first"});
    const auto start = [&](const std::string& cells) {
        const fs::path output = folder / ("from-" + cells);
        run_well("shear_band", {"--cells", cells, "--model", "reduced", "--initial", "file", "--initial-file",
                                folder / "first/fields.h5", "--duration", "1e-3", "--snapshots", "0", "--output", output});
        return nlohmann::json::parse(scratch::read(output / "summary.json"));
    };
    CHECK(start("32")["warnings"].empty());
    const auto before = fields_in(folder / "first"), after = fields_in(folder / "from-32");
    const auto field = [](const auto& fields, const std::string& name) { // of the one snapshot
        const std::string& first = fields.begin()->first;
        return fields.at(first.substr(0, first.find('/') + 1) + name);
    };
    for (const std::string name : {"effective_temperature", "tau", "pressure"}) {
        const std::vector<double> then = field(before, name), now = field(after, name);
        REQUIRE(then.size() == now.size());
        for (std::size_t k = 0; k < now.size(); ++k)
            CHECK(now[k] == doctest::Approx(then[k]).epsilon(1e-9).scale(1e8));
    }
    const std::vector<double> traction = read_history(folder / "first/history.csv").column("wall_shear_traction_Pa");
    for (const std::string cells : {"32", "48"})
        if (cells == "32" || start(cells)["status"] == "completed")
            CHECK(read_history(folder / ("from-" + cells) / "history.csv").column("wall_shear_traction_Pa").front() ==
                  doctest::Approx(traction.back()).epsilon(0.01));
}

TEST_SUITE_END();

} // namespace scene_files_suite
