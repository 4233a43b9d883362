#pragma once
#include <ductile/ode/rk21.hpp>
#include <ductile/quasistatic/scene.hpp>

namespace ductile::quasistatic {

/// How the constitutive equations are advanced before the projection.
enum class Predictor {
    euler,       ///< forward Euler without C : D, Eq. (16)
    substepped,  ///< RK2(1) substeps without C : D: Eq. (16) with the plastic terms resolved (Sec. 4.3)
    incremental, ///< RK2(1) substeps with C : D(q), Eqs. (27), (28)
};

/// What one predictor step reports.
struct PredictorReport {
    Rk21Counts counts; ///< substeps of plastic cells; a cell that stays elastic takes none
};

/// The predictor of one global step: from the state at t_n computes, for every cell,
///   sigma* = integral of  [spin - advection](sigma_n, v_n) + [incremental: C : D(v_n)] - 2 mu D^pl sigma_0/sbar,
///   chi*   = integral of  -advection(chi_n, v_n) + F(sigma, chi),
/// bracketed terms constant over the step, at t_n in the paper. The Jaumann spin, Eq. (5), with (grad v)_ij = dv_i/dx_j reads
///   ds/dt += (du/dy - dv/dx) tau,  dtau/dt -= (du/dy - dv/dx) s;  p and q do not turn.
/// The reduced model has neither spin nor advection and does not pay for them.
/// Cells whose stress stays below yield at both ends of the step (sbar is convex along the straight elastic path) are updated in
/// closed form. In the same sweep, while the rows are in cache, `force` receives -B^T sigma*/dt on rows 1 .. N-1.
///
/// Spin and advection are those of the cells `transported`: `now` itself for terms frozen at t_n, or fields extrapolated to the
/// middle of the step, together with such a velocity. Not changed but for its ghost rows.
/// `next` gets sigma* and chi* with images wrapped.
[[nodiscard]] PredictorReport predict(const Scene& scene, Predictor predictor, const CellState& now, CellState& transported,
                                      const VectorField& velocity, double dt, const Rk21Options& options, CellState& next,
                                      VectorField& force);

} // namespace ductile::quasistatic
