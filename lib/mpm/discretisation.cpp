// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/mpm/kernels.hpp>

namespace ductile::mpm {

std::unique_ptr<Discretisation> make_discretisation(const Scene& scene) {
    switch (scene.shape) {
    case ShapeFunction::linear:
        return make_kernels<Linear>(scene);
    case ShapeFunction::gimp:
        return make_kernels<Gimp>(scene);
    case ShapeFunction::bspline:
        break;
    }
    return make_kernels<BSpline>(scene);
}

} // namespace ductile::mpm
