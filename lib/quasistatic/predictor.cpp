#include <ductile/quasistatic/predictor.hpp>

namespace ductile::quasistatic {

/// One predictor's, in predictor_<name>.cpp.
template <Predictor predictor>
PredictorReport predict_by(const Scene& scene, const CellState& now, CellState& transported, const VectorField& velocity,
                           double dt, const Rk21Options& options, CellState& next, VectorField& force);

PredictorReport predict(const Scene& scene, Predictor predictor, const CellState& now, CellState& transported,
                        const VectorField& velocity, double dt, const Rk21Options& options, CellState& next, VectorField& force) {
    switch (predictor) {
    case Predictor::euler:
        return predict_by<Predictor::euler>(scene, now, transported, velocity, dt, options, next, force);
    case Predictor::substepped:
        return predict_by<Predictor::substepped>(scene, now, transported, velocity, dt, options, next, force);
    case Predictor::incremental:
        return predict_by<Predictor::incremental>(scene, now, transported, velocity, dt, options, next, force);
    }
    __builtin_unreachable();
}

} // namespace ductile::quasistatic
