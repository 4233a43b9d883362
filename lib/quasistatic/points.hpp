// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/mpm/options.hpp>
#include <ductile/quasistatic/options.hpp>

namespace ductile::quasistatic {

/// The scene of the grid that stays on material points: the block between its walls, periodic in x, filled with particles; the
/// walls are rigid bodies, points on the top and on the bottom of the background grid. Of `scene` the domain, the material, the
/// model and the initial pattern count, and declare_scene() is all that a program should declare of it.
struct PointsOptions {
    Options scene;
    mpm::Options points; ///< time, solver, shape functions, output: without inertia, unless it says otherwise

    PointsOptions();
};

/// Declares them all, grouped by topic; the cells are those of the scene.
void declare(io::Program& program, PointsOptions& options);

/// The scene in SI, and columns of history.csv named as on the grid: wall_strain, wall_shear_traction_Pa,
/// wall_normal_traction_Pa, and the mean of the internal variable. Model::full turns the stress with the material, Model::reduced
/// does not; particles move in both. Throws InputError for impossible values, walls that open (they would leave the grid), and a
/// start from a file.
[[nodiscard]] mpm::Problem make_problem(const PointsOptions& options);

} // namespace ductile::quasistatic
