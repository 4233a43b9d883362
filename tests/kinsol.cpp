// SPDX-License-Identifier: GPL-3.0-or-later
// SUNDIALS' KINSOL behind its wrapper: solutions, counts, failures in words, exceptions.
#include "messages.hpp"

#include <ductile/sundials/kinsol.hpp>

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace kinsol_suite {

using namespace ductile;
using namespace ductile::sundials;

namespace {

/// A chain of 40 unknowns with cubic springs between them and to the ground, loaded at its end: F = A u + u^3 - b.
struct Chain {
    static constexpr std::size_t size = 40;
    std::vector<double> at = std::vector<double>(size); ///< where it is linearised
    int linearisations = 0;

    static double load(std::size_t i) { return i == size - 1 ? 3.0 : 0.1; }
    static double stiffness_times(std::span<const double> u, std::size_t i) {
        return 2.5 * u[i] - (i > 0 ? u[i - 1] : 0.0) - (i + 1 < size ? u[i + 1] : 0.0);
    }
    void residual(std::span<const double> u, std::span<double> f) const {
        for (std::size_t i = 0; i < size; ++i)
            f[i] = stiffness_times(u, i) + u[i] * u[i] * u[i] - load(i);
    }
    void linearise(std::span<const double> u) {
        at.assign(u.begin(), u.end());
        ++linearisations;
    }
    void times(std::span<const double> s, std::span<double> js) const {
        for (std::size_t i = 0; i < size; ++i)
            js[i] = stiffness_times(s, i) + 3.0 * at[i] * at[i] * s[i];
    }
    void precondition(std::span<double> z) const {
        for (std::size_t i = 0; i < size; ++i)
            z[i] /= 2.5 + 3.0 * at[i] * at[i];
    }

    KinsolSystem system(bool products, bool preconditioned) {
        KinsolSystem s{
            .size = size, .residual = [this](auto u, auto f) { residual(u, f); }, .linearise = [this](auto u) { linearise(u); }};
        if (products)
            s.jacobian_times = [this](auto x, auto result) { times(x, result); };
        if (preconditioned)
            s.precondition = [this](auto z) { precondition(z); };
        return s;
    }
};

double largest(std::span<const double> values) {
    double m = 0.0;
    for (const double v : values)
        m = std::max(m, std::abs(v));
    return m;
}

} // namespace

TEST_SUITE_BEGIN("kinsol");

TEST_CASE("every linear solver finds the root, with products or difference quotients, preconditioned or not") {
    for (const KrylovSolver linear :
         {KrylovSolver::gmres, KrylovSolver::flexible_gmres, KrylovSolver::bicgstab, KrylovSolver::conjugate_gradients})
        for (const bool products : {true, false})
            for (const bool preconditioned : {true, false})
                for (const bool forcing : {true, false}) {
                    CAPTURE(static_cast<int>(linear));
                    CAPTURE(products);
                    CAPTURE(preconditioned);
                    Chain chain;
                    KinsolSolver solver({.linear = linear, .eisenstat_walker = forcing, .linear_tolerance = 1e-3});
                    std::vector<double> u(Chain::size, 0.0), f(Chain::size);
                    const KinsolResult result = solver.solve(chain.system(products, preconditioned), u, 1e-9, 1.0);
                    CAPTURE(result.failure);
                    CHECK(result.converged);
                    chain.residual(u, f);
                    CHECK(largest(f) <= 1e-9);
                    CHECK(result.counts.iterations >= 3);
                    CHECK(result.counts.linear_iterations >= result.counts.iterations);
                    CHECK((result.counts.jacobian_products > 0) == products);
                    // linearised once an iterate, whoever asks first
                    if (products || preconditioned)
                        CHECK(chain.linearisations <= result.counts.iterations + 1);
                }
}

TEST_CASE("a second solve with the same solver starts afresh: same numbers, same bits") {
    Chain chain;
    KinsolSolver solver({});
    std::vector<double> first(Chain::size, 0.0), second(Chain::size, 0.0);
    const KinsolResult a = solver.solve(chain.system(true, true), first, 1e-9, 1.0);
    const KinsolResult b = solver.solve(chain.system(true, true), second, 1e-9, 1.0);
    CHECK(first == second);
    CHECK(a.counts.iterations == b.counts.iterations);
    CHECK(a.counts.linear_iterations == b.counts.linear_iterations);
}

TEST_CASE("failures are told in words with what was tried") {
    Chain chain;
    std::vector<double> u(Chain::size, 0.0);
    KinsolSolver impatient({.largest_iterations = 1});
    const KinsolResult result = impatient.solve(chain.system(true, false), u, 1e-12, 1.0);
    CHECK_FALSE(result.converged);
    CHECK(contains(result.failure, "too many Newton iterations"));
    CHECK(contains(result.failure, "after 1 Newton"));

    // no root: u^2 + 1
    const KinsolSystem rootless{
        .size = 1, .residual = [](auto x, auto f) { f[0] = x[0] * x[0] + 1.0; }, .linearise = [](auto) {}};
    std::vector<double> x{0.7};
    KinsolSolver solver({});
    const KinsolResult none = solver.solve(rootless, x, 1e-9, 1.0);
    CHECK_FALSE(none.converged);
    CHECK_FALSE(none.failure.empty());

    const KinsolSystem infinite{
        .size = 1, .residual = [](auto, auto f) { f[0] = std::numeric_limits<double>::infinity(); }, .linearise = [](auto) {}};
    CHECK(contains(solver.solve(infinite, x, 1e-9, 1.0).failure, "the residual is not finite"));
}

TEST_CASE("exceptions of the functions come out; a guess of the wrong size is refused") {
    KinsolSolver solver({});
    std::vector<double> u{1.0, 2.0};
    const KinsolSystem throwing{
        .size = 2, .residual = [](auto, auto) { throw RunError("no residual today"); }, .linearise = [](auto) {}};
    CHECK(message_of<RunError>([&] { (void)solver.solve(throwing, u, 1e-9, 1.0); }) == "no residual today");
    const KinsolSystem three{.size = 3, .residual = [](auto, auto) {}, .linearise = [](auto) {}};
    CHECK(contains(message_of<InputError>([&] { (void)solver.solve(three, u, 1e-9, 1.0); }), "a guess of 2 components"));
}

TEST_SUITE_END();

} // namespace kinsol_suite
