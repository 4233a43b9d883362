// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/threads.hpp>
#include <ductile/material/perzyna.hpp>
#include <ductile/material/stz.hpp>
#include <ductile/quasistatic/projection_stepper.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <memory>
#include <numbers>
#include <random>

/// Fields and scenes that several suites share.
namespace fields {

using namespace ductile;
using namespace ductile::quasistatic;

/// Test cases on small grids run on one thread. Those about threads set their own number.
struct OneThread {
    OneThread() { set_thread_count(1); }
    ~OneThread() { set_thread_count(threads_before); }
    OneThread(const OneThread&) = delete;
    OneThread& operator=(const OneThread&) = delete;

    int threads_before = thread_count();
};

/// Elasticity and plasticity of the paper in units of the yield stress, Tables 1 and A.3.
inline const IsotropicElasticity metallic_glass{.bulk_modulus = 122.0 / 0.85, .shear_modulus = 37.4 / 0.85};
inline const StzModel stz{StzParameters{}, Units{}};
inline const Law glass_law = stz_law(metallic_glass, StzParameters{}, Units{});

inline Scene scene_on(const Grid& grid, Model model, const WallVelocity& walls, const Law& law = glass_law) {
    return {.units = {}, .grid = grid, .law = law, .model = model, .walls = moving(walls)};
}

inline std::vector<Field*> fields_of(CellState& c) {
    std::vector<Field*> fields;
    for (int k = 0; k < c.count(); ++k)
        fields.push_back(&c.field(k));
    return fields;
}
inline std::vector<const Field*> fields_of(const CellState& c) {
    std::vector<const Field*> fields;
    for (int k = 0; k < c.count(); ++k)
        fields.push_back(&c.field(k));
    return fields;
}
inline std::vector<const Field*> fields_of(const State& s) {
    std::vector<const Field*> fields = fields_of(s.cells);
    fields.insert(fields.end(), {&s.velocity.u, &s.velocity.v});
    return fields;
}

inline void wrap(Field& f) {
    for (int j = 0; j < f.rows(); ++j)
        f.wrap_row(j);
}

/// Independent uniform numbers in [low, high] at every point.
inline void fill_randomly(Field& f, std::mt19937& engine, double low, double high) {
    std::uniform_real_distribution<double> uniform(low, high);
    for (int j = 0; j < f.rows(); ++j)
        for (int i = 0; i < f.columns(); ++i)
            f(i, j) = uniform(engine);
    wrap(f);
}

/// mean + a sum of six waves, periodic in x, of random direction and phase, with the given amplitude.
inline void fill_smoothly(Field& f, std::mt19937& engine, double mean, double amplitude) {
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    double wave[6][4];
    for (auto& w : wave)
        for (double& number : w)
            number = uniform(engine);
    for (int j = 0; j < f.rows(); ++j)
        for (int i = 0; i < f.columns(); ++i) {
            double sum = 0.0;
            for (int k = 0; k < 6; ++k) {
                const double x = static_cast<double>(i) / f.columns(), y = static_cast<double>(j) / f.rows();
                sum += (wave[k][0] - 0.5) * std::sin(2.0 * std::numbers::pi * ((k / 2) * x + 1.5 * wave[k][2] * y + wave[k][3]));
            }
            f(i, j) = mean + amplitude * sum;
        }
    wrap(f);
}

inline double largest(const Field& f) {
    double m = 0.0;
    for (int j = 0; j < f.rows(); ++j)
        for (int i = 0; i < f.columns(); ++i)
            m = std::max(m, std::abs(f(i, j)));
    return m;
}

/// Largest difference over rows and the images that wrap_row() fills.
inline double distance(const Field& a, const Field& b) {
    double m = 0.0;
    for (int j = 0; j < a.rows(); ++j)
        for (int i = -2; i < a.padded_columns() + 3; ++i) {
            const double d = std::abs(a(i, j) - b(i, j));
            m = d <= m ? m : d; // NaN is kept
        }
    return m;
}

/// Bitwise equality of all rows without the ghosts.
inline bool same_bits(const Field& a, const Field& b) {
    for (int j = 0; j < a.rows(); ++j)
        if (std::memcmp(a.row(j), b.row(j), sizeof(double) * static_cast<std::size_t>(a.columns())) != 0)
            return false;
    return true;
}
inline bool same_bits(const State& a, const State& b) {
    const auto fa = fields_of(a), fb = fields_of(b);
    return std::equal(fa.begin(), fa.end(), fb.begin(), [](const Field* x, const Field* y) { return same_bits(*x, *y); }) &&
           a.time == b.time && a.step == b.step;
}

/// A value that is the same everywhere.
inline void check_uniform(const Field& f, double value, double bound) {
    double worst = 0.0;
    for (int j = 0; j < f.rows(); ++j)
        for (int i = 0; i < f.columns(); ++i) {
            const double d = std::abs(f(i, j) - value);
            worst = d <= worst ? worst : d;
        }
    CHECK(worst <= bound);
}

/// Which one space_for() makes; see EachSpace.
inline SpaceKind space_kind = SpaceKind::staggered;

/// Elements as high as may be, two of them where the rows allow it.
inline std::unique_ptr<Space> space_for(const Scene& scene, Stiffness stiffness = Stiffness::exact) {
    int degree = scene.grid.cells_y / 2;
    while (degree > 1 && (scene.grid.cells_y % degree != 0 || degree > 16))
        --degree;
    return make_space(scene, {.kind = space_kind,
                              .stiffness = stiffness,
                              .advection = Advection::eno2,
                              .elements = {.degree = degree > 1 ? degree : scene.grid.cells_y}});
}

/// Of a test case that says the same of all spaces: it runs on one after the other.
struct EachSpace : OneThread {
    EachSpace() {
        SUBCASE("staggered") { space_kind = SpaceKind::staggered; }
        SUBCASE("elements") { space_kind = SpaceKind::elements; }
    }
    ~EachSpace() { space_kind = SpaceKind::staggered; }
    EachSpace(const EachSpace&) = delete;
    EachSpace& operator=(const EachSpace&) = delete;
};

// the verbs of a space of its own each

inline State initial_state(const Scene& scene, const Field& internal) {
    return quasistatic::initial_state(scene, *space_for(scene), internal);
}
inline CellState cells_of(const Scene& scene) { return space_for(scene)->make_cells(); }
inline Observables observe(const Scene& scene, const CellState& cells) { return space_for(scene)->observe(cells); }
inline double equilibrium_residual(const Scene& scene, const CellState& cells, VectorField& force) {
    return space_for(scene)->equilibrium_residual(cells.stress, force);
}
inline CombinationNorm norm(const Scene& scene, std::span<const Space::Term> terms) { return space_for(scene)->norm(terms); }
inline Rk21Counts predict(const Scene& scene, Predictor predictor, const CellState& now, CellState& transported,
                          const VectorField& velocity, double dt, const Rk21Options& options, CellState& next,
                          VectorField& force) {
    return space_for(scene)->predict(predictor, now, transported, velocity, dt, options, next, force);
}

/// A stepper with the one state that it leads on.
class Stepping {
public:
    Stepping(std::unique_ptr<TimeStepper> stepper, State state) : stepper_(std::move(stepper)), state_(std::move(state)) {}

    [[nodiscard]] const State& state() const { return state_; }
    [[nodiscard]] double time_scale() { return stepper_->time_scale(state_); }
    [[nodiscard]] double limit_step(double dt) { return stepper_->limit_step(state_, dt); }
    StepAttempt attempt(double dt, double end, const Judge& judge, const Within& within = {}) {
        return stepper_->attempt(state_, dt, end, judge, within);
    }
    /// One step that is accepted whatever it was like.
    StepAttempt advance(double dt, double end) {
        return attempt(dt, end, [](const StepAttempt&) { return true; });
    }
    [[nodiscard]] StepperCounts counts() const { return stepper_->counts(); }
    [[nodiscard]] auto steps_by_method() const { return stepper_->steps_by_method(state_); }

private:
    std::unique_ptr<TimeStepper> stepper_;
    State state_;
};

/// With the pointwise tolerances of fixed steps, Sec. 8.1.
inline Stepping stepper_for(const Scene& scene, Predictor predictor, const State& start, double factor = 1e-7,
                            Transport transport = Transport::frozen) {
    return {std::make_unique<ProjectionStepper>(scene, predictor, PointwiseTolerance{PointwiseTolerance::Scale::step, factor},
                                                space_for(scene), transport),
            start};
}

/// The pointwise tolerances of fixed steps, Sec. 8.1.
inline Rk21Options pointwise(double dt, double factor = 1e-7) {
    return {.absolute_tolerance = std::max(factor * dt * dt, 1e-16),
            .relative_tolerance = std::max(factor * dt * dt, 1e-17),
            .exact_components = 1};
}

/// `steps` equal steps from `start` to `end`.
inline State run(const Scene& scene, Predictor predictor, const State& start, double end, int steps) {
    Stepping stepper = stepper_for(scene, predictor, start);
    const double dt = (end - start.time) / steps;
    for (int n = 1; n <= steps; ++n)
        stepper.advance(dt, start.time + n * dt);
    return stepper.state();
}

} // namespace fields
