#pragma once
// Private: the sweeps of predict(). Each predictor has a file of its own, because the compiler takes long to unfold its
// integrator for every law and model.
#include <ductile/base/threads.hpp>
#include <ductile/quasistatic/cell_rates.hpp>
#include <ductile/quasistatic/predictor.hpp>

#include <variant>
#include <vector>

namespace ductile::quasistatic {

namespace detail {

/// Whether sbar stays below yield on the straight path from y to y + dt source.
template <class M>
[[gnu::DUCTILE_ALWAYS_INLINE]] inline Pack::Mask stays_elastic(const M& model, const FlowState<Pack>& y,
                                                               const FlowState<Pack>& end) {
    const Pack yield = minimum(model.yield_stress(y[3]), model.yield_stress(end[3]));
    return maximum(deviatoric_square(y), deviatoric_square(end)) < yield * yield;
}

template <class M, Predictor predictor, bool transported> class Sweep {
public:
    Sweep(const Scene& scene, const M& model, const CellState& now, const CellState& moving, const VectorField& velocity,
          double dt, const Rk21Options& options, CellState& next)
        : scene_(scene), model_(model), now_(now), moving_(moving), velocity_(velocity), dt_(dt), options_(options), next_(next) {
    }

    void row(int j, Rk21Counts& counts) const {
        const int columns = scene_.grid.cells_x;
        const int whole = columns - columns % pack_size;
        int i = 0;
        for (; i < whole; i += pack_size)
            pack(i, j, Pack::Mask(true), counts);
        if (i < columns) // lanes beyond the last column hold copies: computed, not counted
            pack(i, j, Pack::counting_from(i) < Pack(static_cast<double>(columns)), counts);
        for (Field* f : {&next_.stress.p, &next_.stress.s, &next_.stress.tau, &next_.stress.q, &next_.internal})
            f->wrap_row(j);
    }

private:
    [[gnu::DUCTILE_ALWAYS_INLINE]] void pack(int i, int j, const Pack::Mask& real_cells, Rk21Counts& counts) const {
        const double *p = now_.stress.p.row(j) + i, *s = now_.stress.s.row(j) + i, *tau = now_.stress.tau.row(j) + i;
        const double *q = now_.stress.q.row(j) + i, *internal = now_.internal.row(j) + i;
        FlowState<Pack> y{load(s), load(tau), load(q), load(internal)};
        const auto [p_source, source] =
            cell_sources<predictor == Predictor::incremental, transported>(scene_, moving_, velocity_, i, j);

        const Pack dt(dt_);
        store(load(p) + dt * p_source, next_.stress.p.row(j) + i);
        const FlowRate<M, Pack> rate{model_, Pack(2.0 * scene_.elasticity.shear_modulus), source};
        FlowState<Pack> end;
        for (std::size_t k = 0; k < 4; ++k)
            end[k] = y[k] + dt * source[k];
        const Pack::Mask plastic = !stays_elastic(model_, y, end);
        if (any_of(plastic)) {
            if constexpr (predictor == Predictor::euler) {
                const FlowState<Pack> slope = rate(y);
                for (std::size_t k = 0; k < 4; ++k)
                    end[k] = select(plastic, y[k] + dt * slope[k], end[k]);
            } else {
                FlowState<Pack> integrated = y;
                integrate_rk21(rate, integrated, plastic && real_cells, dt_, options_, counts);
                for (std::size_t k = 0; k < 4; ++k)
                    end[k] = select(plastic, integrated[k], end[k]);
            }
        }
        store(end[0], next_.stress.s.row(j) + i);
        store(end[1], next_.stress.tau.row(j) + i);
        store(end[2], next_.stress.q.row(j) + i);
        store(end[3], next_.internal.row(j) + i);
    }

    const Scene& scene_;
    const M& model_;
    const CellState& now_;
    const CellState& moving_;
    const VectorField& velocity_;
    double dt_;
    const Rk21Options& options_;
    CellState& next_;
};

template <class M, Predictor predictor, bool transported>
PredictorReport sweep(const Scene& scene, const M& model, const CellState& now, const CellState& moving,
                      const VectorField& velocity, double dt, const Rk21Options& options, CellState& next, VectorField& force) {
    const Sweep<M, predictor, transported> cells(scene, model, now, moving, velocity, dt, options, next);
    PredictorReport report;
    report.counts = sweep_rows(
        Rows{scene.grid.cells_y, scene.grid.cells_x}, Rk21Counts{}, [&](int j, Rk21Counts& counts) { cells.row(j, counts); },
        [&](int j) { divergence_row(scene.grid, next.stress, -1.0 / dt, j, force); },
        [](Rk21Counts& total, const Rk21Counts& counts) { total.add(counts); });
    return report;
}

template <class M, Predictor predictor>
PredictorReport choose_model(const Scene& scene, const M& model, const CellState& now, CellState& transported,
                             const VectorField& velocity, double dt, const Rk21Options& options, CellState& next,
                             VectorField& force) {
    if (scene.model == Model::reduced)
        return sweep<M, predictor, false>(scene, model, now, transported, velocity, dt, options, next, force);
    for (Field* f :
         {&transported.stress.p, &transported.stress.s, &transported.stress.tau, &transported.stress.q, &transported.internal})
        extrapolate_to_ghost_rows(*f);
    return sweep<M, predictor, true>(scene, model, now, transported, velocity, dt, options, next, force);
}

} // namespace detail

/// predict() with one predictor.
template <Predictor predictor>
PredictorReport predict_by(const Scene& scene, const CellState& now, CellState& transported, const VectorField& velocity,
                           double dt, const Rk21Options& options, CellState& next, VectorField& force) {
    return std::visit(
        [&](const auto& model) {
            return detail::choose_model<std::decay_t<decltype(model)>, predictor>(scene, model, now, transported, velocity, dt,
                                                                                  options, next, force);
        },
        scene.plasticity);
}

} // namespace ductile::quasistatic
