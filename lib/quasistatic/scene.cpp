#include <ductile/base/threads.hpp>
#include <ductile/quasistatic/scene.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace ductile::quasistatic {

CellState::CellState(const Grid& grid) {
    for (Field* f : {&stress.p, &stress.s, &stress.tau, &stress.q, &internal})
        *f = Field(grid.cells_y, grid.cells_x, 2);
}

State initial_state(const Scene& scene, const Field& internal) {
    const Grid& grid = scene.grid;
    State state{.cells = CellState(grid), .velocity = VectorField(grid)};
    for (int j = 0; j < grid.cells_y; ++j) {
        std::copy_n(internal.row(j), grid.cells_x, state.cells.internal.row(j));
        state.cells.internal.wrap_row(j);
    }
    add_affine_velocity(grid, scene.walls.after(0.0), state.velocity);
    return state;
}

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

struct RowSums {
    double tau = 0.0, yy = 0.0, magnitude = 0.0, largest = 0.0;
    double smallest_internal = std::numeric_limits<double>::infinity();
    double largest_internal = -std::numeric_limits<double>::infinity();
    long long plastic = 0;
};

template <PlasticityModel M> RowSums observe_row(const M& model, const CellState& cells, int j) {
    const double *p = cells.stress.p.row(j), *s = cells.stress.s.row(j), *tau = cells.stress.tau.row(j);
    const double *q = cells.stress.q.row(j), *internal = cells.internal.row(j);
    const Pack columns(static_cast<double>(cells.internal.columns()));
    RowSums sums;
    Pack tau_sum(0.0), yy_sum(0.0), magnitude_sum(0.0), largest(0.0);
    Pack smallest_internal(sums.smallest_internal), largest_internal(sums.largest_internal);
    for (int i = 0; i < cells.internal.columns(); i += pack_size) {
        const Pack::Mask real = Pack::counting_from(i) < columns; // lanes beyond the last column hold copies
        const Pack si = load(s + i), ti = load(tau + i), qi = load(q + i), ci = load(internal + i);
        const Pack sbar = square_root(si * si + ti * ti + Pack(3.0) * (qi * qi));
        tau_sum = tau_sum + select(real, ti, Pack(0.0));
        yy_sum = yy_sum - select(real, load(p + i) + si + qi, Pack(0.0));
        magnitude_sum = magnitude_sum + select(real, sbar, Pack(0.0));
        largest = maximum(largest, sbar);
        smallest_internal = minimum(smallest_internal, ci);
        largest_internal = maximum(largest_internal, ci);
        sums.plastic += count_of(real && sbar >= model.yield_stress(ci));
    }
    sums.tau = sum_of(tau_sum);
    sums.yy = sum_of(yy_sum);
    sums.magnitude = sum_of(magnitude_sum);
    sums.largest = largest_of(largest);
    sums.smallest_internal = smallest_of(smallest_internal);
    sums.largest_internal = largest_of(largest_internal);
    return sums;
}

} // namespace

Observables observe(const Scene& scene, const CellState& cells) {
    const Grid& grid = scene.grid;
    std::vector<RowSums> rows(static_cast<std::size_t>(grid.cells_y));
    std::visit(
        [&](const auto& model) {
            for_each_row({grid.cells_y, grid.cells_x},
                         [&](int j) { rows[static_cast<std::size_t>(j)] = observe_row(model, cells, j); });
        },
        scene.plasticity);

    // summed row after row, so that the result does not depend on the number of threads
    RowSums total;
    for (const RowSums& row : rows) {
        total.tau += row.tau;
        total.yy += row.yy;
        total.magnitude += row.magnitude;
        total.largest = std::max(total.largest, row.largest);
        total.smallest_internal = std::min(total.smallest_internal, row.smallest_internal);
        total.largest_internal = std::max(total.largest_internal, row.largest_internal);
        total.plastic += row.plastic;
    }
    const double cells_total = static_cast<double>(grid.cells_x) * grid.cells_y;
    return {.wall_traction = total.tau / cells_total,
            .normal_traction = total.yy / cells_total,
            .mean_magnitude = total.magnitude / cells_total,
            .largest_magnitude = total.largest,
            .smallest_internal = total.smallest_internal,
            .largest_internal = total.largest_internal,
            .plastic_fraction = static_cast<double>(total.plastic) / cells_total};
}

} // namespace ductile::quasistatic
