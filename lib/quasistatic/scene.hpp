// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/material/law.hpp>
#include <ductile/material/units.hpp>
#include <ductile/quasistatic/walls.hpp>
#include <ductile/space/space.hpp>

#include <memory>
#include <string>
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

/// "p", "s", "tau", "q", then the names of the law's internal variables.
[[nodiscard]] std::vector<std::string> field_names(const Scene& scene);

/// The scene's grid and material as verbs. Throws InputError for an impossible grid or elasticity.
[[nodiscard]] std::unique_ptr<Space> make_space(const Scene& scene, const SpaceOptions& options = {});

} // namespace ductile::quasistatic
