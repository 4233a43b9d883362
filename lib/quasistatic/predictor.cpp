#include <ductile/base/threads.hpp>
#include <ductile/quasistatic/cell_rates.hpp>
#include <ductile/quasistatic/predictor.hpp>

namespace ductile::quasistatic {

namespace {

using StoreSources = void (*)(const Scene&, const CellState&, const VectorField&, int, CellState&);

StoreSources sources_of(Predictor predictor, Model model) {
    if (predictor == Predictor::incremental)
        return model == Model::full ? &store_sources<true, true> : &store_sources<true, false>;
    return model == Model::full ? &store_sources<false, true> : &store_sources<false, false>;
}

} // namespace

PredictorReport predict(const Scene& scene, Predictor predictor, const CellState& now, CellState& transported,
                        const VectorField& velocity, double dt, const Rk21Options& options, CellState& next, VectorField& force) {
    if (scene.model == Model::full)
        extrapolate_to_ghost_rows(transported);
    const StoreSources store_row = sources_of(predictor, scene.model);
    const int columns = scene.grid.cells_x;
    const auto visit = [&](int j, Rk21Counts& counts) {
        store_row(scene, transported, velocity, j, next);
        const double* const p = now.stress.p.row(j);
        double* const p_next = next.stress.p.row(j);
        for (int i = 0; i < columns; i += pack_size)
            store(load(p + i) + Pack(dt) * load(p_next + i), p_next + i);
        if (predictor == Predictor::euler)
            scene.law->flow_by_euler(columns, flow_rows(now, j), flow_rows(next, j), dt);
        else
            scene.law->flow_by_substeps(columns, flow_rows(now, j), flow_rows(next, j), dt, options, counts);
        next.wrap_row(j);
    };
    PredictorReport report;
    report.counts = sweep_rows(
        Rows{scene.grid.cells_y, columns}, Rk21Counts{}, visit,
        [&](int j) { divergence_row(scene.grid, next.stress, -1.0 / dt, j, force); },
        [](Rk21Counts& total, const Rk21Counts& part) { total.add(part); });
    return report;
}

} // namespace ductile::quasistatic
