// SPDX-License-Identifier: GPL-3.0-or-later
// Memory is allocated before the time loop: what steps of the quasi-static schemes and of material points allocate once they run.
#include "fields.hpp"
#include "mpm_scenes.hpp"
#include <ductile/mpm/time_stepper.hpp>
#include <ductile/quasistatic/initial.hpp>
#include <ductile/quasistatic/schemes.hpp>

#include <atomic>
#include <cstdlib>
#include <doctest/doctest.h>
#include <new>

namespace {

std::atomic<long long> allocations{0};

void* counted(std::size_t size, std::size_t alignment) {
    allocations.fetch_add(1, std::memory_order_relaxed);
    void* const memory = alignment > alignof(std::max_align_t)
                             ? std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment)
                             : std::malloc(size > 0 ? size : 1);
    if (memory == nullptr)
        throw std::bad_alloc();
    return memory;
}

} // namespace

// Not inlined: g++ 12 takes the inlined free() for a mismatch with an operator new that it has not inlined.
void* operator new(std::size_t size) { return counted(size, 0); }
void* operator new[](std::size_t size) { return counted(size, 0); }
void* operator new(std::size_t size, std::align_val_t alignment) { return counted(size, static_cast<std::size_t>(alignment)); }
void* operator new[](std::size_t size, std::align_val_t alignment) { return counted(size, static_cast<std::size_t>(alignment)); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return std::malloc(size > 0 ? size : 1); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return std::malloc(size > 0 ? size : 1); }
[[gnu::noinline]] void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace {

/// Of `steps` calls after more that may still make room: nodes become active, bases grow.
long long allocations_of(int steps, const auto& step) {
    for (int n = 0; n < 10 * steps; ++n)
        step();
    const long long before = allocations;
    for (int n = 0; n < steps; ++n)
        step();
    return allocations - before;
}

} // namespace

TEST_SUITE("allocations") {
    TEST_CASE_FIXTURE(fields::OneThread, "a step of material points allocates nothing") {
        using namespace ductile;
        using namespace ductile::mpm;
        for (const ShapeFunction shape : {ShapeFunction::linear, ShapeFunction::gimp, ShapeFunction::bspline})
            for (const std::string law : {"elastic", "von Mises"}) {
                const auto count = [&](std::unique_ptr<TimeStepper> stepper, double dt) {
                    mpm_scenes::Block b = mpm_scenes::block(shape, Geometry::plane_strain, law);
                    const double shift = shape == ShapeFunction::gimp ? 0.04 : 0.0; // nodes of little mass take many iterations
                    for (std::size_t p = 0; p < b.state.particles.size(); ++p) {
                        b.state.particles.x[p] += shift;
                        b.state.particles.y[p] += shift;
                        b.state.particles.velocity_x[p] = 0.01 * std::sin(9.0 * b.state.particles.y[p]);
                    }
                    return allocations_of(6, [&] { REQUIRE(stepper->attempt(b.state, dt, b.state.time + dt).accepted); });
                };
                const Scene scene = mpm_scenes::block(shape, Geometry::plane_strain, law).scene;
                CAPTURE(static_cast<int>(shape));
                CAPTURE(law);
                CHECK(count(make_explicit_stepper(scene, Form::momentum), 1e-4) == 0);
                for (const mpm::SolverKind solver : {mpm::SolverKind::newton_cg, mpm::SolverKind::newton_gmres})
                    for (const PreconditionerKind preconditioner : {PreconditionerKind::none, PreconditionerKind::diagonal})
                        for (const ImplicitMethod method : {ImplicitMethod::paper, ImplicitMethod::midpoint}) {
                            CAPTURE(static_cast<int>(solver));
                            CAPTURE(static_cast<int>(preconditioner));
                            CHECK(count(make_implicit_stepper(
                                            scene,
                                            {.scheme = {.method = method}, .solver = solver, .preconditioner = preconditioner}),
                                        1e-3) == 0);
                        }
            }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "a step on the grid allocates nothing") {
        using namespace ductile;
        using namespace ductile::quasistatic;
        const Scene scene = fields::scene_on({16, 12}, Model::full, {2e-7, 0.0});
        for (const char* name : {"euler", "substepped", "incremental", "extrapolated", "ralston", "bogacki-shampine",
                                 "dormand-prince", "chebyshev", "auto"}) {
            CAPTURE(std::string(name));
            const auto stepper = make_stepper(name, scene, fields::space_for(scene), {});
            State state = fields::initial_state(scene, initial_internal(scene.grid, Uniform{0.033}, scene.law->variables()[0]));
            CHECK(allocations_of(5, [&] {
                      const double dt = 5e3;
                      REQUIRE(stepper->attempt(state, dt, state.time + dt, [](const StepAttempt&) { return true; }).accepted);
                  }) == 0);
        }
    }
}
