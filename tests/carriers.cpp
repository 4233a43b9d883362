// SPDX-License-Identifier: GPL-3.0-or-later
// One scene, both carriers: a glass with a soft spot in simple shear, on the grid that stays and on material points. What is
// compared is what ./ductile scene writes for one file of which one word changes; verification/carriers.py refines.
#include "capture.hpp"
#include "child_process.hpp"
#include "messages.hpp"

#include <ductile/io/hdf5.hpp>
#include <ductile/io/history.hpp>

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

namespace carriers_suite {

using namespace ductile;
using scratch::operator+;
using scratch::Arguments;
using scratch::Outcome;
namespace fs = std::filesystem;

namespace {

constexpr double side = 0.02; // m

/// Stress and effective temperature where a run ended, at the centres of cells, row by row, or at particles; lengths in sides of
/// the block, from its corner.
struct End {
    double traction = 0.0, normal = 0.0; // on the wall, Pa
    std::vector<double> x = {}, y = {}, tau = {}, chi = {};
};

End end_of(const fs::path& folder, int cells) {
    const io::HistoryTable history = io::read_history(folder / "history.csv");
    End end{.traction = history.column("wall_shear_traction_Pa").back(),
            .normal = history.column("wall_normal_traction_Pa").back()};
    const io::Hdf5File file = io::Hdf5File::open(folder / "fields.h5");
    const std::string last = "snapshots/" + file.members("snapshots").back();
    const auto read = [&](const std::string& name, int rows, int columns) {
        std::vector<double> values(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns));
        file.read(last + "/" + name, {values.data(), rows, columns, columns});
        return values;
    };
    const std::vector<std::string> names = file.members(last);
    if (std::ranges::find(names, "position") == names.end()) {
        end.tau = read("tau", cells, cells);
        end.chi = read("effective_temperature", cells, cells);
        for (int k = 0; k < cells * cells; ++k) {
            end.x.push_back((k % cells + 0.5) / cells);
            end.y.push_back((k / cells + 0.5) / cells);
        }
        return end;
    }
    end.tau = file.read_doubles(last + "/stress_xy");
    end.chi = file.read_doubles(last + "/effective_temperature");
    const std::vector<double> places = read("position", static_cast<int>(end.chi.size()), 2);
    for (std::size_t p = 0; p < end.chi.size(); ++p) {
        end.x.push_back(places[2 * p] / side + 0.5);
        end.y.push_back(places[2 * p + 1] / side + 0.5);
    }
    return end;
}

/// Of a run on the grid, between the centres of cells: linear each way.
double at(const std::vector<double>& field, int cells, double x, double y) {
    const double cx = x * cells - 0.5 + cells, cy = std::clamp(y * cells - 0.5, 0.0, cells - 1.000001);
    const int i = static_cast<int>(cx), j = static_cast<int>(cy);
    const auto row = [&](int r) {
        const double left = field[static_cast<std::size_t>(r * cells + i % cells)],
                     right = field[static_cast<std::size_t>(r * cells + (i + 1) % cells)];
        return left + (cx - i) * (right - left);
    };
    return row(j) + (cy - j) * (row(j + 1) - row(j));
}

struct Differences {
    double traction, normal, tau, chi; // MPa, MPa, MPa, K
};

/// Fast up to just below yield, where nothing depends on the rate.
constexpr const char* history = "0:4.938e-3,0.045:4.938e-3,0.045:4.938e-4";

std::string scene(const std::string& carrier, const std::string& more = {}) {
    return fmt::format("carrier = \"{}\"\ncells = 32\ninitial = \"gaussian\"\ninitial-base = 620\ninitial-amplitude = "
                       "60\ninitial-x = 3e-3\ninitial-y = -1e-3\n"
                       "wall-history = \"{}\"\nduration = 0.4\nsnapshots = [0.4]\n{}",
                       carrier, history, more);
}

} // namespace

TEST_SUITE_BEGIN("carriers");

TEST_CASE("past yield both carriers have the same traction, stress and effective temperature, the nearer the finer they are") {
    const scratch::Folder folder;
    for (const char* carrier : {"grid", "points"})
        scratch::write(folder / carrier, scene(carrier));
    const auto run = [&](const std::string& carrier, int cells, const Arguments& more = {}) {
        const fs::path output = folder / fmt::format("{} {}", more.empty() ? carrier : more[1], cells);
        const Outcome outcome = scratch::run(
            "scene", Arguments{folder / carrier, "--cells", fmt::format("{}", cells), "--quiet", "--output", output} + more);
        CAPTURE(outcome.errors);
        REQUIRE(outcome.status == 0);
        return end_of(output, cells);
    };
    constexpr int fine = 256;
    const End reference = run("grid", fine);
    const double elastic = 37.4e9 * (0.045 * 0.4938 + 0.355 * 0.04938); // mu times the strain
    CHECK(reference.traction < 0.95 * elastic);                         // it flows
    CHECK(*std::ranges::max_element(reference.chi) > 682.0);            // most in the spot
    const auto from_reference = [&](const End& end) {
        Differences d{std::abs(end.traction - reference.traction) * 1e-6, std::abs(end.normal - reference.normal) * 1e-6, 0.0,
                      0.0};
        for (std::size_t k = 0; k < end.chi.size(); ++k) {
            d.tau += std::pow((end.tau[k] - at(reference.tau, fine, end.x[k], end.y[k])) * 1e-6, 2);
            d.chi += std::pow(end.chi[k] - at(reference.chi, fine, end.x[k], end.y[k]), 2);
        }
        d.tau = std::sqrt(d.tau / static_cast<double>(end.chi.size()));
        d.chi = std::sqrt(d.chi / static_cast<double>(end.chi.size()));
        return d;
    };
    const Differences grid = from_reference(run("grid", 12));
    // of the grid's differences on as many cells; B-splines have half of them, the others are of first order
    for (const auto& [shape, share, fall] : {std::tuple{"linear", 4.0, 1.5}, {"gimp", 4.0, 1.8}, {"bspline", 0.8, 2.5}}) {
        CAPTURE_BINDING(shape);
        const auto points = [&, name = std::string(shape)](int cells) {
            return from_reference(run("points", cells, {"--shape", name, "--dt", "4e-3"}));
        };
        const Differences coarse = points(12), finer = points(24);
        CHECK(coarse.chi < share * grid.chi);
        CHECK(coarse.tau < share * grid.tau);
        CHECK(finer.chi < coarse.chi / fall);
        for (const Differences& d : {coarse, finer}) {
            CHECK(d.traction < 5e-4 * reference.traction * 1e-6);
            CHECK(d.normal < 0.04 * std::abs(reference.normal) * 1e-6); // what spin makes of shear
        }
        if (std::string(shape) != "linear") // where particles that cross cells leave noise
            CHECK(finer.tau < coarse.tau / 1.5);
    }
}

TEST_CASE("what a scene of the grid cannot be on points is said, with what to do") {
    const scratch::Folder folder;
    for (const auto& [more, message] : {std::pair{"scheme = \"ralston\"\n", "line 11: unknown key 'scheme'"},
                                        {"shear-traction = \"0:0,1:1e8\"\n", "walls move as prescribed"},
                                        {"initial-file = \"x.csv\"\n", "on material points the start is a pattern"},
                                        {"[grid]\nwidth = 1\n", "unknown key 'cells'"}}) {
        scratch::write(folder / "bad.toml", scene("points", more));
        const Outcome outcome = scratch::run("scene", {folder / "bad.toml", "--output", folder / "out"});
        CAPTURE(outcome.errors);
        CHECK(outcome.status == 2);
        CHECK(contains(outcome.errors, message));
    }
    scratch::write(folder / "scene.toml", scene("points"));
    for (const auto& [option, value, message] :
         {std::tuple{"--wall-history", "0:1e-4:1e-5", "walls can shear, and not open or close"},
          {"--cells", "3", "the grid is periodic and 3 cells wide: with these shape functions it must be 5 or more"}}) {
        const Outcome outcome =
            scratch::run("scene", {folder / "scene.toml", option, value, "--shape", "gimp", "--output", folder / "out"});
        CAPTURE(outcome.errors);
        CHECK(outcome.status == 2);
        CHECK(contains(outcome.errors, message));
    }
    CHECK_FALSE(fs::exists(folder / "out"));
}

TEST_SUITE_END();

} // namespace carriers_suite
