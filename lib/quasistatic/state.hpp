// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/quasistatic/scene.hpp>

#include <string>
#include <utility>
#include <vector>

namespace ductile::quasistatic {

/// What a scheme keeps of earlier steps. Schemes lay it out and fill it; nobody else needs to know what is in it.
struct Memory {
    std::string scheme = {}; ///< whose it is; empty: nobody's
    std::vector<std::pair<std::string, CellState>> cells = {};
    std::vector<std::pair<std::string, VectorField>> velocities = {};
    std::vector<std::string> names = {}; ///< of the numbers
    std::vector<double> numbers = {};
};

/// The whole state of a run.
struct State {
    CellState cells;
    VectorField velocity; ///< corners, [N + 1][M]; the velocity of the last step (its midpoint in the second-order scheme)
    double time = 0.0;
    long long step = 0;
    Memory memory = {}; ///< empty until a scheme makes steps from here
};

/// Of the upper wall since time 0.
[[nodiscard]] Velocity wall_displacement(const Scene& scene, const State& state);

/// All fields and numbers of a state, its memory included, by their names in files.
[[nodiscard]] std::vector<std::pair<std::string, Field*>> named_fields(const Scene& scene, State& state);
[[nodiscard]] std::vector<std::pair<std::string, double*>> named_numbers(State& state);

/// State at rest: zero stress, or the uniform one of walls under a traction from the start on; affine velocity between the walls
/// (Sec. 8). The law's first internal variable is given, [N][M]; the others are what they start with. Throws InputError for a law
/// without a rate form.
[[nodiscard]] State initial_state(const Scene& scene, const Space& space, const Field& internal);

} // namespace ductile::quasistatic
