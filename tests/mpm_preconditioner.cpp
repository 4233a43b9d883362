// SPDX-License-Identifier: GPL-3.0-or-later
// What the preconditioners are made of: assembled matrices against products, factorised tangents against the Jacobian.
#include "mpm_scenes.hpp"

#include <ductile/material/von_mises.hpp>
#include <ductile/mpm/momentum_balance.hpp>
#include <ductile/mpm/preconditioner.hpp>
#include <ductile/mpm/stencil_matrix.hpp>

namespace mpm_preconditioner_suite {

using namespace mpm_scenes;

namespace {

struct Dense {
    std::size_t size;
    std::vector<double> value = std::vector<double>(size * size, 0.0);

    double& operator()(std::size_t row, std::size_t column) { return value[row * size + column]; }
};

/// Sums blocks into a matrix with so many components a node.
AddBlock into(Dense& sum, std::size_t components) {
    return [&sum, components](std::span<const std::int32_t> nodes, std::span<const double> matrix) {
        const std::size_t side = nodes.size() * components;
        const auto place = [&](std::size_t n) {
            return static_cast<std::size_t>(nodes[n / components]) * components + n % components;
        };
        for (std::size_t r = 0; r < side; ++r)
            for (std::size_t c = 0; c < side; ++c)
                sum(place(r), place(c)) += matrix[r * side + c];
    };
}

double length(std::span<const double> v) { return std::sqrt(dot(v, v)); }

/// |P^-1 J x - x|/|x| for a random x, with a preconditioner of the prepared step.
double error_of_inverse(MomentumBalance& balance, Preconditioner& preconditioner) {
    balance.linearise(balance.initial_guess());
    preconditioner.begin_step();
    preconditioner.update(balance);
    std::vector<double> x = random_vector(balance.size(), 1.0, 8), jx(x.size()), error(x.size());
    for (std::size_t c = 0; c < x.size(); ++c)
        x[c] = balance.nodes().prescribed[c] ? 0.0 : x[c] * balance.nodes().mass[c / 2];
    balance.jacobian_times(x, jx);
    preconditioner.apply(jx);
    for (std::size_t c = 0; c < x.size(); ++c)
        error[c] = jx[c] - x[c];
    return length(error) / length(x);
}

/// The stiffness, summed block by block, and what the preconditioners keep of it: its symmetric part, from the diagonal blocks
/// down.
Dense check_kept_stiffness(const MomentumBalance& balance) {
    const Discretisation& d = balance.discretisation();
    const std::size_t size = balance.size();
    Dense stiffness{size}, kept{size};
    d.stiffness_blocks(into(stiffness, 2));
    StencilMatrix stencil(balance.nodes(), d.reach(), 2);
    d.stiffness_blocks([&](auto nodes, auto matrix) { stencil.add(nodes, matrix); });
    for (std::size_t l = 0; l < size / 2; ++l) {
        std::int32_t last = -1;
        stencil.for_each_below(static_cast<std::int32_t>(l), [&](std::int32_t k, std::span<const double> block) {
            CHECK(k > last);
            last = k;
            for (std::size_t r = 0; r < 2; ++r)
                for (std::size_t c = 0; c < 2; ++c)
                    kept(2 * static_cast<std::size_t>(k) + r, 2 * l + c) = block[2 * r + c];
        });
    }
    double largest = 0.0, worst = 0.0;
    for (std::size_t r = 0; r < size; ++r)
        for (std::size_t c = 0; c <= r; ++c) {
            const double symmetric = 0.5 * (stiffness(r, c) + stiffness(c, r));
            largest = std::max(largest, std::abs(symmetric));
            worst = std::max(worst, std::abs(kept(r, c) - symmetric));
        }
    CHECK(worst <= 1e-13 * largest);
    return stiffness;
}

} // namespace

TEST_SUITE_BEGIN("mpm_preconditioner");

TEST_CASE("the assembled matrices and the diagonal are those of the products") {
    for (const ShapeFunction shape : all_shapes)
        for (const Geometry geometry : all_geometries) {
            CAPTURE(static_cast<int>(shape));
            CAPTURE(static_cast<int>(geometry));
            Block b = strained_block(shape, geometry, "Drucker-Prager");
            MomentumBalance balance(b.scene, {});
            balance.prepare(b.state, 0.1);
            balance.linearise(balance.initial_guess());
            const Discretisation& d = balance.discretisation();
            const std::size_t size = balance.size();
            const std::vector<double> x = random_vector(size, 1.0, 5);
            Dense stiffness = check_kept_stiffness(balance), mass{size / 2};
            d.consistent_mass_blocks(b.state.particles, into(mass, 1));
            std::vector<double> kx(size), diagonal(size), mx(size);
            d.stiffness_times(x, kx);
            d.stiffness_diagonal(diagonal);
            d.consistent_mass_times(b.state.particles, x, mx);
            for (std::size_t r = 0; r < size; ++r) {
                double by_stiffness = 0.0, by_mass = 0.0;
                for (std::size_t c = 0; c < size; ++c)
                    by_stiffness += stiffness(r, c) * x[c];
                for (std::size_t n = 0; n < size / 2; ++n)
                    by_mass += mass(r / 2, n) * x[2 * n + r % 2];
                CHECK(by_stiffness == doctest::Approx(kx[r]).epsilon(1e-9).scale(length(kx)));
                CHECK(by_mass == doctest::Approx(mx[r]).epsilon(1e-9).scale(length(mx)));
                CHECK(stiffness(r, r) == doctest::Approx(diagonal[r]).epsilon(1e-9));
            }
        }
}

TEST_CASE("also on the smallest grid, and where one node stands in for others without mass") {
    for (const ShapeFunction shape : all_shapes) {
        CAPTURE(static_cast<int>(shape));
        Scene scene{.grid = {3, 3, 0.3, 0.3, 0.0, 0.0, {}}, .shape = shape, .materials = {{law_named("elastic")}}};
        State state;
        add_body(state.particles, {.shape = rectangle(0.0, 0.0, 0.1, 0.3), .density = 10.0, .particles_per_side = 2}, scene);
        for (double& x : state.particles.x)
            x = 1e-15; // on the edge of the grid: next to nothing of them reaches the nodes inside
        MomentumBalance balance(scene, {});
        balance.prepare(state, 0.1);
        const auto columns = static_cast<std::size_t>(balance.nodes().lattice_width);
        CHECK(balance.nodes().count() * columns == balance.nodes().lattice_width * balance.nodes().lattice_height);
        balance.linearise(balance.initial_guess());
        check_kept_stiffness(balance);
    }
}

TEST_CASE("also where sides are periodic, down to the narrowest grid, and the factorised tangent is the inverse there") {
    for (const ShapeFunction shape : all_shapes)
        for (const int cells : {shape == ShapeFunction::linear ? 3 : 5, 7}) {
            CAPTURE(static_cast<int>(shape));
            CAPTURE(cells);
            Scene scene{.grid = {cells, 5, 0.1 * cells, 0.5, 0.0, 0.0, {SideCondition::periodic, SideCondition::periodic}},
                        .shape = shape,
                        .materials = {{law_named("elastic")}},
                        .finite_rotation = false};
            State state;
            add_body(state.particles, {.shape = rectangle(0.0, 0.0, 0.1 * cells, 0.5), .density = 10.0}, scene);
            shake(state.particles, 0.01);
            MomentumBalance balance(scene, {.form = Form::momentum});
            balance.prepare(state, 0.1);
            Preconditioner preconditioner(PreconditionerKind::tangent);
            CHECK(error_of_inverse(balance, preconditioner) <= 1e-3);
            Dense stiffness = check_kept_stiffness(balance);
            std::vector<double> x = random_vector(balance.size(), 1.0, 5), kx(x.size());
            balance.discretisation().stiffness_times(x, kx);
            for (std::size_t r = 0; r < x.size(); ++r) {
                double product = 0.0;
                for (std::size_t c = 0; c < x.size(); ++c)
                    product += stiffness(r, c) * x[c];
                CHECK(product == doctest::Approx(kx[r]).epsilon(1e-9).scale(length(kx)));
            }
        }
}

TEST_CASE("the factorised tangent is the inverse of the Jacobian in either form, also where M_c is singular") {
    for (const Form form : {Form::velocity, Form::momentum})
        for (const ShapeFunction shape : all_shapes)
            for (const int per_side : {1, 2}) { // one particle a cell: M_c has fewer ranks than nodes
                CAPTURE(static_cast<int>(form));
                CAPTURE(static_cast<int>(shape));
                CAPTURE(per_side);
                Block b = block(shape, Geometry::axisymmetric, "elastic", per_side);
                b.scene.finite_rotation = false;
                b.scene.grid.sides.right = SideCondition::fixed;
                for (double& x : b.state.particles.x)
                    x += 0.2; // onto the wall
                MomentumBalance balance(b.scene, {.form = form});
                Preconditioner preconditioner(PreconditionerKind::tangent);
                for (const double dt : {10.0, 0.01}) { // the second keeps the order of elimination
                    CAPTURE(dt);
                    balance.prepare(b.state, dt);
                    CHECK(error_of_inverse(balance, preconditioner) <= 1e-3);
                }
                b.state.rigid_bodies.push_back(make_rigid_body("plate", rectangle(0.3, 0.6, 0.8, 0.7), 2, b.scene.grid));
                balance.prepare(b.state, 0.01); // other components are prescribed now
                CHECK(error_of_inverse(balance, preconditioner) <= 1e-3);
            }
}

TEST_CASE("where the tangent is indefinite its diagonal steps in, and only there") {
    Block b = block(ShapeFunction::linear);
    // softening from the first yield on: 2 mu of the 3 mu that a step bears
    b.scene.materials = {
        {von_mises_law(rubber, {.yield_stress = 6.0, .limit_strain = 0.0, .softening = 2.0 * rubber.shear_modulus})}};
    b.state.particles.provide_internal(1);
    b.scene.grid.sides.bottom = SideCondition::fixed;
    for (double& y : b.state.particles.y)
        y -= 0.2;
    const Block at_rest = b;
    for (double& stress : b.state.particles.stress_xy)
        stress = 6.0; // far over yield
    MomentumBalance balance(b.scene, {.method = ImplicitMethod::quasi_static});
    Preconditioner tangent(PreconditionerKind::tangent), diagonal(PreconditionerKind::diagonal);
    balance.prepare(b.state, 1.0);
    balance.linearise(balance.initial_guess());
    std::vector<double> x = random_vector(balance.size(), 1.0, 6), y = x;
    for (auto* preconditioner : {&tangent, &diagonal}) {
        preconditioner->begin_step();
        preconditioner->update(balance);
    }
    tangent.apply(x);
    diagonal.apply(y);
    CHECK(x == y);
    State elastic = at_rest.state;
    balance.prepare(elastic, 1.0);
    CHECK(error_of_inverse(balance, tangent) <= 1e-6);
}

TEST_SUITE_END();

} // namespace mpm_preconditioner_suite
