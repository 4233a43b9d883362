// SPDX-License-Identifier: GPL-3.0-or-later
// What a run is found doubtful for, and the numbers it gathers from all its steps.
#include "capture.hpp"
#include "io_scratch.hpp"
#include "messages.hpp"
#include "mpm_scenes.hpp"

#include <ductile/mpm/checkpoint.hpp>
#include <ductile/mpm/monitor.hpp>
#include <ductile/mpm/options.hpp>
#include <ductile/mpm/output.hpp>

#include <algorithm>

namespace mpm_monitor_suite {

using namespace mpm_scenes;

namespace {

/// A run in miniature: what the monitor says once `live` has done something to a block and observed it.
struct Run {
    Block b = block(ShapeFunction::linear);
    Tally tally = {};
    Monitor monitor{b.scene, {}};
    std::vector<std::array<double, 2>> forces = {};
    StepEnergies energies = {};
    Particles start = {};

    Run() {
        start = b.state.particles;
        for (double& v : b.state.particles.velocity_x)
            v = 2.0; // 3.2 J
        b.state.rigid_bodies.push_back({.name = "plate", .velocity = Velocity{0.5, -1.0}, .x = {0.75}, .y = {0.75}});
        forces = {{0.0, 0.0}};
        see(0.0);
    }
    void see(double dt, double determinant = 1.0) { monitor.observe({b.state, dt, forces, energies}, determinant, tally); }
    [[nodiscard]] std::vector<std::string> all_warnings(const Monitor& m) const {
        io::RunSummary summary;
        m.conclude({b.state, 0.0, forces}, tally, start, summary);
        return summary.warnings;
    }
    /// All but that of particles in other cells, where tests put them.
    [[nodiscard]] std::vector<std::string> warnings(const Monitor& m) const {
        std::vector<std::string> all = all_warnings(m);
        std::erase_if(all, [](const std::string& w) { return contains(w, "have crossed into other cells"); });
        return all;
    }
    [[nodiscard]] std::string warning() const {
        const std::vector<std::string> all = warnings(monitor);
        REQUIRE(all.size() <= 1);
        return all.empty() ? "" : all.front();
    }
    void set_speed(double v) { std::ranges::fill(b.state.particles.velocity_x, v); }
};

} // namespace

TEST_SUITE_BEGIN("mpm_monitor");

TEST_CASE("a ledger that is open by more than a hundredth is said, with what opens it") {
    Run run; // 3.2 J of motion
    run.see(0.1);
    CHECK(run.warning().empty());
    run.set_speed(2.0 * std::sqrt(1.009));
    CHECK(run.warning().empty());
    run.set_speed(2.0 * std::sqrt(1.02));
    CHECK(contains(run.warning(), "0.02 of the energy at the start and the work since is too much"));
    CHECK(contains(run.warning(), "0.064 J of it because the law"));
    run.energies.of_method = -0.064;
    run.see(0.0);
    CHECK(contains(run.warning(), "the steps have added 0.064 J"));
    run.energies.of_method = 2.0 * 0.064;
    run.see(0.0);
    run.set_speed(2.0 * std::sqrt(0.98));
    CHECK(contains(run.warning(), "0.02 of the energy at the start and the work since is missing"));
    CHECK(contains(run.warning(), "the steps have damped 0.064 J away"));
    // without inertia there is no kinetic energy
    Run slow;
    slow.tally.clear();
    const Monitor resting(slow.b.scene, {.inertia = false});
    resting.observe({slow.b.state, 0.0, slow.forces}, 1.0, slow.tally);
    slow.set_speed(100.0);
    CHECK(slow.warnings(resting).empty());
}

TEST_CASE("a ledger that closes because two errors cancel is said, with both") {
    Run run; // 3.2 J of motion
    run.energies.of_method = 0.0288;
    run.see(0.1);
    CHECK(run.warning().empty()); // 0.009 of each
    run.set_speed(2.0 * std::sqrt(0.995));
    run.energies.of_method = 0.02 * 3.2 - 0.0288;
    run.see(0.1);
    CHECK(contains(run.warning(), "closes only because two errors, of 0.015 and -0.02"));
    run.set_speed(2.0 * std::sqrt(0.991));
    run.energies.of_method = (0.011 - 0.02) * 3.2;
    run.see(0.1);
    CHECK(run.warning().empty()); // 0.011 by the steps, of which 0.009 are open
    run.set_speed(2.0);
    run.energies.of_method = (0.05 - 0.011) * 3.2;
    run.see(0.1);
    CHECK(contains(run.warning(), "closes only because two errors, of 0.05 and -0.05 of the energy"));
    CHECK(contains(run.warning(), "the steps have damped 0.16 J away"));
    run.energies.of_method = -0.1 * 3.2;
    run.see(0.1);
    CHECK(contains(run.warning(), "two errors, of -0.05 and 0.05"));
    CHECK(contains(run.warning(), "the steps have added 0.16 J"));
}

TEST_CASE(
    "the work of a force that a step finds at its end is that of the mean of both ends, and the method has not lost the rest") {
    Run run;
    const Monitor at_end(run.b.scene, {.forces_at_end = true});
    for (int n = 1; n <= 4; ++n) { // the force grows with the way
        run.forces = {{-2.0 * n, -3.0 * n}};
        run.energies.of_method = 0.5 * 0.025 * 2.0;
        at_end.observe({run.b.state, 0.025, run.forces, run.energies}, 1.0, run.tally);
    }
    const Ledger ledger = at_end.ledger({run.b.state, 0.0, run.forces}, run.tally);
    CHECK(ledger.rigid_work == doctest::Approx(-0.5 * 4.0 * 4.0 * 2.0 * 0.025).epsilon(1e-12)); // of F = 2 n x/(a step's way)
    CHECK(ledger.of_method == doctest::Approx(4.0 * 0.025 + 0.5 * 4.0 * 2.0 * 0.025).epsilon(1e-12));
}

TEST_CASE("what rigid bodies and body forces do is work, and what flow dissipates is spent") {
    Run run;
    // -F.v dt = -(-2 * 0.5 - 3 * -1) * 0.1 = -0.2 J
    run.forces = {{-2.0, -3.0}};
    for (int n = 0; n < 4; ++n) // a quarter of a cell each
        run.see(0.025);
    CHECK(contains(run.warning(), "too much"));
    run.energies = {.body_work = 0.9, .dissipated = 0.5};
    run.see(0.0);
    run.set_speed(std::sqrt(2.0 * (3.2 - 0.2 + 0.9 - 0.5) / 1.6));
    CHECK(run.warning().empty());
    const Ledger ledger = run.monitor.ledger({run.b.state, 0.0, run.forces}, run.tally);
    CHECK(ledger.rigid_work == doctest::Approx(-0.2));
    CHECK(ledger.body_work == 0.9);
    CHECK(ledger.dissipated == 0.5);
    CHECK(ledger.work_magnitude == doctest::Approx(1.1));
    CHECK(std::abs(ledger.error()) < 1e-12);
}

TEST_CASE("a row tells the ledger and the momenta under their names") {
    Run run;
    Particles& p = run.b.state.particles;
    for (std::size_t i = 0; i < p.size(); ++i) { // a rotation about (0.5, 0.1) with 3 rad/s, and what moves all
        p.velocity_x[i] = 0.7 - 3.0 * (p.y[i] - 0.1);
        p.velocity_y[i] = -0.4 + 3.0 * (p.x[i] - 0.5);
    }
    const Ledger ledger{.at_start = 1.0,
                        .kinetic = 2.0,
                        .elastic = 4.0,
                        .rigid_work = 8.0,
                        .body_work = 16.0,
                        .dissipated = 32.0,
                        .of_method = 64.0};
    for (const Geometry geometry : {Geometry::plane_strain, Geometry::axisymmetric}) {
        Problem problem;
        problem.scene = run.b.scene;
        problem.scene.geometry = geometry;
        problem.start = run.b.state;
        std::vector<double> row;
        LastStep last;
        last.contact_forces = {{-5.0, 6.0}};
        append_row(problem, {run.b.state, 0.0, last.contact_forces}, last, ledger, row);
        const std::vector<std::string> names = history_columns(problem);
        REQUIRE(names.size() == row.size());
        const auto at = [&](const std::string& name) {
            const auto found = std::ranges::find(names, name);
            REQUIRE(found != names.end());
            return row[static_cast<std::size_t>(found - names.begin())];
        };
        CHECK(at("work_of_rigid_bodies_J") == 8.0);
        CHECK(at("work_of_body_force_J") == 16.0);
        CHECK(at("plastic_dissipation_J") == 32.0);
        CHECK(at("numerical_dissipation_J") == 64.0);
        CHECK(at("energy_error_J") == 2.0 + 4.0 + 32.0 - 1.0 - 8.0 - 16.0);
        CHECK(at("plate_force_x_N") == -5.0);
        CHECK(at("plate_force_y_N") == 6.0);
        double momentum_x = 0.0, momentum_y = 0.0, angular = 0.0;
        for (std::size_t i = 0; i < p.size(); ++i) {
            momentum_x += p.mass[i] * p.velocity_x[i];
            momentum_y += p.mass[i] * p.velocity_y[i];
            angular += p.mass[i] * (p.x[i] * p.velocity_y[i] - p.y[i] * p.velocity_x[i]);
        }
        CHECK(momentum_y == doctest::Approx(1.6 * (-0.4 + 3.0 * -0.1)).epsilon(1e-12));
        CHECK(at("momentum_y_Ns") == doctest::Approx(momentum_y).epsilon(1e-12));
        CHECK((std::ranges::find(names, "momentum_x_Ns") == names.end()) == (geometry == Geometry::axisymmetric));
        if (geometry == Geometry::axisymmetric)
            continue;
        CHECK(momentum_x == doctest::Approx(1.6 * (0.7 - 3.0 * 0.3)).epsilon(1e-12));
        CHECK(at("momentum_x_Ns") == doctest::Approx(momentum_x).epsilon(1e-12));
        CHECK(at("angular_momentum_Nms") == doctest::Approx(angular).epsilon(1e-12));
        CHECK(std::abs(angular) > 0.1);
    }
}

TEST_CASE("a rigid body that loses what it pulled is said; one that moves off after pressing is not") {
    const auto let_go = [](std::array<double, 2> force, std::array<double, 2> before) {
        Run run; // the plate's point is at (0.75, 0.75), the block on its left and below
        for (const auto& f : {before, force, {0.0, 0.0}, {0.0, 0.0}}) {
            run.forces = {f};
            run.see(0.0);
        }
        return run.warning();
    };
    CHECK(
        contains(let_go({-3.0, -4.0}, {0.0, 0.0}), "the rigid body 'plate' let go of the particles while it pulled them with "));
    CHECK(contains(let_go({-3.0, -4.0}, {0.0, -20.0}), "let go"));
    CHECK(let_go({3.0, 4.0}, {0.0, 0.0}).empty());
    CHECK(let_go({-0.3, -0.4}, {20.0, 0.0}).empty());
}

TEST_CASE("particles that have crossed cells are said where gradients jump there, whatever their order") {
    for (const ShapeFunction shape : all_shapes) {
        Run run;
        run.b.scene.shape = shape;
        const Monitor monitor(run.b.scene, {});
        Particles& p = run.b.state.particles; // 64, in cells of 0.1 m
        CHECK(run.all_warnings(monitor).empty());
        std::swap(p.x[0], p.x[63]);
        std::swap(p.y[0], p.y[63]);
        std::swap(p.id[0], p.id[63]);
        CHECK(run.all_warnings(monitor).empty());
        int shifted = 0;
        for (std::size_t i = 0; i < p.size(); ++i)
            if (p.x[i] > 0.5 && shifted < 8) { // at the right edge: into cells that were empty
                p.x[i] += 0.1;
                ++shifted;
            }
        REQUIRE(shifted == 8);
        const auto said = run.all_warnings(monitor);
        CHECK(said.size() == (shape == ShapeFunction::linear ? 1 : 0));
        if (!said.empty())
            CHECK(contains(said[0], "0.12 of the particles have crossed into other cells"));
    }
}

TEST_CASE("particles that a fixed side has lost are said, and those of other sides are not") {
    for (const auto& [condition, way, said] : {std::tuple{SideCondition::fixed, 0.09, false},
                                               {SideCondition::fixed, 0.12, true},
                                               {SideCondition::slip, 0.12, false}}) {
        Run run; // cells of 0.1 m
        run.b.scene.grid.bottom = 0.2;
        run.b.scene.grid.cells_y = 6;
        run.b.scene.grid.height = 0.6;
        run.b.scene.grid.sides.bottom = condition; // the block lies on it
        const Monitor monitor(run.b.scene, {});
        Particles& p = run.b.state.particles;
        const auto lowest = static_cast<std::size_t>(std::ranges::min_element(p.y) - p.y.begin());
        p.x[lowest] += way;
        const auto warnings = run.all_warnings(monitor);
        CHECK(std::ranges::any_of(warnings, [](const std::string& one) {
                  return contains(one, "beside a fixed side of the grid has moved 1.2 cells");
              }) == said);
    }
}

TEST_CASE("a particle at half or twice its density is said") {
    for (const auto& [ratio, figure] : {std::pair{1.9, ""}, {2.1, "2.1 times"}, {0.53, ""}, {0.4, "0.4 times"}}) {
        Run run;
        run.b.state.particles.density[7] *= ratio;
        const std::string said = run.warning();
        CHECK(said.empty() == std::string_view(figure).empty());
        CHECK(contains(said, figure));
    }
}

TEST_CASE("a step that leaves a particle little of its volume is said with its figure") {
    Run run;
    run.see(0.1, 0.31);
    CHECK(run.warning().empty());
    run.see(0.1, 0.21);
    run.see(0.1, 0.9);
    CHECK(contains(run.warning(), "a step left a particle 0.21 of its volume"));
}

TEST_CASE("a rigid body that goes more than half a cell in a step in which it acts is said") {
    Run run; // it moves by -1 m/s along y, in cells of 0.1 m
    run.see(0.2);
    run.forces = {{0.0, 1e-9}};
    run.see(0.049);
    CHECK(run.warning().empty());
    run.see(0.08);
    CHECK(contains(run.warning(), "a rigid body went 0.8 cells in one step"));
    CHECK(contains(run.warning(), "take steps 0.12 times as long"));
}

TEST_CASE("an oscillation that the midpoint rule puts out of phase is said, by about what it is out of phase; beside more work "
          "it is not") {
    // the rule for dx/dt = v, dv/dt = -w^2 x: x is the stretch of a spring with all of 3.2 J at the start
    for (const auto& [angle, steps] : {std::pair{0.3, 20}, {0.3, 80}, {0.7, 10}, {1.2, 12}}) {
        double x = 0.0, v = 2.0; // w = 1, mass 1.6 kg
        Run run;
        for (int n = 0; n < steps; ++n) {
            const double middle = (v - 0.5 * angle * x) / (1.0 + 0.25 * angle * angle); // of v
            const double change = 2.0 * (middle - v);
            x += angle * middle;
            v += change;
            run.energies.of_change = 0.5 * 1.6 * change * change;
            run.see(angle);
        }
        const double lost = steps * (angle - 2.0 * std::atan(0.5 * angle));
        CAPTURE_BINDING(angle);
        CAPTURE_BINDING(steps);
        INFO(lost, " ", run.warning());
        CHECK(contains(run.warning(), "out of phase by about") == (lost > 0.1));
        io::RunSummary summary;
        run.monitor.conclude({run.b.state, 0.0, run.forces}, run.tally, run.start, summary);
        CHECK(summary.extra.at("phase_error_rad").get<double>() == doctest::Approx(lost).epsilon(0.25));
        run.energies = {.body_work = 320.0, .dissipated = 320.0};
        run.see(0.0);
        CHECK(run.warning().empty());
    }
}

TEST_CASE(
    "a mean stress that oscillates faster than the steps follow is said, by about what it is out of phase; a steady one and "
    "waves without a mean are not") {
    const auto phase_of = [](double angle, int steps, int every, double load, double alternating, double mean) {
        Run run;
        Monitor monitor(run.b.scene, {.every = every});
        Particles& p = run.b.state.particles;
        run.tally.clear();
        for (int n = 0; n <= steps; ++n) {
            for (std::size_t i = 0; i < p.size(); ++i) {
                const double sign = i % 2 == 0 ? 1.0 : -1.0;
                p.stress_xx[i] = 1e-3 * (load + (mean + alternating * sign) * std::sin(angle * n));
                p.stress_xy[i] = 0.5e-3 * mean * std::sin(angle * n);
            }
            run.b.state.step = n;
            run.b.state.time += 0.1;
            monitor.observe({run.b.state, 0.1, run.forces}, 1.0, run.tally);
        }
        io::RunSummary summary;
        monitor.conclude({run.b.state, 0.0, run.forces}, run.tally, run.start, summary);
        const bool said = std::ranges::any_of(summary.warnings, [](const std::string& w) {
            return contains(w, "the mean stress oscillates faster than the steps follow");
        });
        const double phase = summary.extra.at("stress_phase_error_rad").get<double>();
        CHECK(said == (phase > 0.1));
        return phase;
    };
    for (const auto& [angle, steps] : {std::pair{0.3, 20}, {0.3, 80}, {0.7, 30}, {1.2, 12}}) {
        CAPTURE_BINDING(angle);
        CAPTURE_BINDING(steps);
        const double lost = steps * (angle - 2.0 * std::atan(0.5 * angle));
        CHECK(phase_of(angle, steps, 1, 0.0, 0.0, 1.0) == doctest::Approx(lost).epsilon(0.3));
        CHECK(phase_of(angle, steps, 1, 0.0, 5.0, 1.0) == doctest::Approx(lost).epsilon(0.3));
        CHECK(phase_of(angle, steps, 1, 20.0, 0.0, 1.0) < 0.01 * lost);
    }
    CHECK(phase_of(0.1, 800, 4, 0.0, 0.0, 1.0) == doctest::Approx(800.0 * (0.1 - 2.0 * std::atan(0.05))).epsilon(0.1));
    CHECK(phase_of(0.7, 30, 1, 0.0, 1.0, 0.0) == 0.0);
}

TEST_CASE("a step tells by how much it has changed the motion, with every method that has inertia") {
    for (const int method : {0, 1, 2}) { // explicit, implicit, quasi-static
        Block b = block(ShapeFunction::linear);
        Particles& p = b.state.particles;
        for (std::size_t i = 0; i < p.size(); ++i)
            p.velocity_y[i] = 0.5 * p.y[i];
        const Particles before = p;
        ImplicitOptions options;
        options.scheme.method = method == 1 ? ImplicitMethod::midpoint : ImplicitMethod::quasi_static;
        if (method == 2)
            b.scene.grid.sides.bottom = b.scene.grid.sides.left = SideCondition::slip;
        const auto stepper =
            method == 0 ? make_explicit_stepper(b.scene, Form::velocity) : make_implicit_stepper(b.scene, options);
        b.state.particles.stress_yy.assign(p.size(), 3.0);
        const StepOutcome outcome = stepper->attempt(b.state, 1e-3, 1e-3);
        if (method == 2) {
            CHECK(outcome.energies.of_change == 0.0);
            continue;
        }
        REQUIRE(outcome.accepted);
        double changed = 0.0;
        for (std::size_t i = 0; i < p.size(); ++i) {
            const auto was = static_cast<std::size_t>(std::ranges::find(before.id, p.id[i]) - before.id.begin());
            changed +=
                0.5 * p.mass[i] *
                (std::pow(p.velocity_x[i] - before.velocity_x[was], 2) + std::pow(p.velocity_y[i] - before.velocity_y[was], 2));
        }
        CHECK(changed > 0.0);
        CHECK(outcome.energies.of_change == doctest::Approx(changed).epsilon(1e-10));
    }
}

TEST_CASE("a loose tolerance is doubted where it is relative to the forces") {
    Options o;
    CHECK(solver_warnings(o).empty());
    o.newton_tolerance = 1e-3;
    CHECK(solver_warnings(o).empty());
    o.newton_tolerance = 0.1;
    for (const Method method : {Method::implicit, Method::midpoint, Method::quasi_static}) {
        o.method = method;
        REQUIRE(solver_warnings(o).size() == 1);
        CHECK(contains(solver_warnings(o).front(), "--newton-tolerance is 0.1: a step may end with forces out of balance"));
    }
    o.residual_scale = ResidualScale::stiffness;
    CHECK(solver_warnings(o).empty());
    o.residual_scale = ResidualScale::forces;
    o.method = Method::explicit_steps;
    CHECK(solver_warnings(o).empty());
}

TEST_CASE("a body that comes apart or gets a hole is said, also when it closes again; two bodies are not") {
    Run run;
    const Particles whole = run.b.state.particles;
    for (double& x : run.b.state.particles.x)
        x = x < 0.4 ? x - 0.1 : x;
    run.see(0.1);
    run.b.state.particles = whole;
    run.see(0.1);
    CHECK(contains(run.warning(), "in 1 piece and with 0 holes at the start, came to 2 and 0"));

    Run hole;
    Particles& p = hole.b.state.particles;
    for (std::size_t i = 0; i < p.size(); ++i)
        if (p.x[i] > 0.3 && p.x[i] < 0.4 && p.y[i] > 0.3 && p.y[i] < 0.4)
            p.y[i] += 0.1;
    hole.see(0.1);
    CHECK(contains(hole.warning(), "came to 1 and 1"));

    Run two;
    two.tally.clear();
    for (std::size_t i = 0; i < two.b.state.particles.size(); ++i)
        two.b.state.particles.body[i] = two.b.state.particles.x[i] < 0.4 ? 1 : 0;
    two.see(0.0);
    for (double& x : two.b.state.particles.x)
        x = x < 0.4 ? x - 0.1 : x;
    two.see(0.1);
    CHECK(two.warning().empty());
    // looked at every few steps only
    Run seldom;
    const Monitor fourth(seldom.b.scene, {.every = 4});
    for (double& x : seldom.b.state.particles.x)
        x = x < 0.4 ? x - 0.1 : x;
    seldom.b.state.step = 3;
    fourth.observe({seldom.b.state, 0.1, seldom.forces}, 1.0, seldom.tally);
    CHECK(seldom.warnings(fourth).empty());
    seldom.b.state.step = 4;
    fourth.observe({seldom.b.state, 0.1, seldom.forces}, 1.0, seldom.tally);
    CHECK(seldom.warnings(fourth).size() == 1);
}

TEST_CASE("mean stress that alternates from particle to particle is said to lock; round-off is not") {
    Run run;
    Particles& p = run.b.state.particles;
    const auto stress = [&](double shear, double pressure) {
        for (std::size_t i = 0; i < p.size(); ++i) {
            p.stress_xy[i] = shear;
            p.stress_xx[i] = p.stress_yy[i] = p.stress_zz[i] = std::fmod(p.x[i], 0.1) < 0.05 ? pressure : -pressure;
        }
        return run.warning();
    };
    CHECK(stress(1.0 / std::sqrt(3.0), 1.9).empty());
    CHECK(contains(stress(1.0 / std::sqrt(3.0), 2.5), "by 2.5 Pa (root mean square), 2.5 times the equivalent stress"));
    CHECK(stress(1e-14, 1e-12).empty());
}

TEST_CASE("a checkpoint with numbers that cannot be is refused, though its checksum is right") {
    const scratch::Folder folder;
    const Block good = block(ShapeFunction::linear);
    const Tally tally{{"work_J", {1.0, 2.0, 3.0}}};
    const auto refusal = [&](const auto& spoil) {
        State state = good.state;
        Tally numbers = tally;
        spoil(state, numbers);
        StepControl control({.target = 1.0, .first = 1.0, .grid = good.scene.grid});
        io::Checkpoint content{.program = "block"};
        describe(state, control, numbers, content);
        io::write_checkpoint(folder / "c.h5", content);
        const io::CheckpointReader reader(folder / "c.h5", "block");
        return message_of<InputError>([&] {
            (void)read_state(reader, good.scene, good.state);
            Tally restored = tally;
            restore(reader, control, restored);
        });
    };
    CHECK(refusal([](State&, Tally&) {}) == "nothing was thrown");
    CHECK(contains(refusal([](State& s, Tally&) { s.particles.material[3] = 7; }), "c.h5: particle 3 is of material 7"));
    for (const std::int64_t id : {std::int64_t{-1}, std::int64_t{1} << 40, std::int64_t{0}})
        CHECK(contains(refusal([&](State& s, Tally&) { s.particles.id[3] = id; }),
                       fmt::format("c.h5: a particle has the number {}", id)));
    CHECK(contains(refusal([](State&, Tally& t) { t["work_J"].pop_back(); }), "'tally/work_J' has 2 values, expected 3 or more"));
    CHECK(refusal([](State&, Tally& t) { t["work_J"].push_back(4.0); }) == "nothing was thrown");
}

TEST_CASE("the trailing mean is that of the last part of a run, wherever it ends") {
    const TrailingMean loads("loads", 0.9);
    Tally tally;
    double sum = 0.0;
    int count = 0;
    for (int n = 0; n <= 5000; ++n) {
        loads.add(tally, 0.01 * n, n % 7 + 0.001 * n);
        if (n == 100) { // 90 to 100
            double mean = 0.0;
            for (int k = 90; k <= 100; ++k)
                mean += (k % 7 + 0.001 * k) / 11.0;
            CHECK(loads.mean(tally) == doctest::Approx(mean).epsilon(1e-12));
            CHECK(loads.last(tally) == 100 % 7 + 0.1);
        }
        if (n >= 4500) {
            sum += n % 7 + 0.001 * n;
            ++count;
        }
    }
    CHECK(loads.mean(tally) == doctest::Approx(sum / count).epsilon(1e-12));
    CHECK(tally.at("loads").size() < 2 * 501 + 2048);
}

TEST_CASE("B-splines beside rigid bodies, and hat functions of what hardly gives in volume, are doubted") {
    const auto said = [](ShapeFunction shape, Geometry geometry, double nu, int per_side, bool rigid) {
        Block b = block(shape, geometry, "elastic", per_side);
        b.scene.materials = {{linear_elastic_law(elasticity_from_young(1000.0, nu))}};
        std::vector<RigidBody> bodies;
        if (rigid)
            bodies.push_back({.name = "plate"});
        const std::vector<std::string> all = resolution_warnings(b.scene, b.state.particles, bodies);
        REQUIRE(all.size() <= 1);
        return all.empty() ? std::string() : all.front();
    };
    using enum Geometry;
    CHECK(contains(said(ShapeFunction::bspline, plane_strain, 0.3, 2, true), "a rigid body ('plate') holds nodes half a cell"));
    CHECK(said(ShapeFunction::gimp, plane_strain, 0.3, 2, true).empty());
    for (const ShapeFunction shape : {ShapeFunction::linear, ShapeFunction::gimp})
        for (const Geometry geometry : {plane_strain, axisymmetric}) {
            CHECK(contains(said(shape, geometry, 0.49, 2, true), "Poisson's ratio is 0.49 and there are 4 particles a cell"));
            CHECK(said(shape, geometry, 0.47, 2, true).empty());
            CHECK(said(shape, geometry, 0.49, 1, true).empty());
        }
    CHECK(said(ShapeFunction::gimp, plane_stress, 0.49, 2, false).empty());
    CHECK(said(ShapeFunction::bspline, plane_strain, 0.49, 2, false).empty());
}

TEST_CASE("B-splines with one particle a cell are doubted, and nothing else is") {
    for (const ShapeFunction shape : {ShapeFunction::linear, ShapeFunction::gimp, ShapeFunction::bspline})
        for (const int per_side : {1, 2}) {
            const Block b = block(shape, Geometry::plane_strain, "elastic", per_side);
            const std::vector<std::string> said = resolution_warnings(b.scene, b.state.particles, {});
            CHECK(said.size() == (shape == ShapeFunction::bspline && per_side == 1 ? 1 : 0));
            if (!said.empty())
                CHECK(contains(said[0], "there are 1 particles a cell"));
        }
}

TEST_SUITE_END();

} // namespace mpm_monitor_suite
