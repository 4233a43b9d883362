// SPDX-License-Identifier: GPL-3.0-or-later
// The numbers that options stand for where they are left to the program.
#include <ductile/quasistatic/doubts.hpp>
#include <ductile/quasistatic/options.hpp>

#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>

namespace quasistatic_options_suite {

using namespace ductile;
using namespace ductile::quasistatic;

namespace {

/// The first step of a run that starts with this time scale, whatever is left.
double first_step(const Options& o, double time_scale = 1.0) {
    StepControl control = make_step_control(o, make_scene(o));
    control.start(time_scale);
    return control.next(0.0, 1e9).dt;
}

} // namespace

TEST_SUITE_BEGIN("quasistatic_options");

TEST_CASE("the tolerance of error control is 1e-4, on more than 504 cells a side 1e-4 (252 h/L)^3") {
    // h/L = 2/N; the first step is the time scale times the third root of the tolerance
    for (const auto& [cells, expected] : {std::pair{32, 1e-4}, {504, 1e-4}, {1008, 1e-4 / 8.0}, {2520, 1e-4 / 125.0}}) {
        Options o;
        o.cells = {cells, cells};
        CHECK(std::pow(first_step(o), 3.0) == doctest::Approx(expected).epsilon(1e-12).scale(0.0));
        CHECK(std::pow(first_step(o, 7.0) / 7.0, 3.0) == doctest::Approx(expected).epsilon(1e-12).scale(0.0));
    }
    // h is the side of a square as large as a cell
    Options o;
    o.cells = {2016, 504};
    CHECK(std::pow(first_step(o), 3.0) == doctest::Approx(1e-4 / 8.0).epsilon(1e-12).scale(0.0));
}

TEST_CASE("fixed steps are the paper's 0.5e4 t_s h/L") {
    for (const int cells : {32, 128, 504}) {
        Options o;
        o.cells = {cells, cells};
        o.step = StepChoice::fixed;
        CHECK(first_step(o) == doctest::Approx(0.5e4 * 2.0 / cells).epsilon(1e-12)); // t_s is the unit of time
    }
}

TEST_CASE("a tolerance that is known to be missed is doubted") {
    const auto doubted = [](const char* scheme, const char* tolerance, Advection advection, Model model = Model::full) {
        Options o;
        o.cells = {8, 8};
        o.scheme = scheme;
        o.tolerance = tolerance;
        o.space.advection = advection;
        o.model = model;
        const Scene scene = make_scene(o);
        const auto found = doubts(o, scene, make_space(scene)->observe(make_space(scene)->make_cells()));
        return std::ranges::count_if(found,
                                     [](const std::string& text) { return text.find("a tolerance of ") != std::string::npos; });
    };
    using enum Advection;
    CHECK(doubted("auto", "1e-5", eno2) == 0);
    CHECK(doubted("auto", "9e-6", eno2) == 1);
    CHECK(doubted("auto", "1e-9", eno2, Model::reduced) == 0);
    CHECK(doubted("auto", "1e-9", weno3) == 0);
    CHECK(doubted("incremental", "1e-9", eno2) == 0); // which is no error
    CHECK(doubted("dormand-prince", "1e-5", weno3) == 0);
    CHECK(doubted("dormand-prince", "1e-6", weno3) == 1);
    CHECK(doubted("arkode-5", "1e-7", weno3) == 1);
    CHECK(doubted("arkode-5", "1e-7", eno2) == 1); // the first reason is enough
    CHECK(doubted("cvode-bdf", "1e-4", weno3) == 0);
    CHECK(doubted("cvode-bdf", "9e-5", weno3) == 1);
}

TEST_SUITE_END();

} // namespace quasistatic_options_suite
