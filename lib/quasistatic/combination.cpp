#include <ductile/base/threads.hpp>
#include <ductile/material/point_rates.hpp>
#include <ductile/quasistatic/combination.hpp>

#include <array>
#include <cassert>
#include <cmath>
#include <vector>

namespace ductile::quasistatic {

namespace {

constexpr std::size_t field_count = 5;
constexpr std::size_t most_terms = 10;

template <class Cells> auto fields_of(Cells& cells) {
    auto& [p, s, tau, q] = cells.stress;
    return std::array{&p, &s, &tau, &q, &cells.internal};
}

/// Row pointers of the terms, [field][term].
using TermRows = std::array<std::array<const double*, most_terms>, field_count>;

TermRows rows_of(std::span<const Term> terms, int j) {
    assert(terms.size() <= most_terms);
    TermRows rows{};
    for (std::size_t m = 0; m < terms.size(); ++m) {
        const auto fields = fields_of(*terms[m].fields);
        for (std::size_t k = 0; k < field_count; ++k)
            rows[k][m] = fields[k]->row(j);
    }
    return rows;
}

[[gnu::DUCTILE_ALWAYS_INLINE]] inline Pack sum_terms(std::span<const Term> terms,
                                                     const std::array<const double*, most_terms>& rows, int i) {
    Pack sum(0.0);
    for (std::size_t m = 0; m < terms.size(); ++m)
        sum = sum + Pack(terms[m].factor) * load(rows[m] + i);
    return sum;
}

[[gnu::DUCTILE_ALWAYS_INLINE]] inline std::array<Pack, field_count> elastic_rate_at(const Scene& scene,
                                                                                    const VectorField& velocity, int i, int j) {
    const Corners u(velocity.u.row(j) + i, velocity.u.row(j + 1) + i);
    const Corners v(velocity.v.row(j) + i, velocity.v.row(j + 1) + i);
    const StressComponents<Pack> rate =
        elastic_rate(scene.elasticity, velocity_gradient(u, v, 0.5 / scene.grid.dx(), 0.5 / scene.grid.dy()));
    return {rate.p, rate.s, rate.tau, rate.q, Pack(0.0)};
}

} // namespace

void combine(const Scene& scene, std::span<const Term> terms, const OpenRate& open, CellState& out) {
    for_each_row({scene.grid.cells_y, scene.grid.cells_x}, [&](int j) {
        const TermRows rows = rows_of(terms, j);
        const auto rate = fields_of(*open.fields);
        const auto target = fields_of(out);
        for (int i = 0; i < scene.grid.cells_x; i += pack_size) {
            const auto elastic = elastic_rate_at(scene, *open.velocity, i, j);
            for (std::size_t k = 0; k < field_count; ++k) {
                const Pack closed = load(rate[k]->row(j) + i) + elastic[k];
                const Pack sum = sum_terms(terms, rows[k], i) + Pack(open.factor) * closed;
                if (open.close)
                    store(closed, rate[k]->row(j) + i);
                store(sum, target[k]->row(j) + i);
            }
        }
        for (Field* f : target)
            f->wrap_row(j);
    });
}

void combine(const Scene& scene, std::span<const Term> terms, CellState& out) {
    for_each_row({scene.grid.cells_y, scene.grid.cells_x}, [&](int j) {
        const TermRows rows = rows_of(terms, j);
        const auto target = fields_of(out);
        for (std::size_t k = 0; k < field_count; ++k) {
            for (int i = 0; i < scene.grid.cells_x; i += pack_size)
                store(sum_terms(terms, rows[k], i), target[k]->row(j) + i);
            target[k]->wrap_row(j);
        }
    });
}

void close_rate(const Scene& scene, const VectorField& velocity, CellState& rate) {
    for_each_row({scene.grid.cells_y, scene.grid.cells_x}, [&](int j) {
        const auto fields = fields_of(rate);
        for (int i = 0; i < scene.grid.cells_x; i += pack_size) {
            const auto elastic = elastic_rate_at(scene, velocity, i, j);
            for (std::size_t k = 0; k + 1 < field_count; ++k)
                store(load(fields[k]->row(j) + i) + elastic[k], fields[k]->row(j) + i);
        }
    });
}

CombinationNorm norm(const Scene& scene, std::span<const Term> terms) {
    std::vector<std::array<double, 2>> row_sums(static_cast<std::size_t>(scene.grid.cells_y));
    for_each_row({scene.grid.cells_y, scene.grid.cells_x}, [&](int j) {
        const TermRows rows = rows_of(terms, j);
        Pack stress(0.0), internal(0.0);
        for (int i = 0; i < scene.grid.cells_x; i += pack_size) {
            const Pack p = sum_terms(terms, rows[0], i), s = sum_terms(terms, rows[1], i), tau = sum_terms(terms, rows[2], i);
            const Pack q = sum_terms(terms, rows[3], i), chi = sum_terms(terms, rows[4], i);
            // sigma : sigma = 3 p^2 + 2 s^2 + 2 tau^2 + 6 q^2
            const Pack square = Pack(3.0) * (p * p) + Pack(2.0) * (s * s + tau * tau) + Pack(6.0) * (q * q);
            const Pack::Mask real = Pack::counting_from(i) < Pack(static_cast<double>(scene.grid.cells_x));
            stress = stress + select(real, square, Pack(0.0));
            internal = internal + select(real, chi * chi, Pack(0.0));
        }
        row_sums[static_cast<std::size_t>(j)] = {sum_of(stress), sum_of(internal)};
    });
    double stress = 0.0, internal = 0.0; // row after row, so that the result does not depend on the number of threads
    for (const auto& [s, c] : row_sums) {
        stress += s;
        internal += c;
    }
    const double cells = static_cast<double>(scene.grid.cells_x) * scene.grid.cells_y;
    return {std::sqrt(stress / cells), std::sqrt(internal / cells)};
}

} // namespace ductile::quasistatic
