// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/threads.hpp>
#include <ductile/mpm/krylov.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace ductile::mpm {

namespace {

constexpr std::size_t chunk = 4096;          // numbers that one thread adds up: the same on any number of threads
constexpr std::size_t worth_threads = 30000; // numbers

double dot_of_chunk(std::span<const double> a, std::span<const double> b) {
    double sum[4] = {}; // four sums, in an order of their own: the additions overlap
    const std::size_t whole = a.size() / 4 * 4;
    for (std::size_t i = 0; i < whole; i += 4)
        for (std::size_t k = 0; k < 4; ++k)
            sum[k] += a[i + k] * b[i + k];
    for (std::size_t i = whole; i < a.size(); ++i)
        sum[0] += a[i] * b[i];
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

} // namespace

double dot(std::span<const double> a, std::span<const double> b) {
    const std::size_t chunks = (a.size() + chunk - 1) / chunk;
    if (chunks <= 1)
        return dot_of_chunk(a, b);
    constexpr std::size_t most_parts = 64; // at once
    double sum = 0.0, part[most_parts];
    for (std::size_t done = 0; done < chunks; done += most_parts) {
        const std::size_t parts = std::min(most_parts, chunks - done);
        const auto add_up = [&](std::size_t c) {
            const std::size_t first = (done + c) * chunk, count = std::min(chunk, a.size() - first);
            part[c] = dot_of_chunk(a.subspan(first, count), b.subspan(first, count));
        };
        if (a.size() < worth_threads) {
            for (std::size_t c = 0; c < parts; ++c)
                add_up(c);
        } else {
            for_each_task(static_cast<int>(parts), [&](int c) { add_up(static_cast<std::size_t>(c)); });
        }
        sum = std::accumulate(part, part + parts, sum);
    }
    return sum;
}

double norm(std::span<const double> a) { return std::sqrt(dot(a, a)); }

namespace {

void add(std::span<double> y, double factor, std::span<const double> x) {
    const auto add_range = [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            y[i] += factor * x[i];
    };
    if (y.size() < worth_threads)
        return add_range(0, y.size());
    for_each_task(static_cast<int>((y.size() + chunk - 1) / chunk), [&](int c) {
        const std::size_t begin = static_cast<std::size_t>(c) * chunk;
        add_range(begin, std::min(begin + chunk, y.size()));
    });
}

} // namespace

LinearResult Krylov::conjugate_gradients(const LinearMap& a, const InPlaceMap& precondition, std::span<const double> b,
                                         std::span<double> s, double tolerance, int largest_iterations) {
    const std::size_t n = b.size();
    r_.assign(b.begin(), b.end());
    w_.resize(n);
    std::fill(s.begin(), s.end(), 0.0);
    const auto preconditioned = [&]() -> Vector& {
        if (!precondition)
            return r_;
        z_ = r_;
        precondition(z_);
        return z_;
    };
    const double goal = tolerance * norm(b);
    LinearResult result;
    if (norm(r_) <= goal)
        return {true, 0};
    p_ = preconditioned();
    double rho = dot(r_, p_);
    while (result.iterations < largest_iterations) {
        a(p_, w_);
        ++result.iterations;
        const double curvature = dot(p_, w_);
        if (!(curvature > 0.0)) {
            if (result.iterations == 1)
                std::copy(b.begin(), b.end(), s.begin());
            return result;
        }
        const double alpha = rho / curvature;
        add(s, alpha, p_);
        add(r_, -alpha, w_);
        if (norm(r_) <= goal) {
            result.converged = true;
            return result;
        }
        const Vector& z = preconditioned();
        const double next = dot(r_, z), beta = next / rho;
        rho = next;
        for (std::size_t i = 0; i < n; ++i)
            p_[i] = z[i] + beta * p_[i];
    }
    return result;
}

LinearResult Krylov::gmres(const LinearMap& a, const InPlaceMap& precondition, std::span<const double> b, std::span<double> s,
                           double tolerance, int vectors) {
    const std::size_t n = b.size();
    const auto m = static_cast<std::size_t>(vectors);
    std::fill(s.begin(), s.end(), 0.0);
    const double length = norm(b);
    if (length == 0.0)
        return {true, 0};
    basis_.resize(std::max(basis_.size(), m + 1));
    hessenberg_.assign((m + 1) * m, 0.0);
    rotation_.assign(2 * m, 0.0);
    rhs_.assign(m + 1, 0.0);
    const auto h = [&](std::size_t i, std::size_t k) -> double& { return hessenberg_[i * m + k]; };
    basis_[0].assign(b.begin(), b.end());
    for (double& x : basis_[0])
        x /= length;
    rhs_[0] = length;

    LinearResult result;
    std::size_t k = 0;
    for (; k < m && !result.converged; ++k) {
        ++result.iterations;
        Vector& next = basis_[k + 1];
        next.resize(n);
        if (precondition) {
            z_ = basis_[k];
            precondition(z_);
            a(z_, next);
        } else {
            a(basis_[k], next);
        }
        for (std::size_t i = 0; i <= k; ++i) {
            h(i, k) = dot(next, basis_[i]);
            add(next, -h(i, k), basis_[i]);
        }
        const double rest = norm(next);
        h(k + 1, k) = rest;
        if (rest > 0.0)
            for (double& x : next)
                x /= rest;
        for (std::size_t i = 0; i < k; ++i) {
            const double c = rotation_[2 * i], sine = rotation_[2 * i + 1], upper = h(i, k), lower = h(i + 1, k);
            h(i, k) = c * upper + sine * lower;
            h(i + 1, k) = -sine * upper + c * lower;
        }
        const double radius = std::hypot(h(k, k), h(k + 1, k));
        if (radius == 0.0)
            break; // A has no part left outside what is solved
        rotation_[2 * k] = h(k, k) / radius;
        rotation_[2 * k + 1] = h(k + 1, k) / radius;
        h(k, k) = radius;
        rhs_[k + 1] = -rotation_[2 * k + 1] * rhs_[k];
        rhs_[k] *= rotation_[2 * k];
        result.converged = std::abs(rhs_[k + 1]) <= tolerance * length;
    }
    for (std::size_t i = k; i-- > 0;) {
        for (std::size_t j = i + 1; j < k; ++j)
            rhs_[i] -= h(i, j) * rhs_[j];
        rhs_[i] /= h(i, i);
    }
    for (std::size_t i = 0; i < k; ++i)
        add(s, rhs_[i], basis_[i]);
    if (precondition)
        precondition(s);
    return result;
}

} // namespace ductile::mpm
