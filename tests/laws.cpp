// SPDX-License-Identifier: GPL-3.0-or-later
// Laws whose type is forgotten: both forms of each, any number of internal variables, batches and single points.
#include "capture.hpp"
#include "fields.hpp"
#include "messages.hpp"
#include "mpm_scenes.hpp"
#include <ductile/material/make_law.hpp>
#include <ductile/mpm/explicit_step.hpp>
#include <ductile/space/space.hpp>

#include <array>
#include <cmath>
#include <doctest/doctest.h>
#include <functional>
#include <random>
#include <vector>

namespace laws_suite {

using namespace ductile;

namespace {

/// Perzyna's law with three times its plastic strain as a second internal variable, and the time above yield as a third, which
/// nothing depends on.
struct ThreeVariables {
    PerzynaModel perzyna;

    static std::array<InternalVariable, 3> variables() {
        InternalVariable triple = plastic_strain_variable, clock = plastic_strain_variable;
        triple.name = "triple_strain";
        triple.start = 0.25;
        clock.name = "flow_time";
        clock.upper = 1e9;
        return {plastic_strain_variable, triple, clock};
    }
    template <class V> [[nodiscard]] V yield_stress(const std::array<V, 3>& x) const {
        return perzyna.yield_stress(std::array{x[0]});
    }
    template <class V> [[nodiscard]] V flow_slope(const V& sbar, const std::array<V, 3>& x) const {
        return perzyna.flow_slope(sbar, std::array{x[0]});
    }
    template <class V> [[nodiscard]] PlasticRates<V, 3> rates(const V& sbar, const std::array<V, 3>& x) const {
        const auto one = perzyna.rates(sbar, std::array{x[0]});
        return {one.fluidity, {one.internal[0], V(3.0) * one.internal[0], select(one.fluidity > V(0.0), V(1.0), V(0.0))}};
    }
};

const PerzynaParameters metal{.yield_stress = 0.7, .hardening_modulus = 2.0, .reference_rate = 0.3};
const IsotropicElasticity elasticity{.bulk_modulus = 140.0, .shear_modulus = 44.0};

struct Named {
    const char* name;
    Law law;
    double start; ///< of each internal variable
};
std::vector<Named> laws_with_rates() {
    return {{"STZ", stz_law(elasticity, {}, Units{}), 0.033},
            {"Perzyna", perzyna_law(elasticity, metal), 0.02},
            {"three variables", make_law(elasticity, ThreeVariables{PerzynaModel(metal, si_units)}), 0.02},
            {"von Mises", von_mises_law(elasticity, {.yield_stress = 1.3, .modulus = 4.0}, 0.2), 0.02},
            {"elastic", linear_elastic_law(elasticity), 0.0}};
}

/// Rows of a batch with room for whole vectors.
struct Batch {
    std::vector<std::vector<double>> values;
    std::vector<double*> rows;

    Batch(std::size_t fields, int count)
        : values(fields, std::vector<double>(static_cast<std::size_t>(round_up_to_row_unit(count)))) {
        for (auto& row : values)
            rows.push_back(row.data());
    }
    [[nodiscard]] std::vector<double> point(int i) const {
        std::vector<double> y;
        for (const auto& row : values)
            y.push_back(row[static_cast<std::size_t>(i)]);
        return y;
    }
};

} // namespace

TEST_SUITE_BEGIN("laws");

TEST_CASE("a batch of cells flows as each point by itself does") {
    for (const auto& [name, law, start] : laws_with_rates()) {
        CAPTURE_BINDING(name);
        const std::size_t n = law->variables().size();
        const int count = 2 * pack_size + 3;
        Batch y(3 + n, count), rate(3 + n, count);
        std::mt19937 engine(3);
        std::uniform_real_distribution<double> uniform(-1.0, 1.0);
        for (std::size_t k = 0; k < 3 + n; ++k)
            for (double& value : y.values[k])
                value = k < 3 ? 1.2 * uniform(engine) : start;
        for (auto& row : rate.values)
            for (double& value : row)
                value = 0.01 * uniform(engine);
        const Batch source = rate;
        const FlowSums sums = law->add_flow_rates(count, y.rows.data(), rate.rows.data());
        double expected = 0.0, dissipation = 0.0;
        int flowing = 0;
        for (int i = 0; i < count; ++i) {
            const std::vector<double> at = y.point(i);
            std::vector<double> one = source.point(i);
            law->add_flow_rate(at.data(), one.data());
            const double sbar = std::sqrt(at[0] * at[0] + at[1] * at[1] + 3.0 * at[2] * at[2]);
            const FlowAt flow = law->flow_at(sbar, std::span(at).subspan(3));
            const bool flows = sbar >= flow.yield_stress;
            flowing += flows ? 1 : 0;
            if (flows)
                expected = std::max(expected, 2.0 * elasticity.shear_modulus * flow.slope);
            if (flows)
                dissipation += 2.0 * sbar * sbar * flow.fluidity;
            for (std::size_t k = 0; k < 3 + n; ++k)
                CHECK(rate.point(i)[k] == doctest::Approx(one[k]).epsilon(1e-12).scale(1e-3));
            if (flows) // Eq. (20), and the rates of the internal variables
                CHECK(one[0] == doctest::Approx(source.point(i)[0] - 2.0 * elasticity.shear_modulus * flow.fluidity * at[0]));
            for (std::size_t k = 0; k < n; ++k)
                CHECK(one[3 + k] == doctest::Approx(source.point(i)[3 + k] + (flows ? flow.internal_rates[k] : 0.0)));
        }
        CHECK(sums.relaxation == doctest::Approx(expected).epsilon(1e-12));
        CHECK(sums.dissipation == doctest::Approx(dissipation).epsilon(1e-12));
        CHECK((flowing > 3) == (n > 0));
    }
}

TEST_CASE("substeps of a batch end where the rates, integrated point by point, do") {
    for (const auto& [name, law, start] : laws_with_rates()) {
        CAPTURE_BINDING(name);
        const std::size_t n = law->variables().size();
        const int count = pack_size + 5;
        const double dt = 0.4;
        Batch y(3 + n, count), end(3 + n, count);
        std::mt19937 engine(4);
        std::uniform_real_distribution<double> uniform(-1.0, 1.0);
        for (std::size_t k = 0; k < 3 + n; ++k)
            for (std::size_t i = 0; i < y.values[k].size(); ++i) {
                y.values[k][i] = k < 3 ? 0.8 * uniform(engine) : start;
                end.values[k][i] = k < 3 ? 0.5 * uniform(engine) : 0.0;
            }
        const Batch source = end;
        Rk21Counts counts;
        const double dissipated =
            law->flow_by_substeps(count, y.rows.data(), end.rows.data(), dt,
                                  {.absolute_tolerance = 1e-9, .relative_tolerance = 1e-9, .exact_components = 1}, counts);
        CHECK(!counts.failed);
        double expected = 0.0; // stress in the middle times plastic strain
        for (int i = 0; i < count; ++i) {
            const std::vector<double> from = y.point(i), to = end.point(i), constant = source.point(i);
            for (std::size_t k = 0; k < 3; ++k)
                expected += (k < 2 ? 1.0 : 3.0) / elasticity.shear_modulus * 0.5 * (from[k] + to[k]) *
                            (from[k] + dt * constant[k] - to[k]);
        }
        CHECK(dissipated == doctest::Approx(expected).epsilon(1e-11).scale(1.0));
        CHECK((counts.accepted > 0) == (n > 0));
        for (int i = 0; i < count; ++i) {
            std::vector<double> x = y.point(i);
            const std::vector<double> constant = source.point(i);
            const int steps = 20'000; // a midpoint rule, slow and plain
            for (int s = 0; s < steps; ++s) {
                std::vector<double> slope = constant, middle = x;
                law->add_flow_rate(x.data(), slope.data());
                for (std::size_t k = 0; k < x.size(); ++k)
                    middle[k] += 0.5 * dt / steps * slope[k];
                slope = constant;
                law->add_flow_rate(middle.data(), slope.data());
                for (std::size_t k = 0; k < x.size(); ++k)
                    x[k] += dt / steps * slope[k];
            }
            for (std::size_t k = 0; k < x.size(); ++k)
                CHECK(end.point(i)[k] == doctest::Approx(x[k]).epsilon(2e-4).scale(0.1));
        }
    }
}

TEST_CASE("a rate-independent law relaxes: in steady shear it stands above yield by mu T times the rate") {
    const double relaxation_time = 0.02, rate = 0.05; // du/dy
    const Law law = von_mises_law(elasticity, {.yield_stress = 1.3}, relaxation_time);
    std::vector<double> y(3 + law->variables().size()); // s, tau, q, plastic strain
    const double dt = 1e-3, mu = elasticity.shear_modulus, end = 3.0;
    for (int n = 0; n < static_cast<int>(end / dt); ++n) {
        std::vector<double> slope(y.size());
        slope[1] = mu * rate;
        law->add_flow_rate(y.data(), slope.data());
        for (std::size_t k = 0; k < y.size(); ++k)
            y[k] += dt * slope[k];
    }
    const double tau = 1.3 / std::sqrt(3.0) + mu * relaxation_time * rate;
    CHECK(y[1] == doctest::Approx(tau).epsilon(1e-6));
    // the equivalent plastic strain lags behind by what the law would flow at once
    const double plastic = (rate * end - tau / mu) / std::sqrt(3.0);
    CHECK(y[3] == doctest::Approx(plastic).epsilon(0.01));
    // and within the elastic range nothing happens
    std::vector<double> elastic(y.size()), still(y.size());
    elastic[1] = 0.7;
    law->add_flow_rate(elastic.data(), still.data());
    CHECK(still == std::vector<double>(y.size()));
}

TEST_CASE("a law whose flow changes the volume has no rates, and cells refuse it") {
    const Law soil = drucker_prager_law(elasticity, {.cohesion = 1.0, .friction = 0.5, .dilatancy = 0.2});
    CHECK(!soil->has_rates());
    const auto scene = fields::scene_on({4, 4, 1.0, 1.0}, quasistatic::Model::full, {1e-3, 0.0}, soil);
    CHECK(contains(message_of<InputError>([&] { (void)fields::initial_state(scene, Field(4, 4)); }), "changes the volume"));
}

TEST_CASE("three internal variables on cells: each has its field, its rate and its part in the norm") {
    fields::OneThread one_thread;
    const Grid grid{11, 6, 2.0, 2.0};
    const Law three = make_law(fields::metallic_glass,
                               ThreeVariables{PerzynaModel({.yield_stress = 0.9 * 0.85e9, .reference_rate = 200.0}, Units{})});
    using namespace quasistatic;
    const Scene scene = fields::scene_on(grid, Model::full, {2e-7, 0.0}, three);
    Field start(grid.cells_y, grid.cells_x);
    for (int j = 0; j < grid.cells_y; ++j)
        for (int i = 0; i < grid.cells_x; ++i)
            start(i, j) = 0.01 * std::sin(i + 2.0 * j) + 0.02;
    State state = fields::initial_state(scene, start);
    REQUIRE(state.cells.count() == 7);
    fields::check_uniform(state.cells.internal[1], 0.25, 0.0); // what the law starts with
    CHECK(field_names(scene) == std::vector<std::string>{"p", "s", "tau", "q", "plastic_strain", "triple_strain", "flow_time"});
    std::mt19937 engine(8);
    fields::fill_smoothly(state.cells.stress.tau, engine, 0.95, 0.2);
    const State before = state;
    CellState next = fields::cells_of(scene);
    VectorField force(grid);
    for (const Predictor predictor : {Predictor::euler, Predictor::substepped, Predictor::incremental}) {
        (void)fields::predict(scene, predictor, state.cells, state.cells, VectorField(grid), 300.0,
                              fields::pointwise(300.0, 1e-9), next, force);
        double flowed = 0.0;
        for (int j = 0; j < grid.cells_y; ++j)
            for (int i = 0; i < grid.cells_x; ++i) {
                const double increment = next.internal[0](i, j) - before.cells.internal[0](i, j);
                flowed = std::max(flowed, increment);
                CHECK(next.internal[1](i, j) - 0.25 == doctest::Approx(3.0 * increment).epsilon(1e-9).scale(1e-9));
                CHECK((next.internal[2](i, j) > 0.0) == (increment > 0.0));
            }
        CHECK(flowed > 1e-4);
    }
    // the norm is the largest of the variables', each by its scale of 0.01
    CellState only = fields::cells_of(scene);
    for (int j = 0; j < grid.cells_y; ++j)
        std::fill_n(only.internal[1].row(j), grid.cells_x, 0.003);
    CHECK(fields::norm(scene, std::array{Space::Term{&only, 2.0}}).internal == doctest::Approx(0.6).epsilon(1e-13));
    CHECK(fields::norm(scene, std::array{Space::Term{&only, 2.0}}).stress == 0.0);
    const Observables seen = fields::observe(scene, state.cells);
    CHECK(seen.largest_internal.size() == 3);
    CHECK(seen.smallest_internal[1] == 0.25);
}

TEST_CASE("three internal variables at particles: sorted, advanced and started with them") {
    using namespace mpm;
    mpm_scenes::Block b = mpm_scenes::block(ShapeFunction::gimp);
    b.scene.materials = {{make_law(
        mpm_scenes::rubber,
        ThreeVariables{PerzynaModel({.yield_stress = 3.0, .hardening_modulus = 20.0, .reference_rate = 0.5}, si_units)})}};
    b.state.particles = {};
    add_body(b.state.particles, {.shape = rectangle(0.2, 0.2, 0.6, 0.6), .density = 10.0}, b.scene);
    REQUIRE(b.state.particles.internal.size() == 3);
    CHECK(b.state.particles.internal[1].front() == 0.25);
    check(b.scene, b.state.particles);
    for (std::size_t p = 0; p < b.state.particles.size(); ++p)
        b.state.particles.velocity_x[p] = 3.0 * b.state.particles.y[p];
    ExplicitStep step(b.scene, Form::momentum);
    for (int n = 0; n < 40; ++n)
        step.advance(b.state, 0.002, b.state.time + 0.002);
    double flowed = 0.0;
    for (std::size_t p = 0; p < b.state.particles.size(); ++p) {
        const auto& internal = b.state.particles.internal;
        CHECK(internal[1][p] - 0.25 == doctest::Approx(3.0 * internal[0][p]).epsilon(1e-12).scale(1e-9));
        CHECK((internal[2][p] > 0.0) == (internal[0][p] > 0.0));
        flowed = std::max(flowed, internal[0][p]);
    }
    CHECK(flowed > 1e-4);
    // a particle without room for what its law keeps is refused
    b.state.particles.internal.pop_back();
    CHECK(contains(message_of<InputError>([&] { check(b.scene, b.state.particles); }), "3 internal variables"));
    CHECK(contains(message_of<InputError>([&] { step.advance(b.state, 0.002, 1.0); }), "3 internal variables"));
}

TEST_SUITE_END();

} // namespace laws_suite
