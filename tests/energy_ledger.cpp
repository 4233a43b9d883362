// SPDX-License-Identifier: GPL-3.0-or-later
#include "fields.hpp"
#include <ductile/material/point_rates.hpp>
#include <ductile/quasistatic/initial.hpp>
#include <ductile/quasistatic/method_of_lines.hpp>
#include <ductile/quasistatic/schemes.hpp>

#include <cmath>
#include <doctest/doctest.h>
#include <string>
#include <utility>
#include <vector>

namespace energy_ledger_suite {

using namespace ductile;
using namespace ductile::quasistatic;

namespace {

constexpr double mu = 37.4 / 0.85, K = 122.0 / 0.85;
using By = WallControl::By;

Scene sheared(Model model, const Velocity& walls, const Law& law = fields::glass_law) {
    return fields::scene_on({8, 7}, model, walls, law);
}

State rough_start(const Scene& scene) {
    const RandomField rough{.mean = 0.033, .deviation = 0.0015, .correlation_length = 0.25, .seed = 5};
    return fields::initial_state(scene, initial_internal(scene.grid, rough, scene.law->variables()[0]));
}

/// Steps of equal length to `end`.
State integrate(const std::string& scheme, bool fixed, double tolerance, const Scene& scene, State state, double end, int steps) {
    const auto stepper = make_stepper(scheme, scene, fields::space_for(scene),
                                      {.passes = {.largest = 10, .tolerance = 1e-12},
                                       .tolerance = tolerance,
                                       .fixed_steps = fixed,
                                       .pointwise = {PointwiseTolerance::Scale::cell, 1e-9}});
    const double start = state.time;
    for (int n = 0; n < steps; ++n) {
        const double time = n + 1 < steps ? start + (end - start) * (n + 1) / steps : end;
        REQUIRE(stepper->attempt(state, time - state.time, time, [](const StepAttempt&) { return true; }).accepted);
    }
    return state;
}

/// What a run from `start` leaves open: elastic energy gained, less work, plus dissipation, of the work.
double open_part(const Scene& scene, const State& start, const State& end, bool less_transport) {
    const EnergyFlow& passed = end.cells.energy;
    const double gained = fields::observe(scene, end.cells).elastic_energy - fields::observe(scene, start.cells).elastic_energy;
    return (gained - passed.work + passed.dissipation - (less_transport ? passed.transport : 0.0)) / std::abs(passed.work);
}

/// C^-1 : stress, contracted with another stress, at a cell.
double energy_product(const StressField& a, const StressField& b, int i, int j) {
    return a.p(i, j) * b.p(i, j) / K + (a.s(i, j) * b.s(i, j) + a.tau(i, j) * b.tau(i, j) + 3.0 * a.q(i, j) * b.q(i, j)) / mu;
}

const Law elastic_law = stz_law(fields::metallic_glass, {.yield_stress = 1e3 * StzParameters{}.yield_stress}, Units{});

} // namespace

TEST_SUITE("energy_ledger") {
    TEST_CASE_FIXTURE(fields::OneThread, "the powers of a rate add up to the rate of the elastic energy") {
        for (const Model model : {Model::reduced, Model::full})
            for (const bool opening : {false, true}) {
                CAPTURE(opening);
                const Scene scene = sheared(model, {2e-7, opening ? 3e-8 : 0.0});
                const auto space = fields::space_for(scene);
                State state = integrate("dormand-prince", true, 1e-6, scene, rough_start(scene), 1.3e5, 100);
                CHECK(space->observe(state.cells).plastic_fraction > 0.5);
                MethodOfLines lines(scene, *space, {.largest = 12, .tolerance = 1e-14});
                CellState rate = space->make_cells();
                lines.evaluate(state.cells, scene.walls.after(state.time), state.velocity, rate);
                space->close(state.velocity, rate);
                double energy = 0.0, dissipated = 0.0;
                for (int j = 0; j < scene.grid.cells_y; ++j)
                    for (int i = 0; i < scene.grid.cells_x; ++i) {
                        const StressField& stress = state.cells.stress;
                        energy += scene.grid.cell_area() * energy_product(stress, rate.stress, i, j);
                        const double s = stress.s(i, j), tau = stress.tau(i, j), q = stress.q(i, j);
                        const double sbar = std::sqrt(s * s + tau * tau + 3.0 * q * q);
                        const FlowAt flow = scene.law->flow_at(sbar, std::array{state.cells.internal[0](i, j)});
                        if (sbar >= flow.yield_stress)
                            dissipated += scene.grid.cell_area() * 2.0 * sbar * sbar * flow.fluidity;
                    }
                const EnergyFlow& power = rate.energy;
                CHECK(dissipated > 0.05 * power.work);
                CHECK(power.dissipation == doctest::Approx(dissipated).epsilon(1e-12));
                CHECK((power.transport != 0.0) == (model == Model::full));
                CHECK(std::abs(energy - (power.work - power.dissipation + power.transport)) < 1e-11 * power.work);
            }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "without flow the ledger closes to round-off, and its work is that of a spring") {
        const double end = 5e4, strain = 2e-7 * end;
        for (const std::string scheme : {"euler", "substepped", "incremental", "ralston", "bogacki-shampine", "dormand-prince",
                                         "chebyshev", "arkode-3", "cvode-adams", "cvode-bdf", "ida", "mri"}) {
            CAPTURE(scheme);
            const Scene scene = sheared(Model::reduced, {2e-7, 0.0}, elastic_law);
            const State start = rough_start(scene);
            const bool fixed = !scheme.starts_with("cvode") && scheme != "ida";
            const State state = integrate(scheme, fixed, 1e-8, scene, start, end, 10);
            CHECK(state.cells.energy.dissipation == 0.0);
            CHECK(state.cells.energy.work == doctest::Approx(0.5 * mu * strain * strain * scene.grid.area()).epsilon(1e-6));
            CHECK(std::abs(open_part(scene, start, state, false)) < (fixed ? 1e-11 : 2e-4));
        }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "what is left open falls with the step as the order of the scheme says") {
        struct Tried {
            const char* scheme;
            double order, largest; // of what is open at the coarser step
            double enough = 1e-8;  // at the finer one
        };
        for (const Model model : {Model::reduced, Model::full})
            for (const Tried& tried :
                 {Tried{"euler", 1, 0.02}, Tried{"substepped", 1, 0.02}, Tried{"incremental", 1.8, 1e-3},
                  Tried{"ralston", 2, 1e-4}, Tried{"bogacki-shampine", 2.5, 1e-5}, Tried{"chebyshev", 2, 1e-4},
                  Tried{"mri", 2, 1e-4, 4e-7}}) { // there parts of both signs cancel on elements
                CAPTURE(std::string(tried.scheme));
                CAPTURE(static_cast<int>(model));
                const Scene scene = sheared(model, {2e-7, 0.0});
                // from a state that flows: no cell crosses the corner of the law
                State start = integrate("dormand-prince", true, 1e-6, scene, rough_start(scene), 1.4e5, 400);
                start.cells.energy = {};
                start.memory = {};
                double open[2];
                for (const int k : {0, 1})
                    open[k] = std::abs(
                        open_part(scene, start, integrate(tried.scheme, true, 1e-8, scene, start, 1.8e5, 40 << k), true));
                CAPTURE(open[0]);
                CAPTURE(open[1]);
                CHECK(open[0] < tried.largest);
                // frozen spin and advection leave the first order
                const double order = model == Model::full && std::string_view(tried.scheme) == "incremental" ? 1.0 : tried.order;
                CHECK((std::log2(open[0] / open[1]) > order - 0.3 || open[1] < tried.enough));
            }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "a tolerance bounds what is left open") {
        const Scene scene = sheared(Model::reduced, {2e-7, 0.0});
        const State start = rough_start(scene);
        // the work is 0.02 s_Y a unit of area: 40 integrations of a tolerance, each from order one
        for (const auto& [scheme, bound] :
             {std::pair{"arkode-3", 1e-6}, {"cvode-adams", 5e-5}, {"cvode-bdf", 5e-4}, {"ida", 5e-4}}) {
            const std::string name = scheme;
            CAPTURE(name);
            CHECK(std::abs(open_part(scene, start, integrate(name, false, 1e-7, scene, start, 1.8e5, 40), false)) < bound);
            CHECK(std::abs(open_part(scene, start, integrate(name, false, 1e-9, scene, start, 1.8e5, 40), false)) < 0.1 * bound);
        }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "walls under force control do the work that the glass takes") {
        Scene scene = sheared(Model::reduced, {});
        scene.walls = {{By::traction, History<double>(std::vector<History<double>::Knot>{{0.0, 0.0}, {2e5, 1.08}})},
                       {By::traction, History<double>(0.1)}};
        const State start = rough_start(scene);
        CHECK(fields::observe(scene, start.cells).elastic_energy > 0.0); // of the opening load
        for (const std::string scheme : {"incremental", "bogacki-shampine", "cvode-bdf", "mri"}) {
            CAPTURE(scheme);
            const bool fixed = scheme != "cvode-bdf";
            const State state = integrate(scheme, fixed, 1e-7, scene, start, 4e5, 400);
            CHECK(state.cells.energy.dissipation > 0.03 * state.cells.energy.work);
            CHECK(std::abs(open_part(scene, start, state, false)) < (fixed ? 1e-4 : 2e-3));
        }
    }
}

} // namespace energy_ledger_suite
