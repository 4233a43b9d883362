#include <ductile/base/error.hpp>
#include <ductile/mpm/grid.hpp>

#include <cmath>
#include <fmt/format.h>

namespace ductile::mpm {

void check(const Grid& g, Geometry geometry) {
    constexpr int largest = 20'000;
    if (g.cells_x < 3 || g.cells_y < 3 || g.cells_x > largest || g.cells_y > largest)
        throw InputError(fmt::format("the background grid has {} x {} cells: from 3 to {} are possible each way", g.cells_x,
                                     g.cells_y, largest));
    if (!(g.width > 0.0 && g.height > 0.0 && std::isfinite(g.width) && std::isfinite(g.height)))
        throw InputError(
            fmt::format("the background grid is {} x {} m: both extents must be positive and finite", g.width, g.height));
    if (geometry == Geometry::axisymmetric && !(g.left >= 0.0))
        throw InputError(fmt::format("the background grid begins at the radius {} m: it must not be negative", g.left));
}

} // namespace ductile::mpm
