// SPDX-License-Identifier: GPL-3.0-or-later
// The number of threads changes no bit of a step.
#include "mpm_scenes.hpp"

#include <ductile/base/threads.hpp>
#include <ductile/mpm/time_stepper.hpp>

namespace mpm_threads_suite {

using namespace mpm_scenes;

namespace {

/// A block of some 6000 shaken particles, enough for threads, pressed by a plate.
Block large_block(ShapeFunction shape) {
    Block b{
        .scene = {.geometry = Geometry::axisymmetric,
                  .grid = {.cells_x = 48, .cells_y = 48, .width = 0.48, .height = 0.48, .sides = {.bottom = SideCondition::slip}},
                  .shape = shape,
                  .materials = {{law_named("von Mises")}}},
        .state = {}};
    add_body(b.state.particles, {.shape = rectangle(0.05, 0.0, 0.45, 0.38), .density = 10.0}, b.scene);
    b.state.rigid_bodies.push_back(make_rigid_body("plate", rectangle(0.0, 0.38, 0.48, 0.42), 2, b.scene.grid));
    b.state.rigid_bodies[0].velocity = Velocity{0.0, -0.1};
    shake(b.state.particles, 0.002);
    for (double& y : b.state.particles.y)
        y = std::max(y, 1e-4);
    stress_randomly(b.scene, b.state.particles, 2.0);
    return b;
}

/// Sets the number of threads for as long as it lives.
struct Threads {
    explicit Threads(int count) { set_thread_count(count); }
    ~Threads() { set_thread_count(before); }
    int before = thread_count();
};

Particles after_steps(ShapeFunction shape, const std::function<std::unique_ptr<TimeStepper>(const Scene&)>& make, double dt,
                      int threads) {
    const Threads team(threads);
    Block b = large_block(shape);
    const auto stepper = make(b.scene);
    for (int n = 0; n < 3; ++n)
        REQUIRE(stepper->attempt(b.state, dt, b.state.time + dt).accepted);
    return b.state.particles;
}

} // namespace

TEST_SUITE_BEGIN("mpm_threads");

TEST_CASE("explicit and implicit steps have the same bits on one, two and three threads") {
    const auto explicit_steps = [](const Scene& scene) { return make_explicit_stepper(scene, Form::momentum); };
    const auto implicit_steps = [](PreconditionerKind preconditioner) {
        return [preconditioner](const Scene& scene) { return make_implicit_stepper(scene, {.preconditioner = preconditioner}); };
    };
    for (const ShapeFunction shape : all_shapes)
        for (const auto& [make, dt] :
             {std::pair<std::function<std::unique_ptr<TimeStepper>(const Scene&)>, double>{explicit_steps, 1e-4},
              {implicit_steps(PreconditionerKind::diagonal), 2e-3},
              {implicit_steps(PreconditionerKind::tangent), 2e-3}}) {
            CAPTURE(static_cast<int>(shape));
            const Particles one = after_steps(shape, make, dt, 1);
            REQUIRE(one.size() > 4000);
            for (const int threads : {2, 3, 8}) {
                CAPTURE(threads);
                const Particles several = after_steps(shape, make, dt, threads);
                const auto first = named_arrays(one), second = named_arrays(several);
                for (std::size_t k = 0; k < first.size(); ++k)
                    CHECK(*first[k].second == *second[k].second);
            }
        }
}

TEST_CASE("so have long sums, and a Krylov method made of them") {
    const std::size_t size = 40'001;
    const std::vector<double> a = random_vector(size, 1.0, 1), b = random_vector(size, 1.0, 2);
    const auto results = [&](int threads) {
        const Threads team(threads);
        std::vector<double> s(size);
        Krylov krylov;
        const auto map = [&](std::span<const double> x, std::span<double> result) {
            for (std::size_t i = 0; i < size; ++i)
                result[i] = (3.0 + a[i]) * x[i] - (i > 0 ? x[i - 1] : 0.0);
        };
        CHECK(krylov.gmres(map, {}, b, s, 1e-8, 60).converged);
        s.push_back(dot(a, b));
        return s;
    };
    const std::vector<double> one = results(1);
    CHECK(results(2) == one);
    CHECK(results(3) == one);
}

TEST_SUITE_END();

} // namespace mpm_threads_suite
