// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/mpm/kernels.hpp>

namespace ductile::mpm {

std::unique_ptr<Discretisation> make_discretisation(const Scene& scene, bool midpoint) {
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

} // namespace ductile::mpm
