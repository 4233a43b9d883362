// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/quasistatic/state.hpp>

#include <filesystem>

namespace ductile::quasistatic {

/// The state at rest that a file describes, and how far the stress had to be changed.
struct FileStart {
    State state;
    double correction = 0.0; ///< root mean square of the change, over that of the stress in the file; 0 without stress
};

/// Initial fields from a file, on the scene's grid or another one that covers the same domain: the first internal variable
/// ("effective_temperature" [K], "plastic_strain"), and, if you like, the stress: "pressure", "s", "tau", "q" [Pa], all four.
/// HDF5: datasets of rows [y][x] at the top, or in the last snapshot of a fields.h5; CSV: columns with a head, x and y of the
/// cell centres [m] besides, row after row from below. Bilinear between cell centres, periodic in x, constant beyond the
/// outermost in y. The stress is projected onto discrete equilibrium: what files hold is rounded, or interpolated, and obeys no
/// grid's balance; walls under a traction then bring it to that. Throws InputError, naming the file, for one that cannot be read,
/// fields that are missing or of different shapes, places that are no grid of the scene's domain, and values that are not finite
/// or that the law cannot begin with.
[[nodiscard]] FileStart start_from_file(const Scene& scene, Space& space, const std::filesystem::path& file);

} // namespace ductile::quasistatic
