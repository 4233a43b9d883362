// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/base/threads.hpp>
#include <ductile/material/point_rates.hpp>
#include <ductile/space/space.hpp>
#include <ductile/space/terms.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace ductile {

Space::Space(const Grid& grid, const Medium& medium, RowSpacing rows)
    : grid_(grid), medium_(medium),
      rows_(std::move(rows)), scale_{std::sqrt(3.0), std::sqrt(2.0), std::sqrt(2.0), std::sqrt(6.0)},
      row_sums_(static_cast<std::size_t>(grid.cells_y) * (1 + most_variables)),
      row_powers_(static_cast<std::size_t>(grid.cells_y)), row_counts_(static_cast<std::size_t>(grid.cells_y)) {
    for (const InternalVariable& variable : medium_.law->variables())
        scale_.push_back(1.0 / variable.natural_scale());
}

EnergyFlow Space::sum_of_powers() const {
    EnergyFlow sum;
    for (std::size_t j = 0; j < row_powers_.size(); ++j) {
        sum.dissipation += rows_.weight[j] * row_powers_[j].dissipation;
        sum.transport += rows_.weight[j] * row_powers_[j].transport;
    }
    return grid_.cell_area() * sum;
}

double Space::rates(const CellState& cells, const VectorField& velocity, CellState& rate, VectorField& force) {
    const auto kernel = [&](int j, double transport) {
        const FlowSums flow = medium_.law->add_flow_rates(grid_.cells_x, flow_rows(cells, j), flow_rows(rate, j));
        row_sums_[static_cast<std::size_t>(j)] = flow.relaxation;
        row_powers_[static_cast<std::size_t>(j)] = {flow.dissipation, transport};
        for (Field* f : {&rate.stress.p, &rate.stress.s, &rate.stress.tau, &rate.stress.q})
            f->wrap_row(j);
    };
    sweep(cells, velocity, false, rate, kernel, -1.0, force);
    double relaxation = 0.0;
    for (int j = 0; j < grid_.cells_y; ++j)
        relaxation = std::max(relaxation, row_sums_[static_cast<std::size_t>(j)]);
    rate.energy = sum_of_powers();
    return relaxation;
}

void Space::transport(CellState& cells, const VectorField& velocity, CellState& rate, VectorField& room) {
    if (medium_.transported)
        prepare_transport(cells);
    sweep(
        cells, velocity, false, rate, [&](int j, double) { rate.wrap_row(j); }, 0.0, room);
    rate.wall = {};
    rate.energy = {};
}

Rk21Counts Space::predict(Predictor predictor, const CellState& now, CellState& transported, const VectorField& velocity,
                          double dt, const Rk21Options& options, CellState& next, VectorField& force) {
    if (medium_.transported)
        prepare_transport(transported);
    const auto kernel = [&](int j, double transport) {
        Rk21Counts& counts = row_counts_[static_cast<std::size_t>(j)];
        counts = {};
        const double* const p = now.stress.p.row(j);
        double* const p_next = next.stress.p.row(j);
        for (int i = 0; i < grid_.cells_x; i += pack_size)
            store(load(p + i) + Pack(dt) * load(p_next + i), p_next + i);
        const double dissipated =
            predictor == Predictor::euler
                ? medium_.law->flow_by_euler(grid_.cells_x, flow_rows(now, j), flow_rows(next, j), dt)
                : medium_.law->flow_by_substeps(grid_.cells_x, flow_rows(now, j), flow_rows(next, j), dt, options, counts);
        row_powers_[static_cast<std::size_t>(j)] = {dissipated, dt * transport};
        next.wrap_row(j);
    };
    sweep(transported, velocity, predictor == Predictor::incremental, next, kernel, -1.0 / dt, force);
    next.energy = now.energy + sum_of_powers();
    Rk21Counts total;
    for (const Rk21Counts& counts : row_counts_)
        total.add(counts);
    return total;
}

void Space::plastic_rate(const CellState& cells, CellState& rate) {
    for_each_row({grid_.cells_y, grid_.cells_x}, [&](int j) {
        for (int k = 0; k < rate.count(); ++k)
            std::fill_n(rate.field(k).row(j), grid_.cells_x, 0.0);
        const FlowSums flow = medium_.law->add_flow_rates(grid_.cells_x, flow_rows(cells, j), flow_rows(rate, j));
        row_powers_[static_cast<std::size_t>(j)] = {.dissipation = flow.dissipation};
        rate.wrap_row(j);
    });
    rate.wall = {};
    rate.energy = sum_of_powers();
}

void Space::plastic_strain_rate(const CellState& cells, Field& rate) const {
    constexpr int chunk = 8 * row_unit;
    const Pack factor(std::numbers::inv_sqrt3 / medium_.law->elasticity().shear_modulus);
    for_each_row({grid_.cells_y, grid_.cells_x}, [&](int j) {
        std::array<std::array<double, chunk>, 3 + most_variables> flow; // of -2 mu D^pl, whose magnitude is sqrt(2) times this
        FlowRows<double*> rows{};
        std::ranges::transform(flow, rows.row.begin(), [](auto& row) { return row.data(); });
        for (int first = 0; first < grid_.cells_x; first += chunk) {
            const int count = std::min(chunk, grid_.cells_x - first);
            for (auto& row : flow)
                row.fill(0.0);
            (void)medium_.law->add_flow_rates(count, flow_rows(cells, j, first), rows);
            for (int i = 0; i < count; i += pack_size)
                store(factor * square_root(deviatoric_square(std::array{load(&flow[0][static_cast<std::size_t>(i)]),
                                                                        load(&flow[1][static_cast<std::size_t>(i)]),
                                                                        load(&flow[2][static_cast<std::size_t>(i)])})),
                      rate.row(j) + first + i);
        }
    });
}

Rk21Counts Space::relax(CellState& sources, double duration, const Rk21Options& options, CellState& cells) {
    for_each_row({grid_.cells_y, grid_.cells_x}, [&](int j) {
        Rk21Counts& counts = row_counts_[static_cast<std::size_t>(j)];
        counts = {};
        for (int i = 0; i < grid_.cells_x; i += pack_size) {
            double* const p = sources.stress.p.row(j) + i;
            store(load(cells.stress.p.row(j) + i) + Pack(duration) * load(p), p);
        }
        row_powers_[static_cast<std::size_t>(j)] = {
            .dissipation = medium_.law->flow_by_substeps(grid_.cells_x, flow_rows(cells, j), flow_rows(sources, j), duration,
                                                         options, counts)};
        sources.wrap_row(j);
    });
    Rk21Counts total;
    for (const Rk21Counts& counts : row_counts_)
        total.add(counts);
    sources.wall = cells.wall + duration * sources.wall;
    sources.energy = cells.energy + duration * sources.energy + sum_of_powers();
    std::swap(cells, sources);
    return total;
}

void Space::combine(std::span<const Term> terms, CellState& out) const {
    for_each_row({grid_.cells_y, grid_.cells_x}, [&](int j) { combine_row(terms, 0, j, out); });
    combine_numbers(terms, out);
}

CombinationNorm Space::norm(std::span<const Term> terms) {
    const auto variables = medium_.law->variables();
    for_each_row({grid_.cells_y, grid_.cells_x}, [&](int j) {
        const auto sum_squares = [&](const auto& square_at) __attribute__((DUCTILE_ALWAYS_INLINE)) {
            Pack sum(0.0);
            for (int i = 0; i < grid_.cells_x; i += pack_size) {
                const Pack::Mask real = Pack::counting_from(i) < Pack(static_cast<double>(grid_.cells_x));
                sum = sum + select(real, square_at(i), Pack(0.0));
            }
            return sum_of(sum);
        };
        double* const sums = row_sums_.data() + static_cast<std::size_t>(j) * (1 + most_variables);
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
        double sum = 0.0; // row after row, so that the result does not depend on the number of threads
        for (std::size_t j = 0; j < rows_.weight.size(); ++j)
            sum += rows_.weight[j] * row_sums_[j * (1 + most_variables) + k];
        return std::sqrt(sum / (static_cast<double>(grid_.cells_x) * grid_.cells_y));
    };
    CombinationNorm result{.stress = mean_root(0)};
    for (std::size_t k = 0; k < variables.size(); ++k)
        if (const double internal = mean_root(1 + k) / variables[k].natural_scale(); !(internal <= result.internal))
            result.internal = internal; // NaN is kept
    return result;
}

namespace {

/// Largest (sbar/yield stress)^2 in row j of the state cells + dt rate.
double yield_square(const Grid& grid, const Law& law, const CellState& cells, double dt, const CellState& rate, int j) {
    constexpr int chunk = 4 * row_unit;
    std::array<std::array<double, chunk>, 1 + most_variables> values; // of the internal variables, and the yield stress
    std::array<const double*, most_variables> internal;
    double* const yield = values.back().data();
    Pack square(0.0);
    for (int first = 0; first < grid.cells_x; first += chunk) {
        const int count = std::min(chunk, grid.cells_x - first);
        const auto at = [&](const Field& value, const Field& slope, int i) __attribute__((DUCTILE_ALWAYS_INLINE)) {
            return load(value.row(j) + first + i) + Pack(dt) * load(slope.row(j) + first + i);
        };
        for (std::size_t k = 0; k < cells.internal.size(); ++k) {
            internal[k] = values[k].data();
            for (int i = 0; i < count; i += pack_size)
                store(at(cells.internal[k], rate.internal[k], i), values[k].data() + i);
        }
        law->yield_stress(count, internal.data(), yield);
        for (int i = 0; i < count; i += pack_size) {
            const std::array<Pack, 3> y{at(cells.stress.s, rate.stress.s, i), at(cells.stress.tau, rate.stress.tau, i),
                                        at(cells.stress.q, rate.stress.q, i)};
            const Pack limit = load(yield + i);
            // a law without elastic range is always above yield
            square = maximum(square, select(limit > Pack(0.0), deviatoric_square(y) / (limit * limit),
                                            Pack(std::numeric_limits<double>::infinity())));
        }
    }
    return largest_of(square);
}

} // namespace

double Space::yield_ratio(const CellState& cells, double dt, const CellState& rate) const {
    return std::sqrt(gather_rows(
        Rows{grid_.cells_y, grid_.cells_x}, 0.0,
        [&](int j, double& largest) { largest = std::max(largest, yield_square(grid_, medium_.law, cells, dt, rate, j)); },
        [](double& total, double part) { total = std::max(total, part); }));
}

MeanTraction Space::mean_traction(const StressField& stress) {
    for_each_row({grid_.cells_y, grid_.cells_x}, [&](int j) {
        const double *p = stress.p.row(j), *s = stress.s.row(j), *tau = stress.tau.row(j), *q = stress.q.row(j);
        double shear = 0.0, normal = 0.0;
        for (int i = 0; i < grid_.cells_x; ++i) {
            shear += tau[i];
            normal -= p[i] + s[i] + q[i];
        }
        row_sums_[static_cast<std::size_t>(2 * j)] = shear;
        row_sums_[static_cast<std::size_t>(2 * j + 1)] = normal;
    });
    MeanTraction total;
    for (std::size_t j = 0; j < rows_.weight.size(); ++j) {
        total.shear += rows_.weight[j] * row_sums_[2 * j];
        total.normal += rows_.weight[j] * row_sums_[2 * j + 1];
    }
    const double cells = static_cast<double>(grid_.cells_x) * grid_.cells_y;
    return {total.shear / cells, total.normal / cells};
}

namespace {

struct Extremes {
    double smallest = std::numeric_limits<double>::infinity(), largest = -std::numeric_limits<double>::infinity();
};

struct RowSums {
    double tau = 0.0, yy = 0.0, magnitude = 0.0, largest = 0.0, energy = 0.0;
    std::array<Extremes, most_variables> internal;
    long long plastic = 0;
};

constexpr int chunk = 8 * row_unit;

RowSums observe_row(const Grid& grid, const Law& law, const CellState& cells, int j) {
    const double *p = cells.stress.p.row(j), *s = cells.stress.s.row(j), *tau = cells.stress.tau.row(j);
    const double* q = cells.stress.q.row(j);
    const Pack columns(static_cast<double>(grid.cells_x));
    const Pack by_bulk_modulus(0.5 / law->elasticity().bulk_modulus), by_shear_modulus(0.5 / law->elasticity().shear_modulus);
    RowSums sums;
    Pack tau_sum(0.0), yy_sum(0.0), magnitude_sum(0.0), largest(0.0), energy_sum(0.0);
    std::array<double, chunk> yield;
    for (int i = 0; i < grid.cells_x; i += pack_size) {
        if (i % chunk == 0)
            law->yield_stress(std::min(chunk, grid.cells_x - i), flow_rows(cells, j, i) + 3, yield.data());
        const Pack::Mask real = Pack::counting_from(i) < columns; // lanes beyond the last column hold copies
        const Pack pi = load(p + i), si = load(s + i), ti = load(tau + i), qi = load(q + i);
        const Pack square = si * si + ti * ti + Pack(3.0) * (qi * qi), sbar = square_root(square);
        energy_sum = energy_sum + select(real, by_bulk_modulus * (pi * pi) + by_shear_modulus * square, Pack(0.0));
        tau_sum = tau_sum + select(real, ti, Pack(0.0));
        yy_sum = yy_sum - select(real, pi + si + qi, Pack(0.0));
        magnitude_sum = magnitude_sum + select(real, sbar, Pack(0.0));
        largest = maximum(largest, sbar);
        sums.plastic += count_of(real && sbar >= load(yield.data() + i % chunk));
    }
    for (std::size_t k = 0; k < cells.internal.size(); ++k) {
        const double* const row = cells.internal[k].row(j);
        Pack low(sums.internal[k].smallest), high(sums.internal[k].largest);
        for (int i = 0; i < grid.cells_x; i += pack_size) {
            low = minimum(low, load(row + i));
            high = maximum(high, load(row + i));
        }
        sums.internal[k] = {smallest_of(low), largest_of(high)};
    }
    sums.tau = sum_of(tau_sum);
    sums.yy = sum_of(yy_sum);
    sums.magnitude = sum_of(magnitude_sum);
    sums.largest = largest_of(largest);
    sums.energy = sum_of(energy_sum);
    return sums;
}

} // namespace

Observables Space::observe(const CellState& cells) const {
    const Grid& grid = grid_;
    std::vector<RowSums> rows(static_cast<std::size_t>(grid.cells_y));
    for_each_row({grid.cells_y, grid.cells_x},
                 [&](int j) { rows[static_cast<std::size_t>(j)] = observe_row(grid, medium_.law, cells, j); });

    // summed row after row, so that the result does not depend on the number of threads
    RowSums total;
    double plastic = 0.0;
    for (std::size_t j = 0; j < rows.size(); ++j) {
        const RowSums& row = rows[j];
        const double weight = rows_.weight[j];
        total.tau += weight * row.tau;
        total.yy += weight * row.yy;
        total.magnitude += weight * row.magnitude;
        total.energy += weight * row.energy;
        plastic += weight * static_cast<double>(row.plastic);
        total.largest = std::max(total.largest, row.largest);
        for (std::size_t k = 0; k < cells.internal.size(); ++k)
            total.internal[k] = {std::min(total.internal[k].smallest, row.internal[k].smallest),
                                 std::max(total.internal[k].largest, row.internal[k].largest)};
    }
    const double cells_total = static_cast<double>(grid.cells_x) * grid.cells_y;
    Observables seen{.wall_traction = total.tau / cells_total,
                     .normal_traction = total.yy / cells_total,
                     .mean_magnitude = total.magnitude / cells_total,
                     .largest_magnitude = total.largest,
                     .plastic_fraction = plastic / cells_total,
                     .elastic_energy = grid.cell_area() * total.energy};
    for (std::size_t k = 0; k < cells.internal.size(); ++k) {
        seen.smallest_internal.push_back(total.internal[k].smallest);
        seen.largest_internal.push_back(total.internal[k].largest);
    }
    return seen;
}

void Space::move_edges(const std::vector<double>& edges, std::span<Field* const> fields) {
    (void)edges;
    (void)fields;
    throw InputError("this space has no edges that may move");
}

Unresolved Space::unresolved(const CellState& cells) const {
    const Unresolved of_tau = unresolved(cells.stress.tau);
    double x = of_tau.x, y = std::max(of_tau.y, of_tau.jump);
    const auto variables = medium_.law->variables();
    for (std::size_t k = 0; k < variables.size(); ++k) {
        const Unresolved here = unresolved(cells.internal[k]);
        x = std::max(x, here.x / variables[k].natural_scale());
        y = std::max(y, std::max(here.y, here.jump) / variables[k].natural_scale());
    }
    return {x, y};
}

Unresolved Space::unresolved_flow(const CellState& cells, double negligible, Field& rate) const {
    plastic_strain_rate(cells, rate);
    rate.wrap();
    const Unresolved found = unresolved(rate);
    const double scale = std::max(found.whole, negligible);
    return {found.x / scale, found.y / scale};
}

double Space::root_mean_of_row_sums() const {
    double sum = 0.0; // row after row, so that the result does not depend on the number of threads
    for (std::size_t j = 0; j < rows_.weight.size(); ++j)
        sum += rows_.weight[j] * row_sums_[j];
    return std::sqrt(sum * grid_.cell_area() / grid_.area());
}

StressComponents<double> Space::wall_rate(const Velocity& upper) const {
    const double half_height = 0.5 * grid_.height;
    return elastic_rate(medium_.law->elasticity(),
                        VelocityGradient<double>{0.0, upper.u / half_height, 0.0, upper.v / half_height});
}

double Space::equilibrium_residual(const StressField& stress, VectorField& force) const {
    divergence(stress, 1.0, force);
    struct Largest {
        double force = 0.0, stress = 0.0;
    };
    const auto visit = [&](int j, Largest& largest) {
        Pack force_here(0.0), stress_here(0.0);
        for (int i = 0; i < grid_.cells_x; i += pack_size) {
            if (j > 0)
                force_here =
                    maximum(force_here, maximum(magnitude(load(force.u.row(j) + i)), magnitude(load(force.v.row(j) + i))));
            const Pack p = load(stress.p.row(j) + i), s = load(stress.s.row(j) + i), tau = load(stress.tau.row(j) + i),
                       q = load(stress.q.row(j) + i);
            stress_here = maximum(maximum(stress_here, magnitude(tau)), maximum(magnitude(s - p - q), magnitude(p + s + q)));
        }
        largest.force = std::max(largest.force, largest_of(force_here));
        largest.stress = std::max(largest.stress, largest_of(stress_here));
    };
    const auto merge = [](Largest& total, const Largest& part) {
        total.force = std::max(total.force, part.force);
        total.stress = std::max(total.stress, part.stress);
    };
    const Largest largest = gather_rows(Rows{grid_.cells_y, grid_.cells_x}, Largest{}, visit, merge);
    return largest.stress > 0.0 ? largest.force / (largest.stress * std::max(grid_.dx(), grid_.dy())) : 0.0;
}

void Space::add_affine(const Velocity& change, VectorField& velocity) const {
    for (int j = 0; j <= grid_.cells_y; ++j) {
        const double y = from_middle(j);
        for (const auto& [field, amplitude] : {std::pair{&velocity.u, change.u}, std::pair{&velocity.v, change.v}}) {
            if (amplitude == 0.0)
                continue;
            double* row = field->row(j);
            for (int i = 0; i < grid_.cells_x; ++i)
                row[i] += amplitude * y;
            field->wrap_row(j);
        }
    }
}

VelocityChange Space::add_affine_and_compare(const Velocity& wall, const VectorField& guess, VectorField& velocity) const {
    const auto visit = [&](int j, VelocityChange& largest) {
        const double y = from_middle(j);
        const double gap = rows_.node[static_cast<std::size_t>(std::min(j + 1, grid_.cells_y))] -
                           rows_.node[static_cast<std::size_t>(std::min(j, grid_.cells_y - 1))];
        const Pack shift_u(wall.u * y), shift_v(wall.v * y), inverse_dx(1.0 / grid_.dx()), inverse_dy(1.0 / (gap * grid_.dy()));
        double *u = velocity.u.row(j), *v = velocity.v.row(j);
        const double *old_u = guess.u.row(j), *old_v = guess.v.row(j);
        Pack change(0.0), rate(0.0);
        for (int i = 0; i < grid_.cells_x; i += pack_size) {
            const Pack new_u = load(u + i) + shift_u, new_v = load(v + i) + shift_v;
            store(new_u, u + i);
            store(new_v, v + i);
            change = maximum(change, maximum(magnitude(new_u - load(old_u + i)), magnitude(new_v - load(old_v + i))));
            rate = maximum(rate, inverse_dx * magnitude(new_u) + inverse_dy * magnitude(new_v));
        }
        velocity.u.wrap_row(j);
        velocity.v.wrap_row(j);
        largest.change = std::max(largest.change, largest_of(change));
        largest.courant_rate = std::max(largest.courant_rate, largest_of(rate));
    };
    return gather_rows(Rows{grid_.cells_y + 1, grid_.cells_x}, VelocityChange{}, visit,
                       [](VelocityChange& total, const VelocityChange& part) {
                           total.change = std::max(total.change, part.change);
                           total.courant_rate = std::max(total.courant_rate, part.courant_rate);
                       });
}

std::size_t Space::interior_size() const {
    return 2 * static_cast<std::size_t>(grid_.cells_x) * static_cast<std::size_t>(grid_.cells_y - 1);
}

void Space::pack_interior(const VectorField& velocity, double factor, std::span<double> values) const {
    auto target = values.begin();
    for (const Field* f : {&velocity.u, &velocity.v})
        for (int j = 1; j < grid_.cells_y; ++j)
            target = std::transform(f->row(j), f->row(j) + grid_.cells_x, target, [=](double x) { return factor * x; });
}

void Space::unpack_interior(std::span<const double> values, double factor, VectorField& velocity) const {
    auto source = values.begin();
    for (Field* f : {&velocity.u, &velocity.v})
        for (int j = 1; j < grid_.cells_y; ++j, source += grid_.cells_x) {
            std::transform(source, source + grid_.cells_x, f->row(j), [=](double x) { return factor * x; });
            f->wrap_row(j);
        }
}

void Space::set_walls(const Velocity& upper, VectorField& velocity) const {
    for (const auto& [row, sign] : {std::pair{0, -1.0}, std::pair{grid_.cells_y, 1.0}})
        for (const auto& [field, value] : {std::pair{&velocity.u, sign * upper.u}, std::pair{&velocity.v, sign * upper.v}}) {
            std::fill_n(field->row(row), grid_.cells_x, value);
            field->wrap_row(row);
        }
}

namespace {

/// action(field, row, scale, values) for every row of every field.
void for_each_packed(auto& cells, auto values, std::span<const double> scale, std::span<const double> weight,
                     const auto& action) {
    const Field& shape = cells.stress.p;
    const auto columns = static_cast<std::size_t>(shape.columns());
    const std::size_t field_size = columns * static_cast<std::size_t>(shape.rows());
    for_each_row({shape.rows(), shape.columns()}, [&](int j) {
        for (std::size_t k = 0; k < scale.size(); ++k)
            action(cells.field(static_cast<int>(k)), j, scale[k] * std::sqrt(weight[static_cast<std::size_t>(j)]),
                   values.subspan(k * field_size + static_cast<std::size_t>(j) * columns, columns));
    });
}

} // namespace

std::size_t Space::packed_size() const {
    return scale_.size() * static_cast<std::size_t>(grid_.cells_x) * static_cast<std::size_t>(grid_.cells_y);
}

void Space::pack(const CellState& cells, std::span<double> values) const {
    for_each_packed(cells, values, scale_, rows_.weight, [](const Field& field, int j, double scale, std::span<double> row) {
        std::transform(field.row(j), field.row(j) + row.size(), row.begin(), [=](double x) { return scale * x; });
    });
}

void Space::unpack(std::span<const double> values, CellState& cells) const {
    for_each_packed(cells, values, scale_, rows_.weight, [](Field& field, int j, double scale, std::span<const double> row) {
        std::ranges::transform(row, field.row(j), [=](double x) { return x / scale; });
        field.wrap_row(j);
    });
}

} // namespace ductile
