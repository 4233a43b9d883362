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
    const Medium medium{scene.law, scene.model == Model::full};
    return options.kind == SpaceKind::elements ? make_element_space(scene.grid, medium, options.elements)
                                               : make_staggered_space(scene.grid, medium, options);
}

} // namespace ductile::quasistatic
