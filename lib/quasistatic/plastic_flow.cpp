#include <ductile/base/simd.hpp>
#include <ductile/base/threads.hpp>
#include <ductile/quasistatic/plastic_flow.hpp>

#include <algorithm>
#include <utility>

namespace ductile::quasistatic {

void plastic_rate(const Scene& scene, const CellState& cells, CellState& rate) {
    for_each_row({scene.grid.cells_y, scene.grid.cells_x}, [&](int j) {
        for (int k = 0; k < rate.count(); ++k)
            std::fill_n(rate.field(k).row(j), scene.grid.cells_x, 0.0);
        (void)scene.law->add_flow_rates(scene.grid.cells_x, flow_rows(cells, j), flow_rows(rate, j));
        rate.wrap_row(j);
    });
    rate.wall = {};
}

Rk21Counts relax(const Scene& scene, CellState& sources, double duration, const Rk21Options& options, CellState& cells) {
    const Rk21Counts counts = gather_rows(
        Rows{scene.grid.cells_y, scene.grid.cells_x}, Rk21Counts{},
        [&](int j, Rk21Counts& row_counts) {
            for (int i = 0; i < scene.grid.cells_x; i += pack_size) {
                double* const p = sources.stress.p.row(j) + i;
                store(load(cells.stress.p.row(j) + i) + Pack(duration) * load(p), p);
            }
            scene.law->flow_by_substeps(scene.grid.cells_x, flow_rows(cells, j), flow_rows(sources, j), duration, options,
                                        row_counts);
            sources.wrap_row(j);
        },
        [](Rk21Counts& total, const Rk21Counts& part) { total.add(part); });
    sources.wall = cells.wall + duration * sources.wall;
    std::swap(cells, sources);
    return counts;
}

} // namespace ductile::quasistatic
