#include <ductile/base/threads.hpp>
#include <ductile/material/point_rates.hpp>
#include <ductile/quasistatic/plastic_flow.hpp>

#include <variant>

namespace ductile::quasistatic {

namespace {

FlowState<Pack> flow_state(const CellState& cells, int i, int j) {
    return {load(cells.stress.s.row(j) + i), load(cells.stress.tau.row(j) + i), load(cells.stress.q.row(j) + i),
            load(cells.internal.row(j) + i)};
}

void store_flow(const FlowState<Pack>& y, int i, int j, CellState& cells) {
    store(y[0], cells.stress.s.row(j) + i);
    store(y[1], cells.stress.tau.row(j) + i);
    store(y[2], cells.stress.q.row(j) + i);
    store(y[3], cells.internal.row(j) + i);
}

void wrap(CellState& cells, int j) {
    for (Field* f : {&cells.stress.p, &cells.stress.s, &cells.stress.tau, &cells.stress.q, &cells.internal})
        f->wrap_row(j);
}

template <class M> void rate_of_row(const Scene& scene, const M& model, const CellState& cells, int j, CellState& rate) {
    const FlowRate<M, Pack> flow{model, Pack(2.0 * scene.elasticity.shear_modulus), {Pack(0.0), Pack(0.0), Pack(0.0), Pack(0.0)}};
    for (int i = 0; i < scene.grid.cells_x; i += pack_size) {
        store(Pack(0.0), rate.stress.p.row(j) + i);
        store_flow(flow(flow_state(cells, i, j)), i, j, rate);
    }
    wrap(rate, j);
}

template <class M>
void relax_row(const Scene& scene, const M& model, const CellState& sources, double duration, const Rk21Options& options, int j,
               CellState& cells, Rk21Counts& counts) {
    for (int i = 0; i < scene.grid.cells_x; i += pack_size) {
        double* p = cells.stress.p.row(j) + i;
        store(load(p) + Pack(duration) * load(sources.stress.p.row(j) + i), p);
        const FlowRate<M, Pack> flow{model, Pack(2.0 * scene.elasticity.shear_modulus), flow_state(sources, i, j)};
        FlowState<Pack> y = flow_state(cells, i, j);
        const auto real_cells = Pack::counting_from(i) < Pack(static_cast<double>(scene.grid.cells_x));
        integrate_rk21(flow, y, real_cells, duration, options, counts);
        store_flow(y, i, j, cells);
    }
    wrap(cells, j);
}

} // namespace

void plastic_rate(const Scene& scene, const CellState& cells, CellState& rate) {
    std::visit(
        [&](const auto& model) {
            for_each_row({scene.grid.cells_y, scene.grid.cells_x}, [&](int j) { rate_of_row(scene, model, cells, j, rate); });
        },
        scene.plasticity);
}

Rk21Counts relax(const Scene& scene, const CellState& sources, double duration, const Rk21Options& options, CellState& cells) {
    return std::visit(
        [&](const auto& model) {
            return gather_rows(
                Rows{scene.grid.cells_y, scene.grid.cells_x}, Rk21Counts{},
                [&](int j, Rk21Counts& counts) { relax_row(scene, model, sources, duration, options, j, cells, counts); },
                [](Rk21Counts& total, const Rk21Counts& counts) { total.add(counts); });
        },
        scene.plasticity);
}

} // namespace ductile::quasistatic
