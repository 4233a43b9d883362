// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/mpm/body_contact.hpp>
#include <ductile/mpm/kernels.hpp>
#include <ductile/mpm/surface_contact.hpp>
#include <ductile/mpm/surface_loads.hpp>

#include <utility>

namespace ductile::mpm {

namespace {

std::unique_ptr<Discretisation> without_contact(const Scene& scene, bool midpoint) {
    switch (scene.shape) {
    case ShapeFunction::linear:
        return make_kernels<Linear>(scene, midpoint);
    case ShapeFunction::gimp:
        return make_kernels<Gimp>(scene, midpoint);
    case ShapeFunction::bspline:
        break;
    }
    return make_kernels<BSpline>(scene, midpoint);
}

} // namespace

std::unique_ptr<Discretisation> make_discretisation(const Scene& scene, bool midpoint) {
    std::unique_ptr<Discretisation> made = without_contact(scene, midpoint);
    if (!scene.loads.empty())
        made = with_loads(std::move(made), scene, midpoint);
    if (scene.surface_contact)
        made = with_surface_contact(std::move(made), scene, midpoint);
    return has_fields(scene) ? with_body_contact(std::move(made), scene, midpoint) : std::move(made);
}

} // namespace ductile::mpm
