// SPDX-License-Identifier: GPL-3.0-or-later
// The implicit step: residual, Jacobian products, solvers, conservation, failures that leave the state alone.
#include "messages.hpp"
#include "mpm_scenes.hpp"

#include <ductile/material/linear_elastic.hpp>
#include <ductile/mpm/time_stepper.hpp>

#include <algorithm>
#include <cstring>
#include <functional>
#include <numeric>
#include <string>
#include <tuple>

namespace mpm_implicit_suite {

using namespace mpm_scenes;

namespace {

/// Bitwise equality of all arrays.
bool same(const Particles& a, const Particles& b) {
    const auto first = named_arrays(a), second = named_arrays(b);
    for (std::size_t k = 0; k < first.size(); ++k)
        if (std::memcmp(first[k].second->data(), second[k].second->data(), sizeof(double) * a.size()) != 0)
            return false;
    return true;
}

/// A block pressed by a rigid plate from above, no slip: plastic flow, rotation, contact.
Block press(const std::string& law = "von Mises", Geometry geometry = Geometry::plane_strain) {
    Block b = block(ShapeFunction::linear, geometry, law);
    b.scene.grid.sides.bottom = SideCondition::slip;
    for (double& y : b.state.particles.y)
        y -= 0.2;
    b.state.rigid_bodies.push_back(make_rigid_body("plate", rectangle(0.0, 0.4, 0.8, 0.5), 2, b.scene.grid));
    b.state.rigid_bodies[0].velocity = Velocity{0.0, -0.1};
    return b;
}

ImplicitOptions tight(SolverKind solver, Form form, JacobianProduct product = JacobianProduct::analytic,
                      PreconditionerKind preconditioner = PreconditionerKind::none) {
    ImplicitOptions o{.scheme = {.form = form}, .solver = solver, .preconditioner = preconditioner};
    o.newton.product = product;
    o.newton.tolerance = 1e-10;
    o.newton.largest_linear_iterations = 100;
    o.newton.line_search = form == Form::momentum ? LineSearch::residual : LineSearch::energy;
    return o;
}

} // namespace

TEST_SUITE_BEGIN("mpm_implicit");

TEST_CASE("analytic Jacobian products agree with difference quotients to first order over four decades") {
    for (const ShapeFunction shape : all_shapes)
        for (const Geometry geometry : all_geometries)
            for (const std::string law :
                 {"elastic", "von Mises", "Drucker-Prager", "Perzyna", "neo-Hookean", "Hencky von Mises", "Johnson-Cook"})
                for (const ImplicitScheme scheme : {ImplicitScheme{.form = Form::velocity},
                                                    {.form = Form::momentum},
                                                    {.method = ImplicitMethod::midpoint},
                                                    {.method = ImplicitMethod::midpoint, .form = Form::momentum},
                                                    {.form = Form::velocity, .mu = 0.7},
                                                    {.method = ImplicitMethod::quasi_static}}) {
                    CAPTURE(static_cast<int>(shape));
                    CAPTURE(static_cast<int>(geometry));
                    CAPTURE(law);
                    CAPTURE(static_cast<int>(scheme.form));
                    CAPTURE(static_cast<int>(scheme.method));
                    Block b = strained_block(shape, geometry, law);
                    MomentumBalance balance(b.scene, scheme);
                    balance.prepare(b.state, 0.1);
                    const auto errors = jacobian_errors(balance, 21);
                    CAPTURE(errors[0]);
                    CAPTURE(errors[1]);
                    CAPTURE(errors[4]);
                    CHECK(errors[0] < 0.5);
                    // the error falls with h; a particle on the verge of yielding makes it lose less than a decade at most once
                    CHECK(errors[4] < 1e-5);
                    for (std::size_t k = 1; k < errors.size(); ++k)
                        CHECK(errors[k] < 0.2 * errors[k - 1] + 2e-7);
                }
}

TEST_CASE("the Jacobian of the velocity form is symmetric for associated laws without rotation") {
    Block b = strained_block(ShapeFunction::linear, Geometry::axisymmetric, "von Mises");
    b.scene.finite_rotation = false;
    MomentumBalance balance(b.scene, {});
    balance.prepare(b.state, 0.1);
    balance.linearise(balance.initial_guess());
    std::vector<double> x = random_vector(balance.size(), 1.0, 1), y = random_vector(balance.size(), 1.0, 2), jx(x.size()),
                        jy(y.size());
    for (std::size_t c = 0; c < x.size(); ++c)
        if (balance.nodes().prescribed[c])
            x[c] = y[c] = 0.0;
    balance.jacobian_times(x, jx);
    balance.jacobian_times(y, jy);
    CHECK(dot(y, jx) == doctest::Approx(dot(x, jy)).epsilon(1e-12));
    CHECK(dot(x, jx) > 0.0);
}

TEST_CASE("the residual is a function of u: it repeats bit by bit, and leaves the particles alone") {
    Block b = strained_block(ShapeFunction::bspline, Geometry::plane_strain, "von Mises");
    MomentumBalance balance(b.scene, {.form = Form::momentum});
    balance.prepare(b.state, 0.1);
    const Particles before = b.state.particles;
    std::vector<double> u(balance.initial_guess().begin(), balance.initial_guess().end()), first(u.size()), other(u.size()),
        again(u.size());
    balance.residual(u, first);
    std::vector<double> elsewhere = u;
    for (double& x : elsewhere)
        x *= 1.7;
    balance.residual(elsewhere, other);
    balance.linearise(elsewhere);
    balance.jacobian_times(u, other);
    balance.residual(u, again);
    CHECK(first == again);
    CHECK(same(b.state.particles, before));
}

TEST_CASE("mu = 0 gives the explicit step") {
    for (const Form form : {Form::velocity, Form::momentum}) {
        Block implicit_block = strained_block(ShapeFunction::linear, Geometry::plane_strain, "von Mises"),
              explicit_block = implicit_block;
        ImplicitOptions options = tight(SolverKind::newton_gmres, form);
        options.scheme.mu = 0.0;
        const auto stepper = make_implicit_stepper(implicit_block.scene, options);
        ExplicitStep step(explicit_block.scene, form);
        for (int n = 0; n < 3; ++n) {
            REQUIRE(stepper->attempt(implicit_block.state, 1e-4, implicit_block.state.time + 1e-4).accepted);
            step.advance(explicit_block.state, 1e-4, explicit_block.state.time + 1e-4);
        }
        for (std::size_t p = 0; p < implicit_block.state.particles.size(); ++p)
            CHECK(implicit_block.state.particles.stress_xy[p] ==
                  doctest::Approx(explicit_block.state.particles.stress_xy[p]).epsilon(1e-6));
    }
}

TEST_CASE("all solvers, Jacobian products and preconditioners find the same step") {
    for (const Form form : {Form::velocity, Form::momentum}) {
        Block reference = press();
        REQUIRE(make_implicit_stepper(reference.scene, tight(SolverKind::newton_gmres, form))
                    ->attempt(reference.state, 0.02, reference.state.time + 0.02)
                    .accepted);
        CHECK(*std::max_element(reference.state.particles.internal[0].begin(), reference.state.particles.internal[0].end()) >
              1e-5);
        for (const SolverKind solver : {SolverKind::newton_cg, SolverKind::newton_gmres, SolverKind::kinsol_gmres,
                                        SolverKind::kinsol_fgmres, SolverKind::kinsol_bicgstab, SolverKind::kinsol_cg})
            for (const JacobianProduct product : {JacobianProduct::analytic, JacobianProduct::difference})
                for (const PreconditionerKind preconditioner :
                     {PreconditionerKind::none, PreconditionerKind::diagonal, PreconditionerKind::tangent}) {
                    CAPTURE(static_cast<int>(form));
                    CAPTURE(static_cast<int>(solver));
                    CAPTURE(static_cast<int>(product));
                    CAPTURE(static_cast<int>(preconditioner));
                    Block b = press();
                    b.scene.finite_rotation = solver != SolverKind::newton_cg && solver != SolverKind::kinsol_cg; // symmetric J
                    if (!b.scene.finite_rotation && form == Form::momentum)
                        continue;
                    const auto stepper = make_implicit_stepper(b.scene, tight(solver, form, product, preconditioner));
                    const StepOutcome outcome = stepper->attempt(b.state, 0.02, b.state.time + 0.02);
                    CAPTURE(outcome.reason);
                    REQUIRE(outcome.accepted);
                    const double loose = b.scene.finite_rotation ? 1e-6 : 1e-2;
                    double worst = 0.0;
                    for (std::size_t p = 0; p < b.state.particles.size(); ++p)
                        worst =
                            std::max(worst, std::abs(b.state.particles.stress_yy[p] - reference.state.particles.stress_yy[p]));
                    CHECK(worst <= loose * largest_stress(reference.state.particles));
                }
    }
}

TEST_CASE("a linear scene takes one linear solve") {
    Block b = press("elastic");
    b.scene.finite_rotation = false;
    for (const SolverKind solver : {SolverKind::newton_cg, SolverKind::newton_gmres}) {
        const auto stepper = make_implicit_stepper(b.scene, tight(solver, Form::velocity));
        REQUIRE(stepper->attempt(b.state, 0.01, b.state.time + 0.01).accepted);
        CHECK(stepper->counts().newton_iterations == 0);
        CHECK(stepper->counts().linear_iterations > 5);
    }
}

TEST_CASE("implicit steps keep momentum to the tolerance of the solver, and a free body its velocity") {
    for (const ImplicitScheme scheme : {ImplicitScheme{}, {.form = Form::momentum}, {.method = ImplicitMethod::midpoint}}) {
        Block b = block(ShapeFunction::gimp, Geometry::plane_strain, "von Mises");
        shake(b.state.particles, 0.01);
        stress_randomly(b.scene, b.state.particles, 4.0);
        for (double& v : b.state.particles.velocity_x)
            v = 0.3;
        ImplicitOptions options = tight(SolverKind::newton_gmres, scheme.form);
        options.scheme = scheme;
        const auto stepper = make_implicit_stepper(b.scene, options);
        for (int n = 0; n < 5; ++n)
            REQUIRE(stepper->attempt(b.state, 0.05, b.state.time + 0.05).accepted);
        double px = 0.0, py = 0.0, mass = 0.0;
        for (std::size_t p = 0; p < b.state.particles.size(); ++p) {
            px += b.state.particles.mass[p] * b.state.particles.velocity_x[p];
            py += b.state.particles.mass[p] * b.state.particles.velocity_y[p];
            mass += b.state.particles.mass[p];
        }
        CHECK(px == doctest::Approx(0.3 * mass).epsilon(1e-7));
        CHECK(std::abs(py) <= 1e-7 * mass);
    }
}

TEST_CASE("a column of particles just inside a new cell: harmless to implicit steps and to the explicit momentum form") {
    // largest |stress_xx - 1| after a step under the uniform stress 1, with the column's natural coordinate delta
    const auto disturbance = [](double delta, const std::function<void(Block&)>& advance) {
        Block b = block(ShapeFunction::linear);
        b.scene.finite_rotation = false;
        for (double& x : b.state.particles.x)
            x += 0.025 + 0.1 * delta; // the last column was in the middle of the right half of its cell
        for (double& s : b.state.particles.stress_xx)
            s = 1.0;
        advance(b);
        double largest = 0.0;
        for (const double s : b.state.particles.stress_xx)
            largest = std::max(largest, std::abs(s - 1.0));
        return largest;
    };
    const auto explicit_step = [](Form form) {
        return [form](Block& b) { ExplicitStep(b.scene, form).advance(b.state, 1e-5, b.state.time + 1e-5); };
    };
    const auto implicit_step = [](Form form) {
        return [form](Block& b) {
            const StepOutcome outcome = make_implicit_stepper(b.scene, tight(SolverKind::newton_gmres, form))
                                            ->attempt(b.state, 0.01, b.state.time + 0.01);
            CAPTURE(outcome.reason);
            REQUIRE(outcome.accepted);
        };
    };
    CHECK(disturbance(1e-5, explicit_step(Form::velocity)) > 90.0 * disturbance(1e-3, explicit_step(Form::velocity)));
    CHECK(disturbance(1e-9, explicit_step(Form::momentum)) < 1.1 * disturbance(1e-3, explicit_step(Form::momentum)));
    for (const Form form : {Form::velocity, Form::momentum})
        for (const double delta : {1e-6, 1e-9, 1e-11})
            CHECK(disturbance(delta, implicit_step(form)) ==
                  doctest::Approx(disturbance(1e-4, implicit_step(form))).epsilon(0.01));
}

TEST_CASE("a step that fails leaves the state as it was, and a shorter one succeeds") {
    Block b = press();
    b.state.rigid_bodies[0].velocity = Velocity{0.0, -1.0};
    ImplicitOptions options = tight(SolverKind::newton_gmres, Form::velocity);
    SUBCASE("no convergence") {
        options.newton.largest_newton_iterations = 1;
        const auto stepper = make_implicit_stepper(b.scene, options);
        const Block before = b;
        const StepOutcome outcome = stepper->attempt(b.state, 0.05, b.state.time + 0.05);
        CHECK_FALSE(outcome.accepted);
        CHECK(contains(outcome.reason, "more than 1 iterations"));
        CHECK(same(b.state.particles, before.state.particles));
        CHECK(b.state.time == 0.0);
        CHECK(b.state.rigid_bodies[0].y == before.state.rigid_bodies[0].y);
    }
    SUBCASE("a folded grid") {
        const auto stepper = make_implicit_stepper(b.scene, options);
        const Block before = b;
        const StepOutcome outcome = stepper->attempt(b.state, 0.5, b.state.time + 0.5);
        CHECK_FALSE(outcome.accepted);
        CHECK(same(b.state.particles, before.state.particles));
        CHECK(stepper->attempt(b.state, 0.005, b.state.time + 0.005).accepted);
    }
}

TEST_CASE("no particle travels farther than two cells in a step") {
    Block b = block(ShapeFunction::linear);
    for (double& v : b.state.particles.velocity_x)
        v = 1.0;
    const auto stepper = make_implicit_stepper(b.scene, {});
    const Particles before = b.state.particles;
    const StepOutcome far = stepper->attempt(b.state, 0.21, b.state.time + 0.21);
    CHECK_FALSE(far.accepted);
    CHECK(far.failure == StepFailure::far_particle);
    CHECK(contains(far.reason, "2.1 cells"));
    CHECK(same(b.state.particles, before));
    CHECK(stepper->attempt(b.state, 0.19, b.state.time + 0.19).accepted);
}

TEST_CASE("a linear scene scales with its load, by every solver, form and method") {
    // stress of a bar's first step from a velocity, per velocity; a guess is never its own solution
    const auto stress = [](SolverKind solver, const ImplicitScheme& scheme, double speed) {
        Block b = block(ShapeFunction::linear);
        b.scene.finite_rotation = false;
        b.scene.grid.sides.bottom = SideCondition::slip;
        for (std::size_t p = 0; p < b.state.particles.size(); ++p) {
            b.state.particles.y[p] -= 0.2;
            b.state.particles.velocity_y[p] = speed * std::sin(3.0 * b.state.particles.y[p]);
        }
        ImplicitOptions options{.scheme = scheme, .solver = solver};
        const auto stepper = make_implicit_stepper(b.scene, options);
        std::vector<double> scaled;
        for (int n = 0; n < 3; ++n) {
            const StepOutcome outcome = stepper->attempt(b.state, 0.005, b.state.time + 0.005);
            CAPTURE(outcome.reason);
            REQUIRE(outcome.accepted);
        }
        CHECK(stepper->counts().linear_iterations >= 3);
        for (std::size_t p = 0; p < b.state.particles.size(); ++p)
            scaled.push_back(b.state.particles.stress_yy[p] / speed);
        return scaled;
    };
    for (const ImplicitScheme& scheme :
         {ImplicitScheme{}, {.method = ImplicitMethod::midpoint}, {.form = Form::momentum}, {.mu = 0.75}})
        for (const SolverKind solver : {SolverKind::newton_cg, SolverKind::newton_gmres, SolverKind::kinsol_gmres,
                                        SolverKind::kinsol_fgmres, SolverKind::kinsol_bicgstab, SolverKind::kinsol_cg}) {
            if (scheme.form == Form::momentum && (solver == SolverKind::newton_cg || solver == SolverKind::kinsol_cg))
                continue;
            CAPTURE(static_cast<int>(solver));
            // positions move with the speed: the reference is so slow that they stay
            const std::vector<double> reference = stress(SolverKind::newton_gmres, scheme, 1e-4);
            const double largest = std::abs(*std::max_element(reference.begin(), reference.end(),
                                                              [](double x, double y) { return std::abs(x) < std::abs(y); }));
            for (const double speed : {1e-12, 1e-9, 1e-6, 1e-4}) {
                CAPTURE(speed);
                const std::vector<double> scaled = stress(solver, scheme, speed);
                for (std::size_t p = 0; p < scaled.size(); ++p)
                    CHECK(std::abs(scaled[p] - reference[p]) <= 1e-4 * largest);
            }
        }
}

TEST_CASE("where no force acts no iteration is needed, and none follows from round-off") {
    for (const ImplicitScheme& scheme : {ImplicitScheme{}, {.method = ImplicitMethod::midpoint}, {.form = Form::momentum}}) {
        Block b = block(ShapeFunction::linear);
        shake(b.state.particles, 0.02);
        for (double& v : b.state.particles.velocity_x)
            v = 0.1;
        const auto stepper = make_implicit_stepper(b.scene, {.scheme = scheme});
        for (int n = 0; n < 5; ++n)
            REQUIRE(stepper->attempt(b.state, 0.001, b.state.time + 0.001).accepted);
        CHECK(stepper->counts().linear_iterations == 0);
    }
}

TEST_CASE("body forces of implicit steps are those at t + mu dt; quasi-static particles take the nodes' velocity") {
    for (const double mu : {1.0, 0.75, 0.5}) {
        Block b = block(ShapeFunction::linear);
        b.scene.body_force = [](std::int64_t, double, double, double time) { return std::array{0.0, 6.0 * time}; };
        const auto stepper = make_implicit_stepper(b.scene, {.scheme = {.mu = mu}});
        REQUIRE(stepper->attempt(b.state, 0.1, b.state.time + 0.1).accepted);
        for (const double v : b.state.particles.velocity_y) // free flight: dt b(mu dt)
            CHECK(v == doctest::Approx(0.1 * 6.0 * mu * 0.1).epsilon(1e-6));
    }
    // particles move by the mean velocity of a midpoint step, by the one at the end of the paper's
    for (const auto& [method, share] : {std::pair{ImplicitMethod::midpoint, 0.5}, {ImplicitMethod::paper, 1.0}})
        for (const Form form : {Form::velocity, Form::momentum}) {
            Block b = block(ShapeFunction::linear);
            b.scene.body_force = [](std::int64_t, double, double, double) { return std::array{0.0, 6.0}; };
            std::fill(b.state.particles.velocity_y.begin(), b.state.particles.velocity_y.end(), 0.2);
            const Particles before = b.state.particles;
            const auto stepper = make_implicit_stepper(b.scene, {.scheme = {.method = method, .form = form}});
            REQUIRE(stepper->attempt(b.state, 0.1, b.state.time + 0.1).accepted);
            for (std::size_t p = 0; p < before.size(); ++p) {
                const auto q = static_cast<std::size_t>(b.state.particles.id[p]);
                CHECK(b.state.particles.velocity_y[p] == doctest::Approx(0.2 + 0.6).epsilon(1e-6));
                CHECK(b.state.particles.y[p] - before.y[q] == doctest::Approx(0.1 * (0.2 + share * 0.6)).epsilon(1e-6));
            }
        }
    Block b = press("elastic");
    for (std::size_t p = 0; p < b.state.particles.size(); ++p)
        b.state.particles.velocity_x[p] = p % 2 == 0 ? 0.3 : -0.3; // of no meaning without inertia
    const Particles before = b.state.particles;
    const auto stepper = make_implicit_stepper(b.scene, {.scheme = {.method = ImplicitMethod::quasi_static}});
    REQUIRE(stepper->attempt(b.state, 0.01, b.state.time + 0.01).accepted);
    for (std::size_t p = 0; p < before.size(); ++p) {
        const auto q = static_cast<std::size_t>(b.state.particles.id[p]);
        CHECK(b.state.particles.velocity_y[p] == doctest::Approx((b.state.particles.y[p] - before.y[q]) / 0.01).epsilon(1e-9));
        CHECK(std::abs(b.state.particles.velocity_x[p]) < 0.15);
    }
}

TEST_CASE("the paper's scale of the residual is E dx dy dt") {
    Scene scene{.grid = {8, 6, 0.8, 1.5, 0.0, 0.0, {}}, .materials = {{linear_elastic_law(rubber)}}};
    State state;
    add_body(state.particles, {.shape = rectangle(0.3, 0.5, 0.5, 1.0), .density = 10.0}, scene);
    MomentumBalance balance(scene, {});
    balance.prepare(state, 0.04);
    CHECK(balance.paper_scale() == doctest::Approx(1000.0 * 0.1 * 0.25 * 0.04).epsilon(1e-12));
}

TEST_CASE("the scale of the root mean square loosens the tolerance by the root of the number of unknowns") {
    const auto iterations = [](ResidualScale scale, double factor) {
        Block b = press();
        ImplicitOptions options = tight(SolverKind::newton_gmres, Form::velocity);
        options.scale = scale;
        options.newton.tolerance = 1e-5 * factor;
        const auto stepper = make_implicit_stepper(b.scene, options);
        REQUIRE(stepper->attempt(b.state, 0.02, b.state.time + 0.02).accepted);
        return std::pair{stepper->counts().linear_iterations,
                         std::sqrt(static_cast<double>(stepper->discretisation().nodes().components()))};
    };
    const auto [rms, root] = iterations(ResidualScale::stiffness_rms, 1.0);
    CHECK(rms == iterations(ResidualScale::stiffness, root).first);
    CHECK(rms < iterations(ResidualScale::stiffness, 1.0).first);
}

TEST_CASE("impossible combinations are refused") {
    const Block b = block(ShapeFunction::linear);
    const auto refusal = [&](const ImplicitOptions& options) {
        return message_of<InputError>([&] { (void)make_implicit_stepper(b.scene, options); });
    };
    CHECK(contains(refusal({.scheme = {.mu = 1.5}}), "mu = 1.5"));
    CHECK(contains(refusal({.scheme = {.method = ImplicitMethod::quasi_static, .form = Form::momentum}}), "quasi-static"));
    CHECK(contains(refusal({.scheme = {.form = Form::momentum}, .solver = SolverKind::newton_cg}), "symmetric Jacobian"));
}

TEST_SUITE_END();

} // namespace mpm_implicit_suite
