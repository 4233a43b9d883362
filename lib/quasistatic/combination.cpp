#include <ductile/base/threads.hpp>
#include <ductile/material/point_rates.hpp>
#include <ductile/quasistatic/combination.hpp>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>
#include <vector>

namespace ductile::quasistatic {

namespace {

constexpr std::size_t most_terms = 10;

[[gnu::DUCTILE_ALWAYS_INLINE]] inline Pack sum_terms(std::span<const Term> terms,
                                                     const std::array<const double*, most_terms>& rows, int i) {
    Pack sum(0.0);
    for (std::size_t m = 0; m < terms.size(); ++m)
        sum = sum + Pack(terms[m].factor) * load(rows[m] + i);
    return sum;
}

/// Row j of one field of the terms.
std::array<const double*, most_terms> rows_of(std::span<const Term> terms, int field, int j) {
    assert(terms.size() <= most_terms);
    std::array<const double*, most_terms> rows{};
    for (std::size_t m = 0; m < terms.size(); ++m)
        rows[m] = terms[m].vector->field(field).row(j);
    return rows;
}

constexpr int stress_fields = 4;

/// Those of all stress components.
std::array<std::array<const double*, most_terms>, stress_fields> stress_rows_of(std::span<const Term> terms, int j) {
    return {rows_of(terms, 0, j), rows_of(terms, 1, j), rows_of(terms, 2, j), rows_of(terms, 3, j)};
}

[[gnu::DUCTILE_ALWAYS_INLINE]] inline std::array<Pack, stress_fields> elastic_rate_at(const Scene& scene,
                                                                                      const VectorField& velocity, int i, int j) {
    const Corners u(velocity.u.row(j) + i, velocity.u.row(j + 1) + i);
    const Corners v(velocity.v.row(j) + i, velocity.v.row(j + 1) + i);
    const StressComponents<Pack> rate =
        elastic_rate(scene.law->elasticity(), velocity_gradient(u, v, 0.5 / scene.grid.dx(), 0.5 / scene.grid.dy()));
    return {rate.p, rate.s, rate.tau, rate.q};
}

Velocity sum_walls(std::span<const Term> terms) {
    Velocity sum;
    for (const Term& term : terms)
        sum = sum + term.factor * term.vector->wall;
    return sum;
}

/// Row j of `out` from the field number `first` on.
void combine_row(const Scene& scene, std::span<const Term> terms, int first, int j, CellState& out) {
    for (int k = first; k < out.count(); ++k) {
        const auto rows = rows_of(terms, k, j);
        double* const target = out.field(k).row(j);
        for (int i = 0; i < scene.grid.cells_x; i += pack_size)
            store(sum_terms(terms, rows, i), target + i);
    }
    out.wrap_row(j);
}

/// The motion of walls under force control as the stress that it would make; the error of a traction that is held is zero, and
/// the walls have it.
double wall_measure(const Scene& scene, const Velocity& wall) {
    const auto strain = [&](const WallControl& control, double motion) {
        return control.by == WallControl::By::traction ? motion / (0.5 * scene.grid.height) : 0.0;
    };
    const double shear = strain(scene.walls.shear, wall.u), stretch = strain(scene.walls.opening, wall.v);
    const IsotropicElasticity& c = scene.law->elasticity();
    return std::hypot(std::numbers::sqrt2 * c.shear_modulus * shear, c.alpha() * stretch);
}

} // namespace

void combine(const Scene& scene, std::span<const Term> terms, const OpenRate& open, CellState& out) {
    for_each_row({scene.grid.cells_y, scene.grid.cells_x}, [&](int j) {
        const auto rows = stress_rows_of(terms, j);
        std::array<double*, stress_fields> rate, target;
        for (int k = 0; k < stress_fields; ++k) {
            rate[static_cast<std::size_t>(k)] = open.fields->field(k).row(j);
            target[static_cast<std::size_t>(k)] = out.field(k).row(j);
        }
        for (int i = 0; i < scene.grid.cells_x; i += pack_size) {
            const auto elastic = elastic_rate_at(scene, *open.velocity, i, j);
            for (std::size_t k = 0; k < stress_fields; ++k) {
                const Pack closed = load(rate[k] + i) + elastic[k];
                const Pack sum = sum_terms(terms, rows[k], i) + Pack(open.factor) * closed;
                if (open.close)
                    store(closed, rate[k] + i);
                store(sum, target[k] + i);
            }
        }
        std::array<Term, most_terms> all;
        std::ranges::copy(terms, all.begin());
        all[terms.size()] = {open.fields, open.factor}; // the rates of internal variables are complete
        combine_row(scene, std::span(all).first(terms.size() + 1), stress_fields, j, out);
    });
    out.wall = sum_walls(terms) + open.factor * open.fields->wall;
}

void combine(const Scene& scene, std::span<const Term> terms, CellState& out) {
    for_each_row({scene.grid.cells_y, scene.grid.cells_x}, [&](int j) { combine_row(scene, terms, 0, j, out); });
    out.wall = sum_walls(terms);
}

void close_rate(const Scene& scene, const VectorField& velocity, CellState& rate) {
    for_each_row({scene.grid.cells_y, scene.grid.cells_x}, [&](int j) {
        for (int i = 0; i < scene.grid.cells_x; i += pack_size) {
            const auto elastic = elastic_rate_at(scene, velocity, i, j);
            for (int k = 0; k < stress_fields; ++k) {
                double* const row = rate.field(k).row(j) + i;
                store(load(row) + elastic[static_cast<std::size_t>(k)], row);
            }
        }
    });
}

CombinationNorm norm(const Scene& scene, std::span<const Term> terms) {
    const auto variables = scene.law->variables();
    // row after row, so that the result does not depend on the number of threads
    std::vector<std::array<double, 1 + most_variables>> row_sums(static_cast<std::size_t>(scene.grid.cells_y));
    for_each_row({scene.grid.cells_y, scene.grid.cells_x}, [&](int j) {
        const auto sum_squares = [&](const auto& square_at) __attribute__((DUCTILE_ALWAYS_INLINE)) {
            Pack sum(0.0);
            for (int i = 0; i < scene.grid.cells_x; i += pack_size) {
                const Pack::Mask real = Pack::counting_from(i) < Pack(static_cast<double>(scene.grid.cells_x));
                sum = sum + select(real, square_at(i), Pack(0.0));
            }
            return sum_of(sum);
        };
        auto& sums = row_sums[static_cast<std::size_t>(j)];
        const auto rows = stress_rows_of(terms, j);
        sums[0] = sum_squares([&](int i) __attribute__((DUCTILE_ALWAYS_INLINE)) {
            const Pack p = sum_terms(terms, rows[0], i), s = sum_terms(terms, rows[1], i);
            const Pack tau = sum_terms(terms, rows[2], i), q = sum_terms(terms, rows[3], i);
            // sigma : sigma = 3 p^2 + 2 s^2 + 2 tau^2 + 6 q^2
            return Pack(3.0) * (p * p) + Pack(2.0) * (s * s + tau * tau) + Pack(6.0) * (q * q);
        });
        for (std::size_t k = 0; k < variables.size(); ++k) {
            const auto row = rows_of(terms, stress_fields + static_cast<int>(k), j);
            sums[1 + k] = sum_squares([&](int i) __attribute__((DUCTILE_ALWAYS_INLINE)) {
                const Pack x = sum_terms(terms, row, i);
                return x * x;
            });
        }
    });
    const auto mean_root = [&](std::size_t k) {
        double sum = 0.0;
        for (const auto& sums : row_sums)
            sum += sums[k];
        return std::sqrt(sum / (static_cast<double>(scene.grid.cells_x) * scene.grid.cells_y));
    };
    CombinationNorm result{.stress = std::max(mean_root(0), wall_measure(scene, sum_walls(terms)))};
    for (std::size_t k = 0; k < variables.size(); ++k)
        if (const double internal = mean_root(1 + k) / variables[k].natural_scale(); !(internal <= result.internal))
            result.internal = internal; // NaN is kept
    return result;
}

} // namespace ductile::quasistatic
