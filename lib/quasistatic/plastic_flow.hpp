#pragma once
#include <ductile/ode/rk21.hpp>
#include <ductile/quasistatic/scene.hpp>

/// The plastic flow of all cells by itself, for schemes that split it from elasticity and transport.
namespace ductile::quasistatic {

/// rate = (-C : D^pl, dchi/dt), Eqs. (20), (21); nothing else. Images wrapped.
void plastic_rate(const Scene& scene, const CellState& cells, CellState& rate);

/// Takes `cells` over `duration` by (sources + plastic rate) with constant sources, every cell that flows in its own RK2(1)
/// substeps. Images wrapped. The memory of `sources` is used up.
[[nodiscard]] Rk21Counts relax(const Scene& scene, CellState& sources, double duration, const Rk21Options& options,
                               CellState& cells);

} // namespace ductile::quasistatic
