#include <ductile/base/error.hpp>
#include <ductile/base/simd.hpp>
#include <ductile/base/threads.hpp>
#include <ductile/quasistatic/scene.hpp>
#include <ductile/space/transport.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace ductile::quasistatic {

CellState::CellState(const Grid& grid, std::size_t variables) : internal(variables) {
    for (int k = 0; k < count(); ++k)
        field(k) = Field(grid.cells_y, grid.cells_x, 2);
}

std::vector<std::string> field_names(const Scene& scene) {
    std::vector<std::string> names{"p", "s", "tau", "q"};
    for (const InternalVariable& variable : scene.law->variables())
        names.emplace_back(variable.name);
    return names;
}

void extrapolate_to_ghost_rows(CellState& cells) {
    for (int k = 0; k < cells.count(); ++k)
        ductile::extrapolate_to_ghost_rows(cells.field(k));
}

namespace {

template <class Pointer> FlowRows<Pointer> rows_of(auto& cells, int j, int i) {
    FlowRows<Pointer> rows{};
    for (int k = 1; k < cells.count(); ++k)
        rows.row[static_cast<std::size_t>(k - 1)] = cells.field(k).row(j) + i;
    return rows;
}

} // namespace

FlowRows<double*> flow_rows(CellState& cells, int j, int i) { return rows_of<double*>(cells, j, i); }
FlowRows<const double*> flow_rows(const CellState& cells, int j, int i) { return rows_of<const double*>(cells, j, i); }

void extrapolate(const VectorField& older, const VectorField& newer, double weight, VectorField& target) {
    for_each_row({target.u.rows(), target.u.columns()}, [&](int j) {
        for (const auto component : {&VectorField::u, &VectorField::v}) {
            const double *a = (older.*component).row(j), *b = (newer.*component).row(j);
            double* row = (target.*component).row(j);
            for (int i = -2; i < target.u.padded_columns() + 3; ++i)
                row[i] = b[i] + weight * (b[i] - a[i]);
        }
    });
}

void add_affine_velocity(const Grid& grid, const WallVelocity& change, VectorField& velocity) {
    for (int j = 0; j <= grid.cells_y; ++j) {
        const double y = static_cast<double>(2 * j - grid.cells_y) / grid.cells_y;
        for (const auto& [field, amplitude] : {std::pair{&velocity.u, change.u}, std::pair{&velocity.v, change.v}}) {
            if (amplitude == 0.0)
                continue;
            double* row = field->row(j);
            for (int i = 0; i < grid.cells_x; ++i)
                row[i] += amplitude * y;
            field->wrap_row(j);
        }
    }
}

namespace {

struct Extremes {
    double smallest = std::numeric_limits<double>::infinity(), largest = -std::numeric_limits<double>::infinity();
};

struct RowSums {
    double tau = 0.0, yy = 0.0, magnitude = 0.0, largest = 0.0;
    std::array<Extremes, most_variables> internal;
    long long plastic = 0;
};

constexpr int chunk = 8 * row_unit;

RowSums observe_row(const Scene& scene, const CellState& cells, int j) {
    const double *p = cells.stress.p.row(j), *s = cells.stress.s.row(j), *tau = cells.stress.tau.row(j);
    const double* q = cells.stress.q.row(j);
    const Pack columns(static_cast<double>(scene.grid.cells_x));
    RowSums sums;
    Pack tau_sum(0.0), yy_sum(0.0), magnitude_sum(0.0), largest(0.0);
    std::array<double, chunk> yield;
    for (int i = 0; i < scene.grid.cells_x; i += pack_size) {
        if (i % chunk == 0)
            scene.law->yield_stress(std::min(chunk, scene.grid.cells_x - i), flow_rows(cells, j, i) + 3, yield.data());
        const Pack::Mask real = Pack::counting_from(i) < columns; // lanes beyond the last column hold copies
        const Pack si = load(s + i), ti = load(tau + i), qi = load(q + i);
        const Pack sbar = square_root(si * si + ti * ti + Pack(3.0) * (qi * qi));
        tau_sum = tau_sum + select(real, ti, Pack(0.0));
        yy_sum = yy_sum - select(real, load(p + i) + si + qi, Pack(0.0));
        magnitude_sum = magnitude_sum + select(real, sbar, Pack(0.0));
        largest = maximum(largest, sbar);
        sums.plastic += count_of(real && sbar >= load(yield.data() + i % chunk));
    }
    for (std::size_t k = 0; k < cells.internal.size(); ++k) {
        const double* const row = cells.internal[k].row(j);
        Pack low(sums.internal[k].smallest), high(sums.internal[k].largest);
        for (int i = 0; i < scene.grid.cells_x; i += pack_size) {
            low = minimum(low, load(row + i));
            high = maximum(high, load(row + i));
        }
        sums.internal[k] = {smallest_of(low), largest_of(high)};
    }
    sums.tau = sum_of(tau_sum);
    sums.yy = sum_of(yy_sum);
    sums.magnitude = sum_of(magnitude_sum);
    sums.largest = largest_of(largest);
    return sums;
}

} // namespace

Observables observe(const Scene& scene, const CellState& cells) {
    const Grid& grid = scene.grid;
    std::vector<RowSums> rows(static_cast<std::size_t>(grid.cells_y));
    for_each_row({grid.cells_y, grid.cells_x}, [&](int j) { rows[static_cast<std::size_t>(j)] = observe_row(scene, cells, j); });

    // summed row after row, so that the result does not depend on the number of threads
    RowSums total;
    for (const RowSums& row : rows) {
        total.tau += row.tau;
        total.yy += row.yy;
        total.magnitude += row.magnitude;
        total.largest = std::max(total.largest, row.largest);
        for (std::size_t k = 0; k < cells.internal.size(); ++k)
            total.internal[k] = {std::min(total.internal[k].smallest, row.internal[k].smallest),
                                 std::max(total.internal[k].largest, row.internal[k].largest)};
        total.plastic += row.plastic;
    }
    const double cells_total = static_cast<double>(grid.cells_x) * grid.cells_y;
    Observables seen{.wall_traction = total.tau / cells_total,
                     .normal_traction = total.yy / cells_total,
                     .mean_magnitude = total.magnitude / cells_total,
                     .largest_magnitude = total.largest,
                     .plastic_fraction = static_cast<double>(total.plastic) / cells_total};
    for (std::size_t k = 0; k < cells.internal.size(); ++k) {
        seen.smallest_internal.push_back(total.internal[k].smallest);
        seen.largest_internal.push_back(total.internal[k].largest);
    }
    return seen;
}

} // namespace ductile::quasistatic
