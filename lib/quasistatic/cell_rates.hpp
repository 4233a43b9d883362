#pragma once
#include <ductile/base/simd.hpp>
#include <ductile/material/point_rates.hpp>
#include <ductile/quasistatic/scene.hpp>
#include <ductile/space/staggered.hpp>
#include <ductile/space/transport.hpp>

/// The sources of a row of cells that do not depend on the plastic flow.
namespace ductile::quasistatic {
inline namespace DUCTILE_VECTOR_ABI {

/// Writes to row j of `sources` the elastic rate C : D(v) (if `elastic`) and spin minus advection by v (if `transported`), whole
/// vectors, images not wrapped. The Jaumann spin, Eq. (5), with (grad v)_ij = dv_i/dx_j reads
/// ds/dt += (du/dy - dv/dx) tau, dtau/dt -= (du/dy - dv/dx) s.
template <bool elastic, bool transported>
void store_sources(const Scene& scene, const CellState& cells, const VectorField& velocity, int j, CellState& sources) {
    const double half_inverse_dx = 0.5 / scene.grid.dx(), half_inverse_dy = 0.5 / scene.grid.dy();
    const IsotropicElasticity elasticity = scene.law->elasticity();
    for (int i = 0; i < scene.grid.cells_x; i += pack_size) {
        StressComponents<Pack> rate{Pack(0.0), Pack(0.0), Pack(0.0), Pack(0.0)};
        if constexpr (elastic || transported) {
            const Corners u(velocity.u.row(j) + i, velocity.u.row(j + 1) + i);
            const Corners v(velocity.v.row(j) + i, velocity.v.row(j + 1) + i);
            const VelocityGradient<Pack> gradient = velocity_gradient(u, v, half_inverse_dx, half_inverse_dy);
            if constexpr (elastic)
                rate = elastic_rate(elasticity, gradient);
            if constexpr (transported) {
                const Pack uc = u.mean(), vc = v.mean(), turn = gradient.uy - gradient.vx;
                const auto advection = [&](const Field& f) __attribute__((DUCTILE_ALWAYS_INLINE)) {
                    return advection_rate(f.row(j) + i, f.stride(), uc, vc, half_inverse_dx, half_inverse_dy);
                };
                const Pack s = load(cells.stress.s.row(j) + i), tau = load(cells.stress.tau.row(j) + i);
                rate.p = rate.p + advection(cells.stress.p);
                rate.s = rate.s + turn * tau + advection(cells.stress.s);
                rate.tau = rate.tau + advection(cells.stress.tau) - turn * s;
                rate.q = rate.q + advection(cells.stress.q);
                for (std::size_t k = 0; k < cells.internal.size(); ++k)
                    store(advection(cells.internal[k]), sources.internal[k].row(j) + i);
            }
        }
        store(rate.p, sources.stress.p.row(j) + i);
        store(rate.s, sources.stress.s.row(j) + i);
        store(rate.tau, sources.stress.tau.row(j) + i);
        store(rate.q, sources.stress.q.row(j) + i);
        if constexpr (!transported)
            for (Field& internal : sources.internal)
                store(Pack(0.0), internal.row(j) + i);
    }
}

} // namespace DUCTILE_VECTOR_ABI
} // namespace ductile::quasistatic
