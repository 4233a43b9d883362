#pragma once
#include <ductile/mpm/particles.hpp>
#include <ductile/mpm/scene.hpp>

namespace ductile::mpm {

/// Energies of all particles [J, a metre of thickness or a radian].
struct Energies {
    double kinetic = 0.0;  ///< sum of m v^2/2
    double strain = 0.0;   ///< elastic: sum of V sigma : C^-1 : sigma/2
    double internal = 0.0; ///< sum of m e with (2.2.16): elastic and plastic work
};

[[nodiscard]] Energies energies_of(const Scene& scene, const Particles& particles);

/// The number of cells without particles between two cells, to the left and right or below and above, that have some: there a
/// body has come apart because its particles are too few for its strain, and not because it broke (numerical fracture). Two
/// bodies that are a cell apart count, too.
[[nodiscard]] int enclosed_empty_cells(const Grid& grid, const Particles& particles);

} // namespace ductile::mpm
