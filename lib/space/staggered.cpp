// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/threads.hpp>
#include <ductile/space/staggered.hpp>

#include <algorithm>

namespace ductile {

void divergence_row(const Grid& grid, const StressField& stress, double factor, int node_row, VectorField& force) {
    const int lower = node_row - 1, upper = node_row;
    const double *p0 = stress.p.row(lower), *s0 = stress.s.row(lower), *t0 = stress.tau.row(lower), *q0 = stress.q.row(lower);
    const double *p1 = stress.p.row(upper), *s1 = stress.s.row(upper), *t1 = stress.tau.row(upper), *q1 = stress.q.row(upper);
    double* fu = force.u.row(node_row);
    double* fv = force.v.row(node_row);
    const Pack half_dy(0.5 * factor * grid.dy()), half_dx(0.5 * factor * grid.dx());
    const int padded = force.u.padded_columns();
    for (int i = 0; i < padded; i += pack_size) {
        // column sums to the left (i - 1) and right (i) of the node
        const auto normal = [](const double* p, const double* s, const double* q, int k, double sign) {
            return Pack(sign) * load(s + k) - load(p + k) - load(q + k);
        };
        const Pack xx_left = normal(p0, s0, q0, i - 1, 1.0) + normal(p1, s1, q1, i - 1, 1.0);
        const Pack xx_right = normal(p0, s0, q0, i, 1.0) + normal(p1, s1, q1, i, 1.0);
        const Pack yy_lower = normal(p0, s0, q0, i - 1, -1.0) + normal(p0, s0, q0, i, -1.0);
        const Pack yy_upper = normal(p1, s1, q1, i - 1, -1.0) + normal(p1, s1, q1, i, -1.0);
        const Pack t00 = load(t0 + i - 1), t10 = load(t0 + i), t01 = load(t1 + i - 1), t11 = load(t1 + i);
        store(half_dy * (xx_left - xx_right) + half_dx * ((t00 + t10) - (t01 + t11)), fu + i);
        store(half_dy * ((t00 + t01) - (t10 + t11)) + half_dx * (yy_lower - yy_upper), fv + i);
    }
}

void divergence(const Grid& grid, const StressField& stress, double factor, VectorField& force) {
    for (Field* f : {&force.u, &force.v})
        for (int wall : {0, grid.cells_y})
            std::fill_n(f->row(wall), f->padded_columns(), 0.0);
    for_each_row({grid.cells_y - 1, grid.cells_x}, [&](int j) { divergence_row(grid, stress, factor, j + 1, force); });
}

} // namespace ductile
