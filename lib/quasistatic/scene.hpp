#pragma once
#include <ductile/material/law.hpp>
#include <ductile/material/units.hpp>
#include <ductile/quasistatic/walls.hpp>
#include <ductile/space/field.hpp>
#include <ductile/space/grid.hpp>

#include <array>
#include <string>
#include <utility>
#include <vector>

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
    Law law; ///< made with these units
    Model model = Model::full;
    Walls walls = {};
};

/// The fields at cell centres that the constitutive law evolves; two ghost rows for transport.
struct CellState {
    StressField stress;          ///< [N][M] each, units of stress
    std::vector<Field> internal; ///< [N][M] each, the law's internal variables
    Velocity wall;               ///< displacement of the upper wall; in a rate, its velocity

    CellState() = default;
    CellState(const Grid& grid, std::size_t variables);
    explicit CellState(const Scene& scene) : CellState(scene.grid, scene.law->variables().size()) {}

    /// Number of fields, in this order: p, s, tau, q, internal variables.
    [[nodiscard]] int count() const { return 4 + static_cast<int>(internal.size()); }
    [[nodiscard]] Field& field(int k) { return const_cast<Field&>(std::as_const(*this).field(k)); }
    [[nodiscard]] const Field& field(int k) const {
        const Field* const parts[] = {&stress.p, &stress.s, &stress.tau, &stress.q};
        return k < 4 ? *parts[k] : internal[static_cast<std::size_t>(k - 4)];
    }
    void wrap_row(int j) {
        for (int k = 0; k < count(); ++k)
            field(k).wrap_row(j);
    }
};

/// "p", "s", "tau", "q", then the names of the law's internal variables.
[[nodiscard]] std::vector<std::string> field_names(const Scene& scene);

/// Closes all fields at the walls for the ENO stencil.
void extrapolate_to_ghost_rows(CellState& cells);

/// Row j of s, tau, q and the internal variables from column i on, as a Law takes them.
template <class Pointer> struct FlowRows {
    std::array<Pointer, 3 + most_variables> row;

    operator const Pointer*() const { return row.data(); }
};
[[nodiscard]] FlowRows<double*> flow_rows(CellState& cells, int j, int i = 0);
[[nodiscard]] FlowRows<const double*> flow_rows(const CellState& cells, int j, int i = 0);

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
    std::vector<double> smallest_internal = {}, largest_internal = {}; ///< of each internal variable
    double plastic_fraction = 0.0;                                     ///< share of cells at or above yield
};
[[nodiscard]] Observables observe(const Scene& scene, const CellState& cells);

} // namespace ductile::quasistatic
