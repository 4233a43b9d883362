// SPDX-License-Identifier: GPL-3.0-or-later
#include "fields.hpp"
#include "messages.hpp"
#include <ductile/base/error.hpp>
#include <ductile/quasistatic/initial.hpp>
#include <ductile/quasistatic/options.hpp>
#include <ductile/quasistatic/schemes.hpp>

#include <cmath>
#include <doctest/doctest.h>
#include <string>
#include <vector>

namespace force_control_suite {

using namespace ductile;
using namespace ductile::quasistatic;

namespace {

constexpr double mu = 37.4 / 0.85, K = 122.0 / 0.85, alpha = K + 4.0 / 3.0 * mu;
using By = WallControl::By;
using Knots = std::vector<History<double>::Knot>;

Scene scene_under(const WallControl& shear, const WallControl& opening, Model model = Model::full, const Grid& grid = {8, 7}) {
    Scene scene = fields::scene_on(grid, model, {});
    scene.walls = {shear, opening};
    return scene;
}

State rough_start(const Scene& scene) {
    const RandomField rough{.mean = 0.033, .deviation = 0.0015, .correlation_length = 0.25, .seed = 5};
    return fields::initial_state(scene, initial_internal(scene.grid, rough, scene.law->variables()[0]));
}

State even_start(const Scene& scene, double chi) {
    return fields::initial_state(scene, initial_internal(scene.grid, Uniform{chi}, scene.law->variables()[0]));
}

struct Tried {
    const char* name;
    bool fixed;
    double strain_error;
};

/// Steps of equal length to `end`, past which the state is returned.
State integrate(const Tried& scheme, const Scene& scene, State state, double end, int steps) {
    const auto stepper = make_stepper(scheme.name, scene, fields::space_for(scene),
                                      {.passes = {.largest = 10, .tolerance = 1e-11},
                                       .tolerance = 1e-7,
                                       .fixed_steps = scheme.fixed,
                                       .pointwise = {PointwiseTolerance::Scale::cell, 1e-9}});
    for (int n = 0; n < steps; ++n) {
        const double time = n + 1 < steps ? end * (n + 1) / steps : end;
        REQUIRE(stepper->attempt(state, time - state.time, time, [](const StepAttempt&) { return true; }).accepted);
    }
    return state;
}

/// Creep of one point under tau(t) alone, s = q = 0: dgamma/dt = (dtau/dt)/mu + 2 D^pl and dchi/dt = F, by the classical
/// Runge-Kutta method in small steps.
struct Creep {
    double gamma, chi;
};
Creep creep(const History<double>& traction, double chi, double end) {
    const auto rate = [&](double tau, double x, double slope) {
        const auto rates = fields::stz.rates(tau, std::array{x});
        return Creep{slope / mu + 2.0 * rates.fluidity * tau, rates.internal[0]};
    };
    Creep y{traction.after(0.0) / mu, chi};
    const int steps = 40000;
    const double dt = end / steps;
    for (int n = 0; n < steps; ++n) {
        const double t = n * dt, slope = traction.slope(t + 0.5 * dt);
        const auto at = [&](double fraction, double x) { return rate(traction.after(t) + fraction * dt * slope, x, slope); };
        const Creep a = at(0.0, y.chi), b = at(0.5, y.chi + 0.5 * dt * a.chi), c = at(0.5, y.chi + 0.5 * dt * b.chi),
                    d = at(1.0, y.chi + dt * c.chi);
        y.gamma += dt / 6.0 * (a.gamma + 2.0 * b.gamma + 2.0 * c.gamma + d.gamma);
        y.chi += dt / 6.0 * (a.chi + 2.0 * b.chi + 2.0 * c.chi + d.chi);
    }
    return y;
}

constexpr Tried schemes_of_all_kinds[] = {
    {"euler", true, 3e-2},          {"substepped", true, 3e-2},   {"incremental", true, 1e-3},
    {"extrapolated", true, 1e-3},   {"ralston", true, 1e-5},      {"bogacki-shampine", true, 1e-6},
    {"dormand-prince", true, 1e-7}, {"chebyshev", true, 1e-5},    {"auto", true, 1e-6},
    {"arkode-3", false, 1e-6},      {"cvode-adams", false, 1e-4}, {"cvode-bdf", false, 1e-4},
    {"ida", false, 2e-4},           {"mri", true, 1e-5}};

} // namespace

TEST_SUITE("force_control") {
    TEST_CASE_FIXTURE(fields::EachSpace, "creep of an even glass is that of a point, with every scheme") {
        const double end = 4e6; // beyond yield from the start on: a corner costs steps of fixed length their order
        const History<double> traction(Knots{{0.0, 1.02}, {0.25 * end, 1.08}, {0.5 * end, 1.08}, {0.75 * end, 1.12}});
        const Scene scene = scene_under({By::traction, traction}, {By::velocity, {}}, Model::reduced, {5, 4});
        const double chi = 690.0 / 21000.0;
        const Creep expected = creep(traction, chi, end);
        const double plastic = expected.gamma - traction.after(end) / mu;
        CHECK(plastic > 0.005); // otherwise this says little
        for (const Tried& scheme : schemes_of_all_kinds) {
            CAPTURE(scheme.name);
            const State final_state = integrate(scheme, scene, even_start(scene, chi), end, 400);
            fields::check_uniform(final_state.cells.stress.tau, traction.after(end), 1e-11);
            const double gamma = wall_displacement(scene, final_state).u / (0.5 * scene.grid.height);
            CHECK(std::abs(gamma - expected.gamma) < scheme.strain_error * plastic);
            CHECK(std::abs(final_state.cells.internal[0](2, 2) / expected.chi - 1.0) < scheme.strain_error);
        }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "the traction is kept in a rough glass that spins and flows, with every scheme") {
        const double end = 4e5;
        const Scene scene = scene_under({By::traction, History<double>(Knots{{0.0, 0.0}, {0.3 * end, 1.05}, {end, 1.1}})},
                                        {By::traction, History<double>(Knots{{0.0, 0.0}, {0.5 * end, -0.2}})});
        double reference = 0.0, stretch = 0.0;
        for (const Tried& scheme : {Tried{"dormand-prince", true, 1e-7},
                                    {"bogacki-shampine", true, 1e-4},
                                    {"ralston", true, 1e-3},
                                    {"chebyshev", true, 1e-3},
                                    {"incremental", true, 2e-2},
                                    {"extrapolated", true, 2e-3},
                                    {"substepped", true, 2e-2},
                                    {"euler", true, 2e-2},
                                    {"arkode-4", false, 1e-4},
                                    {"cvode-adams", false, 1e-3},
                                    {"cvode-bdf", false, 1e-3},
                                    {"ida", false, 1e-3},
                                    {"mri", true, 1e-3}}) {
            CAPTURE(scheme.name);
            const State final_state = integrate(scheme, scene, rough_start(scene), end, 200);
            const MeanTraction mean = fields::space_for(scene)->mean_traction(final_state.cells.stress);
            CHECK(std::abs(mean.shear - 1.1) < 1e-11);
            CHECK(std::abs(mean.normal + 0.2) < 1e-11);
            VectorField room(scene.grid);
            CHECK(fields::equilibrium_residual(scene, final_state.cells, room) < 1e-10);
            const Velocity walls = wall_displacement(scene, final_state);
            if (reference == 0.0) {
                reference = walls.u;
                stretch = walls.v;
                CHECK(reference > 1.02 * 1.1 / mu); // it has flowed
                CHECK(stretch < 0.0);
            }
            CHECK(std::abs(walls.u / reference - 1.0) < scheme.strain_error);
            CHECK(std::abs(walls.v / stretch - 1.0) < scheme.strain_error);
        }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "under force control, too, all that a step leaves behind is in the state") {
        const double end = 4e5;
        const Scene scene = scene_under({By::traction, History<double>(Knots{{0.0, 0.0}, {0.3 * end, 1.05}, {end, 1.1}})},
                                        {By::traction, History<double>(Knots{{0.0, 0.0}, {0.5 * end, -0.2}})});
        for (const Tried& scheme : schemes_of_all_kinds) {
            CAPTURE(scheme.name);
            const auto make = [&] {
                return make_stepper(scheme.name, scene, fields::space_for(scene),
                                    {.tolerance = 1e-5, .fixed_steps = scheme.fixed});
            };
            const auto step = [&](TimeStepper& stepper, State& state, int n) {
                const double next = end * n / 200.0;
                REQUIRE(stepper.attempt(state, next - state.time, next, [](const StepAttempt&) { return true; }).accepted);
            };
            const auto one = make();
            State state = rough_start(scene);
            for (int n = 1; n <= 3; ++n)
                step(*one, state, n);
            State other = state;
            for (int n = 4; n <= 5; ++n) {
                step(*one, state, n);
                step(*make(), other, n);
            }
            CHECK(fields::same_bits(state, other));
            CHECK(state.cells.wall == other.cells.wall);
        }
    }

    TEST_CASE_FIXTURE(fields::EachSpace, "walls that move as force control made them give the traction back") {
        // many short steps: the velocity of the middle of each, as a history with jumps
        const double end = 1e5;
        const int steps = 800;
        Scene scene = scene_under({By::traction, History<double>(Knots{{0.0, 0.0}, {0.4 * end, 1.05}, {end, 1.12}})},
                                  {By::traction, History<double>(0.0)});
        const auto stepper = make_stepper("incremental", scene, fields::space_for(scene), {});
        State state = rough_start(scene);
        std::vector<WallKnot> knots;
        Velocity before;
        for (int n = 0; n < steps; ++n) {
            const double next = end * (n + 1) / steps;
            const double start = state.time;
            REQUIRE(stepper->attempt(state, next - start, next, [](const StepAttempt&) { return true; }).accepted);
            const Velocity velocity = (state.cells.wall - before) / (next - start);
            before = state.cells.wall;
            knots.push_back({start, velocity});
            knots.push_back({next, velocity});
        }
        scene.walls = moving(WallHistory(knots));
        const State again = integrate({"incremental", true, 0.0}, scene, rough_start(scene), end, steps);
        const MeanTraction mean = fields::space_for(scene)->mean_traction(again.cells.stress);
        CHECK(mean.shear == doctest::Approx(1.12).epsilon(1e-4));
        CHECK(std::abs(mean.normal) < 1e-4);
    }

    TEST_CASE_FIXTURE(fields::OneThread,
                      "an elastic solid under both tractions: uniaxial strain and shear, at once and in time") {
        for (const char* name : {"incremental", "substepped", "bogacki-shampine"}) {
            CAPTURE(name);
            const Scene scene = scene_under({By::traction, History<double>(Knots{{0.0, 0.3}, {2.0, 0.5}, {3.0, 0.1}})},
                                            {By::traction, History<double>(Knots{{0.0, -0.2}, {4.0, 0.2}})}, Model::reduced);
            State state = rough_start(scene); // far below yield
            fields::check_uniform(state.cells.stress.tau, 0.3, 1e-15);
            CHECK(wall_displacement(scene, state).u == doctest::Approx(0.3 / mu));
            state = integrate({name, true, 0.0}, scene, std::move(state), 4.0, 8);
            const Velocity walls = wall_displacement(scene, state);
            CHECK(walls.u == doctest::Approx(0.1 / mu)); // the half height is 1
            CHECK(walls.v == doctest::Approx(0.2 / alpha));
            fields::check_uniform(state.cells.stress.tau, 0.1, 1e-14);
            fields::check_uniform(state.cells.stress.p, -K * 0.2 / alpha, 1e-14);
            fields::check_uniform(state.cells.stress.s, -mu * 0.2 / alpha, 1e-14);
        }
    }

    TEST_CASE("options of force control") {
        Options options;
        options.cells = {8, 8};
        options.shear_traction = "0:0,0.05:9e8";
        options.normal_traction = "-1e8";
        const Scene scene = make_scene(options);
        CHECK(scene.walls.shear.by == By::traction);
        CHECK(scene.walls.shear.history.after(0.05 / scene.units.time) == doctest::Approx(9e8 / 0.85e9));
        CHECK(scene.walls.opening.history.after(1.0) == doctest::Approx(-1e8 / 0.85e9));
        CHECK(scene.walls.next_knot(1e-3) == doctest::Approx(0.05 / scene.units.time));

        const auto message = [](const std::string& shear, const std::string& normal, const std::string& walls) {
            Options wrong;
            wrong.shear_traction = shear;
            wrong.normal_traction = normal;
            wrong.wall_history = walls;
            return message_of<InputError>([&] { (void)make_scene(wrong); });
        };
        CHECK(contains(message("0:0,1:1e8,1:2e8", "", ""), "--shear-traction: the traction jumps at t = 1 s"));
        for (const char* text : {"x", "0:", "0:1:2", "1e8,2e8", "0:0,1e8", "0:nan", "1:0,0:1", ","})
            CHECK(contains(message("", text, ""), "--normal-traction"));
        CHECK(contains(message("1e8", "", "0:1e-4"), "shear is under force control"));
        CHECK(contains(message("", "1e8", "0:0:1e-4"), "opening is under force control"));
        CHECK(message("", "1e8", "0:1e-4") == "nothing was thrown");
    }
}

} // namespace force_control_suite
