// SPDX-License-Identifier: GPL-3.0-or-later
// Which numbers of a material are said to be doubtful.
#include "messages.hpp"

#include <ductile/material/plausibility.hpp>

#include <cmath>
#include <doctest/doctest.h>
#include <string>
#include <vector>

namespace plausibility_suite {

using namespace ductile;

namespace {

const MaterialNumbers steel{.young_modulus = 200e9, .poisson_ratio = 0.3, .density = 7800.0, .yield_stress = 0.7e9, .speed = 1.0};

/// The one sentence that a change of the steel gives.
std::string doubt_of(const auto& change) {
    MaterialNumbers m = steel;
    change(m);
    const std::vector<std::string> all = doubts(m);
    CAPTURE(all.size());
    REQUIRE(all.size() == 1);
    return all.front();
}

} // namespace

TEST_SUITE_BEGIN("plausibility");

TEST_CASE("solids and models in numbers of their own are not doubted") {
    for (const MaterialNumbers& m :
         {steel,
          MaterialNumbers{
              .young_modulus = 117e9, .poisson_ratio = 0.35, .density = 8930.0, .yield_stress = 0.4e9, .speed = 227.0},
          MaterialNumbers{.young_modulus = 101.8e9, .poisson_ratio = 0.361, .yield_stress = 0.85e9}, // a metallic glass
          MaterialNumbers{.young_modulus = 1100e9, .poisson_ratio = 0.07, .density = 3510.0},        // diamond
          MaterialNumbers{.young_modulus = 16e9, .poisson_ratio = 0.44, .density = 11340.0, .yield_stress = 12e6}, // lead
          MaterialNumbers{.young_modulus = 1e6, .poisson_ratio = 0.49, .density = 1100.0},                         // rubber
          MaterialNumbers{.young_modulus = 20e6, .poisson_ratio = 0.3, .density = 1900.0, .yield_stress = 10e3},   // clay
          MaterialNumbers{.young_modulus = 1000.0, .poisson_ratio = 0.3, .density = 10.0, .yield_stress = 6.0, .speed = 1e-3},
          MaterialNumbers{.young_modulus = 1000.0, .poisson_ratio = 0.3, .density = 1000.0, .speed = 1e-3},
          MaterialNumbers{.young_modulus = 100.0, .poisson_ratio = 0.0, .density = 1.0, .speed = 0.1}}) {
        CAPTURE(m.young_modulus);
        CHECK(doubts(m).empty());
    }
}

TEST_CASE("a slip of units in one number is said with that number") {
    CHECK(contains(doubt_of([](auto& m) { m.young_modulus = 20e12, m.density = 30e3; }), "Young's modulus 2e+13 Pa"));
    CHECK(contains(doubt_of([](auto& m) { m.density = 0.5; }), "density 0.5 kg/m^3"));
    CHECK(contains(doubt_of([](auto& m) { m.density = 7.8; }), "a wave speed of 1.858e+05 m/s")); // g/cm^3
    CHECK(contains(doubt_of([](auto& m) { m.density = 40'000.0; }), "density 4e+04 kg/m^3"));
    CHECK(contains(doubt_of([](auto& m) { m.poisson_ratio = -0.1; }), "Poisson's ratio -0.1"));
    CHECK(contains(doubt_of([](auto& m) { m.poisson_ratio = 0.4999; }), "Poisson's ratio 0.4999"));
    CHECK(contains(doubt_of([](auto& m) { m.yield_stress = 850.0; }), "yield stress of 850 Pa, 4.25e-09 times"));
    CHECK(contains(doubt_of([](auto& m) { m.yield_stress = 21e9; }), "0.105 times Young's modulus 2e+11 Pa"));
    CHECK(contains(doubt_of([](auto& m) { m.speed = 600.0; }), "a speed of 600 m/s, 0.118 times"));
    CHECK(contains(doubt_of([](auto& m) { m.hardening = 3e14; }), "a hardening modulus of 3e+14 Pa, 1.5e+03 times"));
    CHECK(contains(doubt_of([](auto& m) { m.heat_capacity = 0.46; }), "a heat capacity of 0.46 J/(kg K)")); // kJ
    CHECK(contains(doubt_of([](auto& m) { m.heat_capacity = 460e3; }), "a heat capacity of 4.6e+05 J/(kg K)"));
    // 200 instead of 200e9 shows in everything that is measured by it
    MaterialNumbers soft = steel;
    soft.young_modulus = 200.0;
    soft.name = "material 2";
    const std::vector<std::string> all = doubts(soft);
    REQUIRE(all.size() == 3);
    CHECK(all[0].starts_with("material 2 has Young's modulus 200 Pa at a density of 7800 kg/m^3"));
    CHECK(contains(all[1], "3.5e+06 times"));
    CHECK(contains(all[2], "6.24 times its wave speed")); // 1/sqrt(200/7800)
}

TEST_CASE("the line of a material has its wave speed sqrt((lambda + 2 mu)/rho), and only what is known") {
    CHECK(wave_speed(steel) == doctest::Approx(std::sqrt((115.3846e9 + 2.0 * 76.92308e9) / 7800.0)).epsilon(1e-6));
    CHECK(describe(steel) == "E = 2e+11 Pa, nu = 0.3, rho = 7800 kg/m^3, yield stress 7e+08 Pa, wave speed 5875 m/s");
    CHECK(describe(MaterialNumbers{.young_modulus = 1000.0, .poisson_ratio = 0.25}) == "E = 1000 Pa, nu = 0.25");
    CHECK(wave_speed({.young_modulus = 1.0}) == 0.0);
}

TEST_SUITE_END();

} // namespace plausibility_suite
