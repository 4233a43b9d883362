// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/mpm/body.hpp>
#include <ductile/mpm/scene.hpp>

#include <filesystem>

namespace ductile::mpm {

/// Adds the particles of a file as one body: material, density, and what the file does not say, from `body`, whose shape does not
/// count. The file is CSV with a head of names, or HDF5 with a dataset each at the top: x, y [m] and volume [m^3] of a metre of
/// thickness, or of a radian; if present velocity_x, velocity_y [m/s], stress_xx, stress_yy, stress_zz, stress_xy [Pa], internal
/// (the first internal variable). Throws InputError, naming the file, for one that cannot be read, lacks a column or has an
/// unknown one, columns of different lengths, and volumes that are not positive; what a particle must be besides, check() says.
void add_particles(Particles& particles, const Body& body, const std::filesystem::path& file, const Scene& scene);

} // namespace ductile::mpm
