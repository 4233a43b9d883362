// SPDX-License-Identifier: GPL-3.0-or-later
// The linear solvers alone: as many iterations as there are different eigenvalues, and the true solution.
#include <ductile/mpm/krylov.hpp>

#include <cmath>
#include <doctest/doctest.h>
#include <random>
#include <vector>

namespace mpm_krylov_suite {

using namespace ductile::mpm;

namespace {

constexpr std::size_t n = 24;
using Vector = std::vector<double>;

Vector random_vector(unsigned seed) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    Vector v(n);
    for (double& x : v)
        x = uniform(engine);
    return v;
}

/// x - 2 h (h.x)/(h.h): a reflection, which is its own inverse.
Vector reflected(std::span<const double> x) {
    static const Vector h = random_vector(9);
    const double along = 2.0 * dot(h, x) / dot(h, h);
    Vector result(x.begin(), x.end());
    for (std::size_t i = 0; i < n; ++i)
        result[i] -= along * h[i];
    return result;
}

/// The symmetric matrix Q diag(values, repeated) Q.
auto matrix(const Vector& values) {
    return [values](std::span<const double> x, std::span<double> result) {
        Vector y = reflected(x);
        for (std::size_t i = 0; i < n; ++i)
            y[i] *= values[i % values.size()];
        y = reflected(y);
        std::copy(y.begin(), y.end(), result.begin());
    };
}

double residual(const LinearMap& a, std::span<const double> b, std::span<const double> s) {
    Vector r(n);
    a(s, r);
    for (std::size_t i = 0; i < n; ++i)
        r[i] = b[i] - r[i];
    return norm(r) / norm(b);
}

} // namespace

TEST_SUITE_BEGIN("mpm_krylov");

TEST_CASE("both solvers need one iteration for each different eigenvalue, and keep their promise before") {
    const Vector values{1.0, 3.0, 7.0, 20.0, 55.0};
    const auto a = matrix(values);
    const Vector b = random_vector(1);
    for (const bool gmres : {true, false}) {
        Krylov krylov;
        const auto solve = [&](double tolerance, int iterations, Vector& s) {
            return gmres ? krylov.gmres(a, {}, b, s, tolerance, iterations)
                         : krylov.conjugate_gradients(a, {}, b, s, tolerance, iterations);
        };
        Vector s(n, 99.0);
        const LinearResult result = solve(1e-10, 50, s);
        CHECK(result.converged);
        CHECK(result.iterations == 5);
        CHECK(residual(a, b, s) < 1e-10);
        const LinearResult early = solve(1e-10, 3, s);
        CHECK_FALSE(early.converged);
        CHECK(early.iterations == 3);
        CHECK(residual(a, b, s) < 1.0);
        const LinearResult rough = solve(0.3, 50, s);
        CHECK(rough.converged);
        CHECK(rough.iterations < 5);
        CHECK(residual(a, b, s) <= 0.3 * (1.0 + 1e-12));
        CHECK(solve(1e-10, 50, s).iterations == 5); // nothing is left of the earlier ones
    }
}

TEST_CASE("preconditioned by a matrix with the same vectors they need one for each different ratio") {
    const auto a = matrix({2.0, 6.0, 10.0, 30.0}), inverse = matrix({1.0, 1.0 / 3.0, 1.0 / 10.0, 1.0 / 30.0}); // ratios 2, 1
    const auto precondition = [&](std::span<double> z) {
        const Vector before(z.begin(), z.end());
        inverse(before, z);
    };
    const Vector b = random_vector(2);
    for (const bool gmres : {true, false}) {
        Krylov krylov;
        Vector s(n);
        const LinearResult result =
            gmres ? krylov.gmres(a, precondition, b, s, 1e-12, 50) : krylov.conjugate_gradients(a, precondition, b, s, 1e-12, 50);
        CHECK(result.converged);
        CHECK(result.iterations == 2);
        CHECK(residual(a, b, s) < 1e-12);
    }
}

TEST_CASE("GMRES solves what is not symmetric; conjugate gradients end where a matrix is not positive definite") {
    const auto skew = [](std::span<const double> x, std::span<double> result) {
        for (std::size_t i = 0; i < n; ++i) // a rotation by 90 degrees in each plane, and a shift
            result[i] = 0.5 * x[i] + (i % 2 == 0 ? -x[i + 1] : x[i - 1]);
    };
    Krylov krylov;
    const Vector b = random_vector(3);
    Vector s(n);
    const LinearResult result = krylov.gmres(skew, {}, b, s, 1e-12, 50);
    CHECK(result.converged);
    CHECK(result.iterations == 2); // 0.5 + i and its conjugate
    CHECK(residual(skew, b, s) < 1e-12);
    const LinearResult refused = krylov.conjugate_gradients(matrix({-1.0, -2.0}), {}, b, s, 1e-12, 50);
    CHECK_FALSE(refused.converged);
    CHECK(refused.iterations == 1);
    CHECK(s == b);
    const Vector zero(n, 0.0);
    CHECK(krylov.gmres(skew, {}, zero, s, 1e-12, 50).iterations == 0);
    CHECK(s == zero);
}

TEST_SUITE_END();

} // namespace mpm_krylov_suite
