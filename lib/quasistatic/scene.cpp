// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/quasistatic/scene.hpp>

namespace ductile::quasistatic {

std::vector<std::string> field_names(const Scene& scene) {
    std::vector<std::string> names{"p", "s", "tau", "q"};
    for (const InternalVariable& variable : scene.law->variables())
        names.emplace_back(variable.name);
    return names;
}

std::unique_ptr<Space> make_space(const Scene& scene, const SpaceOptions& options) {
    return make_staggered_space(scene.grid, {scene.law, scene.model == Model::full}, options);
}

} // namespace ductile::quasistatic
