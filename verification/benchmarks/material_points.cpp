// SPDX-License-Identifier: GPL-3.0-or-later
// benchmark_material_points: what the kernels of the material point method cost, for sorted particles.
//
//   build/release/benchmark_material_points [cells along a side, 256 by default [threads, 1 by default]]
//
// A square of von Mises metal under random stress, four particles a cell, of which a part flows plastically. Prints nanoseconds
// and the bytes of particle data a call must touch, with the bandwidth that makes, beside that of a plain copy of memory.
#include <ductile/base/threads.hpp>
#include <ductile/base/timer.hpp>
#include <ductile/material/von_mises.hpp>
#include <ductile/mpm/explicit_step.hpp>
#include <ductile/mpm/momentum_balance.hpp>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fmt/format.h>
#include <random>

using namespace ductile;
using namespace ductile::mpm;

namespace {

/// Seconds of a call: the fastest of several.
double fastest(const auto& call) {
    double best = 1e300;
    for (int n = 0; n < 7; ++n) {
        const Timer timer;
        call();
        best = std::min(best, timer.seconds());
    }
    return best;
}

struct Case {
    Scene scene;
    State state;
};

Case make_case(int cells, ShapeFunction shape, Geometry geometry) {
    const double size = 1e-3 * cells;
    Case c{
        .scene = {.geometry = geometry,
                  .grid = {.cells_x = cells + 4, .cells_y = cells + 4, .width = size + 4e-3, .height = size + 4e-3},
                  .shape = shape,
                  .materials = {{von_mises_law(elasticity_from_young(200e9, 0.3), {.yield_stress = 0.7e9, .modulus = 0.3e9})}}},
        .state = {}};
    add_body(c.state.particles, {.shape = rectangle(2e-3, 2e-3, size + 2e-3, size + 2e-3), .density = 7800.0}, c.scene);
    std::mt19937 engine(1);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    Particles& p = c.state.particles;
    for (std::size_t i = 0; i < p.size(); ++i) {
        p.x[i] += 1e-4 * uniform(engine);
        p.y[i] += 1e-4 * uniform(engine);
        p.velocity_x[i] = uniform(engine);
        p.velocity_y[i] = uniform(engine);
        for (auto* stress : {&p.stress_xx, &p.stress_yy, &p.stress_zz, &p.stress_xy})
            (*stress)[i] = 0.3e9 * uniform(engine);
    }
    return c;
}

void report(const char* what, double seconds, std::size_t particles, double bytes) {
    const double each = seconds / static_cast<double>(particles);
    fmt::print("  {:32} {:7.1f} ns a particle   {:6.1f} million a second   {:5.1f} GB/s\n", what, each * 1e9, 1e-6 / each,
               bytes / each * 1e-9);
}

void measure(int cells, ShapeFunction shape, Geometry geometry, const char* title) {
    Case c = make_case(cells, shape, geometry);
    const std::size_t count = c.state.particles.size();
    fmt::print("{}, {} particles\n", title, count);
    const double weights = shape == ShapeFunction::linear ? 16.0 : 96.0;
    const double tangent = geometry == Geometry::axisymmetric ? 160.0 : 96.0;
    const double dt = explicit_step_size(c.scene, c.state.particles, 0.4);
    for (const Form form : {Form::velocity, Form::momentum}) {
        const std::string name = form == Form::velocity ? " (velocity)" : " (momentum)";
        MomentumBalance balance(c.scene, {.form = form});
        balance.prepare(c.state, 50.0 * dt);
        std::vector<double> u(balance.initial_guess().begin(), balance.initial_guess().end()), f(u.size());
        for (double& x : u)
            x *= 0.9;
        if (form == Form::velocity)
            report("preparation of a step", fastest([&] { balance.prepare(c.state, 50.0 * dt); }), count, 72.0 + weights);
        report(("residual" + name).c_str(), fastest([&] { balance.residual(u, f); }), count, 48.0 + weights);
        report(("linearisation" + name).c_str(), fastest([&] { balance.linearise(u); }), count, 48.0 + weights + tangent);
        report(("Jacobian product" + name).c_str(), fastest([&] { balance.jacobian_times(u, f); }), count, weights + tangent);
    }
    for (const Form form : {Form::velocity, Form::momentum}) {
        ExplicitStep step(c.scene, form);
        step.advance(c.state, 1e-3 * dt, c.state.time + 1e-3 * dt);
        report(form == Form::velocity ? "explicit step (velocity)" : "explicit step (momentum)",
               fastest([&] { step.advance(c.state, 1e-3 * dt, c.state.time + 1e-3 * dt); }), count, 300.0);
    }
}

} // namespace

int main(int argc, char** argv) {
    const int cells = argc > 1 ? std::atoi(argv[1]) : 256, threads = argc > 2 ? std::atoi(argv[2]) : 1;
    set_thread_count(threads);
    std::vector<double> source(1 << 24, 1.0), target(1 << 24);
    const double seconds = fastest([&] { std::memcpy(target.data(), source.data(), source.size() * sizeof(double)); });
    fmt::print("{} thread{}; copy of memory by one: {:.1f} GB/s read and written\n", threads, threads == 1 ? "" : "s",
               2e-9 * static_cast<double>(source.size() * sizeof(double)) / seconds);
    measure(cells, ShapeFunction::linear, Geometry::plane_strain, "linear, plane strain");
    measure(cells, ShapeFunction::linear, Geometry::axisymmetric, "linear, axisymmetric");
    measure(cells, ShapeFunction::gimp, Geometry::plane_strain, "GIMP, plane strain");
    measure(cells, ShapeFunction::bspline, Geometry::plane_strain, "B-splines, plane strain");
}
