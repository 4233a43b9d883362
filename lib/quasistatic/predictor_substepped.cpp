#include <ductile/quasistatic/predictor_sweep.hpp>

namespace ductile::quasistatic {

template PredictorReport predict_by<Predictor::substepped>(const Scene&, const CellState&, CellState&, const VectorField&, double,
                                                           const Rk21Options&, CellState&, VectorField&);

} // namespace ductile::quasistatic
