// SPDX-License-Identifier: GPL-3.0-or-later
// Plastic strain and displacement that accumulate on the grid: against closed forms, and a law that counts its own plastic
// strain.
#include "fields.hpp"
#include <ductile/quasistatic/accumulation.hpp>
#include <ductile/quasistatic/initial.hpp>
#include <ductile/quasistatic/schemes.hpp>

#include <cmath>
#include <doctest/doctest.h>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

namespace accumulation_suite {

using namespace ductile;
using namespace ductile::quasistatic;
using doctest::Approx;

namespace {

constexpr double mu = 37.4 / 0.85;

State even_start(const Scene& scene, double value) {
    return fields::initial_state(scene, initial_internal(scene.grid, Uniform{value}, scene.law->variables()[0]));
}

/// Equal steps to `end` by a scheme, along which there is accumulated; each cut into `pieces`. `prepare` may change what there is
/// at the start, `look` sees what there is at the end.
void follow(
    const std::string& scheme, bool fixed, const Scene& scene, State state, double end, int steps, int pieces,
    const std::function<void(const State&, const Accumulated&)>& look,
    const std::function<void(Accumulation&)>& prepare = [](Accumulation&) {}) {
    const auto stepper = make_stepper(scheme, scene, fields::space_for(scene),
                                      {.passes = {.largest = 10, .tolerance = 1e-11},
                                       .tolerance = 1e-7,
                                       .fixed_steps = fixed,
                                       .pointwise = {PointwiseTolerance::Scale::cell, 1e-9}});
    Accumulation accumulation(scene, stepper->space(), state, stepper->leaves_velocity_of_middle());
    prepare(accumulation);
    for (int n = 0; n < steps; ++n) {
        const double begin = state.time, length = end * (n + 1) / steps - begin;
        (void)stepper->limit_step(state, length); // walls that jump have their velocity after it
        accumulation.begin(state);
        std::vector<double> times;
        for (int k = 1; k < pieces; ++k)
            times.push_back(begin + length * k / pieces);
        REQUIRE(stepper
                    ->attempt(state, length, begin + length, [](const StepAttempt&) { return true; },
                              {times, [&](const State& at) { accumulation.pass(at); }})
                    .accepted);
        accumulation.end(state);
    }
    look(state, accumulation.now());
}

struct Tried {
    const char* name;
    bool fixed;
    int steps, pieces;
};
constexpr Tried schemes_of_all_kinds[] = {
    {"auto", true, 160, 1},        {"chebyshev", true, 160, 1},    {"dormand-prince", true, 160, 1},
    {"incremental", true, 160, 1}, {"extrapolated", true, 160, 1}, {"substepped", true, 160, 1},
    {"euler", true, 640, 1},       {"arkode-3", false, 5, 32},     {"cvode-adams", false, 5, 32},
    {"cvode-bdf", false, 5, 32},   {"ida", false, 5, 32},          {"mri", true, 160, 1}};

} // namespace

TEST_SUITE_BEGIN("accumulation");

TEST_CASE_FIXTURE(fields::OneThread,
                  "even shear, every scheme: what is not elastic of the strain is plastic, and cells move with the walls") {
    // dgamma/dt = (dtau/dt)/mu + 2 D^pl, and sqrt(2/3 D^pl : D^pl) = 2/sqrt(3) D^pl
    const double speed = 1e-7, end = 5e5;
    const Scene scene = fields::scene_on({6, 5}, Model::reduced, {speed, 0.0});
    for (const Tried& scheme : schemes_of_all_kinds) {
        CAPTURE(scheme.name);
        follow(scheme.name, scheme.fixed, scene, even_start(scene, 660.0 / 21000.0), end, scheme.steps, scheme.pieces,
               [&](const State& state, const Accumulated& there) {
                   const double plastic = (speed * end - state.cells.stress.tau(2, 3) / mu) / std::numbers::sqrt3;
                   CHECK(plastic > 0.008);
                   for (int j = 0; j < 5; ++j)
                       for (int i = 0; i < 6; ++i) {
                           CHECK(there.plastic_strain(i, j) == Approx(plastic).epsilon(2e-3));
                           CHECK(there.displacement_x(i, j) ==
                                 Approx(speed * end * scene.grid.y(j + 0.5)).scale(0.04).epsilon(1e-12));
                           CHECK(std::abs(there.displacement_y(i, j)) < 1e-15);
                       }
               });
    }
}

TEST_CASE_FIXTURE(fields::OneThread,
                  "the plastic strain is the one that Perzyna's law hardens by, carried along or not, to second order") {
    // d kappa/dt = D^pl: e = 2/sqrt(3) kappa for ever, if it is so at the start
    const Law law = perzyna_law(fields::metallic_glass, {.hardening_modulus = 3e9, .reference_rate = 0.05}, Units{});
    for (const Model model : {Model::reduced, Model::full})
        for (const char* scheme : {"dormand-prince", "extrapolated"}) {
            CAPTURE(scheme);
            const Scene scene = fields::scene_on({12, 10}, model, {2e-6, 5e-7}, law);
            State start = even_start(scene, 0.0);
            std::mt19937 engine(3);
            fields::fill_smoothly(start.cells.internal[0], engine, 0.02, 0.005);
            double error[2], largest = 0.0;
            for (const int k : {0, 1})
                follow(
                    scheme, true, scene, start, 4e4, 50 << k, 1,
                    [&](const State& state, const Accumulated& there) {
                        error[k] = 0.0;
                        for (int j = 0; j < 10; ++j)
                            for (int i = 0; i < 12; ++i) {
                                const double e = 2.0 / std::numbers::sqrt3 * state.cells.internal[0](i, j);
                                error[k] = std::max(error[k], std::abs(there.plastic_strain(i, j) - e));
                                largest = std::max(largest, e);
                            }
                    },
                    [&](Accumulation& accumulation) {
                        Field& e = *accumulation.named_fields()[0].second;
                        for (int j = 0; j < 10; ++j)
                            for (int i = 0; i < 12; ++i)
                                e(i, j) = 2.0 / std::numbers::sqrt3 * start.cells.internal[0](i, j);
                        e.wrap();
                    });
            CHECK(largest > 0.035);
            CHECK(error[1] < (model == Model::full ? 3e-6 : 5e-7));
            if (model == Model::reduced) // what carries along chooses sides, not in both at the same moment
                CHECK(error[0] / error[1] > 3.0);
        }
}

TEST_CASE_FIXTURE(fields::OneThread,
                  "walls that open: matter comes from y exp(-a t), or, where nothing is carried along, cells move by a t y") {
    // v = a y: with u = y - Y, Du/Dt = v gives u = y (1 - exp(-a t))
    const double a = 1e-3, end = 300.0;
    for (const Model model : {Model::reduced, Model::full}) {
        const Scene scene = fields::scene_on({6, 5}, model, {0.0, a});
        const auto space = fields::space_for(scene);
        State state = even_start(scene, 0.03); // without stress: nothing flows
        Accumulation accumulation(scene, *space, state, false);
        for (int n = 0; n < 100; ++n) {
            accumulation.begin(state);
            state.time = end * (n + 1) / 100;
            accumulation.end(state);
        }
        for (int j = 0; j < 5; ++j) {
            const double y = scene.grid.y(j + 0.5);
            CHECK(accumulation.now().displacement_y(2, j) ==
                  Approx(model == Model::full ? y * (1.0 - std::exp(-a * end)) : a * end * y).scale(0.3).epsilon(3e-6));
            CHECK(accumulation.now().displacement_x(2, j) == 0.0);
            CHECK(accumulation.now().plastic_strain(2, j) == 0.0);
        }
    }
}

TEST_CASE_FIXTURE(fields::OneThread, "a flow along x takes the plastic strain with it, and shifts by what it has flowed") {
    const Scene scene = fields::scene_on({64, 8}, Model::full, {1e-3, 0.0});
    const auto space = make_space(scene);
    State state = even_start(scene, 0.03);
    Accumulation accumulation(scene, *space, state, true);
    Field& e = *accumulation.named_fields()[0].second;
    const auto wave = [](double x) { return std::sin(std::numbers::pi * x); };
    for (int j = 0; j < 8; ++j)
        for (int i = 0; i < 64; ++i)
            e(i, j) = wave(scene.grid.x(i + 0.5));
    const double end = 200.0;
    for (int n = 0; n < 50; ++n) {
        accumulation.begin(state);
        state.time = end * (n + 1) / 50;
        accumulation.end(state);
    }
    const Accumulated now = accumulation.now();
    for (int j = 0; j < 8; ++j)
        for (int i = 0; i < 64; ++i) {
            const double shift = 1e-3 * end * scene.grid.y(j + 0.5);
            CHECK(now.displacement_x(i, j) == Approx(shift).scale(0.1).epsilon(1e-10));
            CHECK(now.plastic_strain(i, j) == Approx(wave(scene.grid.x(i + 0.5) - shift)).scale(1.0).epsilon(1.2e-3));
        }
}

TEST_CASE_FIXTURE(fields::EachSpace, "what accumulates is carried along as a stress is that does not turn") {
    const Scene scene = fields::scene_on({12, 10}, Model::full, {});
    const auto space = fields::space_for(scene);
    std::mt19937 engine(11);
    VectorField velocity = space->make_velocity(), room = velocity;
    fields::fill_randomly(velocity.u, engine, -1.0, 1.0);
    fields::fill_randomly(velocity.v, engine, -1.0, 1.0);
    CellState cells = space->make_cells(), rate = cells;
    std::vector<Field> fields;
    for (Field* field : {&cells.stress.p, &cells.stress.q}) {
        fields::fill_smoothly(*field, engine, 0.3, 0.5);
        fields.push_back(*field);
    }
    std::vector<Field> rates(2, rate.stress.p);
    space->transport(cells, velocity, rate, room);
    space->advect(fields, velocity, rates);
    double largest = 0.0;
    for (int j = 0; j < 10; ++j)
        for (int i = 0; i < 12; ++i) {
            CHECK(rates[0](i, j) == Approx(rate.stress.p(i, j)).scale(1.0).epsilon(1e-13));
            CHECK(rates[1](i, j) == Approx(rate.stress.q(i, j)).scale(1.0).epsilon(1e-13));
            largest = std::max(largest, std::abs(rates[0](i, j)));
        }
    CHECK(largest > 0.1);
}

TEST_CASE_FIXTURE(fields::OneThread, "a state within a piece is shown as if the step ended there, and changes nothing") {
    const Scene scene = fields::scene_on({6, 5}, Model::full, {1e-3, 2e-4});
    const auto space = fields::space_for(scene);
    const State start = even_start(scene, 0.03);
    State middle = start, end = start;
    middle.time = 1.0;
    end.time = 3.0;
    Accumulation looked(scene, *space, start, false), other(looked), there(looked);
    for (Accumulation* one : {&looked, &other, &there})
        one->begin(start);
    const Field shown = looked.at(middle).displacement_y;
    there.end(middle);
    CHECK(fields::same_bits(shown, there.now().displacement_y));
    CHECK(shown(2, 3) > 0.0);
    looked.end(end);
    other.end(end);
    CHECK(fields::same_bits(looked.now().displacement_y, other.now().displacement_y));
}

TEST_CASE_FIXTURE(fields::OneThread, "walls that bear a load from the start on have moved when a run begins") {
    Scene scene = fields::scene_on({6, 5}, Model::full, {});
    scene.walls.shear = {WallControl::By::traction, History<double>(0.5)};
    const auto space = fields::space_for(scene);
    const State start = even_start(scene, 0.03);
    const Accumulation accumulation(scene, *space, start, false);
    for (int j = 0; j < 5; ++j)
        CHECK(accumulation.now().displacement_x(1, j) == Approx(0.5 / mu * scene.grid.y(j + 0.5)).scale(1e-3).epsilon(1e-12));
}

TEST_SUITE_END();

} // namespace accumulation_suite
