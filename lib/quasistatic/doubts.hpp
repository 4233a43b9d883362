// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/quasistatic/options.hpp>

#include <string>
#include <vector>

namespace ductile::quasistatic {

/// [kg/m^3] The density is not among the options: it is that of the metallic glass, rho = mu (t_s/L)^2 of Lu & Rycroft's problem.
[[nodiscard]] double assumed_density();
/// Of shear waves at that density [m/s].
[[nodiscard]] double shear_wave_speed(const Scene& scene);
/// Speed of a wall [m/s] that loads to yield in ten passages of shear waves from wall to wall: faster ones leave the stress no
/// time to even out.
[[nodiscard]] double inertial_wall_speed(const Scene& scene);
/// The largest speed of a wall within the run [m/s]; under force control, of an elastic one.
[[nodiscard]] double largest_wall_speed(const Options& options, const Scene& scene);

/// Throws InputError where the scene has no meaning: numbers that overflow, cells a million times as long as high, or walls
/// faster than shear waves.
void check_meaning(const Options& options, const Scene& scene);

/// Warnings, each a sentence with a figure, known before the first step: what the material has that no solid has; cells more than
/// ten times as long as high, or the other way round; an effective temperature that starts below that of the bath, or a bath
/// above the steady one; walls faster than inertial_wall_speed(); a tolerance that scheme or advection miss.
[[nodiscard]] std::vector<std::string> doubts(const Options& options, const Scene& scene, const Observables& start);

} // namespace ductile::quasistatic
