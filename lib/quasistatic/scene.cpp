#include <ductile/quasistatic/scene.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace ductile::quasistatic {

CellState::CellState(const Grid &grid) {
    for (Field *f : {&stress.p, &stress.s, &stress.tau, &stress.q, &internal})
        *f = Field(grid.cells_y, grid.cells_x, 2);
}

State initial_state(const Scene &scene, const Field &internal) {
    const Grid &grid = scene.grid;
    State state{.cells = CellState(grid),
                .velocity = {Field(grid.cells_y + 1, grid.cells_x), Field(grid.cells_y + 1, grid.cells_x)}};
    for (int j = 0; j < grid.cells_y; ++j) {
        std::copy_n(internal.row(j), grid.cells_x, state.cells.internal.row(j));
        state.cells.internal.wrap_row(j);
    }
    add_affine_velocity(grid, scene.walls.after(0.0), state.velocity);
    return state;
}

void add_affine_velocity(const Grid &grid, const WallVelocity &change, VectorField &velocity) {
    for (int j = 0; j <= grid.cells_y; ++j) {
        const double y = static_cast<double>(2 * j - grid.cells_y) / grid.cells_y;
        for (const auto &[field, amplitude] : {std::pair{&velocity.u, change.u}, std::pair{&velocity.v, change.v}}) {
            if (amplitude == 0.0)
                continue;
            double *row = field->row(j);
            for (int i = 0; i < grid.cells_x; ++i)
                row[i] += amplitude * y;
            field->wrap_row(j);
        }
    }
}

Observables observe(const Scene &scene, const CellState &cells) {
    struct RowSums {
        double tau = 0.0, yy = 0.0, magnitude = 0.0, largest = 0.0;
        double smallest_internal = std::numeric_limits<double>::infinity();
        double largest_internal = -std::numeric_limits<double>::infinity();
        long long plastic = 0;
    };
    const Grid &grid = scene.grid;
    std::vector<RowSums> rows(static_cast<std::size_t>(grid.cells_y));
    std::visit(
        [&](const auto &model) {
#pragma omp parallel for schedule(static)
            for (int j = 0; j < grid.cells_y; ++j) {
                RowSums sums;
                const double *p = cells.stress.p.row(j), *s = cells.stress.s.row(j), *tau = cells.stress.tau.row(j);
                const double *q = cells.stress.q.row(j), *internal = cells.internal.row(j);
                for (int i = 0; i < grid.cells_x; ++i) {
                    const double sbar = std::sqrt(s[i] * s[i] + tau[i] * tau[i] + 3.0 * q[i] * q[i]);
                    sums.tau += tau[i];
                    sums.yy -= p[i] + s[i] + q[i];
                    sums.magnitude += sbar;
                    sums.largest = std::max(sums.largest, sbar);
                    sums.smallest_internal = std::min(sums.smallest_internal, internal[i]);
                    sums.largest_internal = std::max(sums.largest_internal, internal[i]);
                    sums.plastic += sbar >= model.yield_stress(internal[i]);
                }
                rows[static_cast<std::size_t>(j)] = sums;
            }
        },
        scene.plasticity);

    // summed row after row, so that the result does not depend on the number of threads
    RowSums total;
    for (const RowSums &row : rows) {
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
