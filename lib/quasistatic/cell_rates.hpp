#pragma once
#include <ductile/material/point_rates.hpp>
#include <ductile/quasistatic/scene.hpp>
#include <ductile/space/staggered.hpp>
#include <ductile/space/transport.hpp>

#include <array>

/// The right-hand sides at a batch of cells: what every time integrator of the quasi-static side is made of.
namespace ductile::quasistatic {
inline namespace DUCTILE_VECTOR_ABI {

/// Sources at a batch of cells that do not depend on the plastic flow.
struct CellSources {
    Pack p{0.0};
    FlowState<Pack> point{Pack(0.0), Pack(0.0), Pack(0.0), Pack(0.0)};
};

/// Elastic rate C : D(v) (if `elastic`) and spin minus advection by v (if `transported`) at the cells i, i + 1, ... of row j.
/// The Jaumann spin, Eq. (5), with (grad v)_ij = dv_i/dx_j reads ds/dt += (du/dy - dv/dx) tau, dtau/dt -= (du/dy - dv/dx) s.
template <bool elastic, bool transported>
[[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] inline CellSources cell_sources(const Scene& scene, const CellState& cells,
                                                                          const VectorField& velocity, int i, int j) {
    CellSources sources;
    if constexpr (elastic || transported) {
        const double half_inverse_dx = 0.5 / scene.grid.dx(), half_inverse_dy = 0.5 / scene.grid.dy();
        const Corners u(velocity.u.row(j) + i, velocity.u.row(j + 1) + i);
        const Corners v(velocity.v.row(j) + i, velocity.v.row(j + 1) + i);
        const VelocityGradient<Pack> gradient = velocity_gradient(u, v, half_inverse_dx, half_inverse_dy);
        if constexpr (elastic) {
            const StressComponents<Pack> rate = elastic_rate(scene.elasticity, gradient);
            sources.p = rate.p;
            sources.point = {rate.s, rate.tau, rate.q, Pack(0.0)};
        }
        if constexpr (transported) {
            const Pack uc = u.mean(), vc = v.mean(), turn = gradient.uy - gradient.vx;
            const auto advection = [&](const Field& f) __attribute__((DUCTILE_ALWAYS_INLINE)) {
                return advection_rate(f.row(j) + i, f.stride(), uc, vc, half_inverse_dx, half_inverse_dy);
            };
            const Pack s = load(cells.stress.s.row(j) + i), tau = load(cells.stress.tau.row(j) + i);
            sources.p = sources.p + advection(cells.stress.p);
            sources.point[0] = sources.point[0] + turn * tau + advection(cells.stress.s);
            sources.point[1] = sources.point[1] + advection(cells.stress.tau) - turn * s;
            sources.point[2] = sources.point[2] + advection(cells.stress.q);
            sources.point[3] = sources.point[3] + advection(cells.internal);
        }
    }
    return sources;
}

} // namespace DUCTILE_VECTOR_ABI
} // namespace ductile::quasistatic
