#pragma once
#include <ductile/material/elasticity.hpp>
#include <ductile/material/plasticity.hpp>
#include <ductile/material/units.hpp>
#include <ductile/quasistatic/walls.hpp>
#include <ductile/space/field.hpp>
#include <ductile/space/grid.hpp>

namespace ductile::quasistatic {

/// Which terms of the evolution equations are kept.
enum class Model {
    reduced, ///< Eqs. (57), (58): elasticity and plasticity only
    full,    ///< Eqs. (27), (28): with advection and Jaumann spin
};

/// What is simulated, in the natural units `units`: everything the equations need and nothing about how they are solved.
struct Scene {
    Units units;
    Grid grid;
    IsotropicElasticity elasticity;
    Plasticity plasticity;
    Model model = Model::full;
    WallHistory walls;
};

/// The fields at cell centres that the constitutive law evolves; two ghost rows for transport.
struct CellState {
    StressField stress; ///< [N][M] each, units of stress
    Field internal;     ///< [N][M], the model's internal variable

    CellState() = default;
    explicit CellState(const Grid& grid);
};

/// The whole state of a run.
struct State {
    CellState cells;
    VectorField velocity; ///< corners, [N + 1][M]; the velocity of the last step (its midpoint in the second-order scheme)
    double time = 0.0;
    long long step = 0;
};

/// State at rest in stress: zero stress, affine velocity between the walls (Sec. 8), given initial internal variable [N][M].
[[nodiscard]] State initial_state(const Scene& scene, const Field& internal);

/// Adds the affine field of two walls whose velocities change by `change` (upper) and -`change` (lower):
/// velocity(y) += change * 2 y/height.
void add_affine_velocity(const Grid& grid, const WallVelocity& change, VectorField& velocity);

/// target = newer + weight (newer - older), images included.
void extrapolate(const VectorField& older, const VectorField& newer, double weight, VectorField& target);

/// Scalars that describe a state, in natural units.
struct Observables {
    double wall_traction = 0.0;     ///< shear force on a wall per length: the mean of tau (every row has the same mean)
    double normal_traction = 0.0;   ///< mean sigma_yy
    double mean_magnitude = 0.0;    ///< mean of sbar
    double largest_magnitude = 0.0; ///< max of sbar
    double smallest_internal = 0.0;
    double largest_internal = 0.0;
    double plastic_fraction = 0.0; ///< share of cells at or above yield
};
[[nodiscard]] Observables observe(const Scene& scene, const CellState& cells);

} // namespace ductile::quasistatic
