// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/space/boundary.hpp>

#include <fmt/format.h>

namespace ductile {

void check(const BoundaryConditions& boundary) {
    const auto check_pair = [](const SideConditions& one, const SideConditions& other, const char* names) {
        int periodic = 0;
        for (const Condition c : {one.u, one.v, other.u, other.v})
            periodic += c == Condition::periodic ? 1 : 0;
        if (periodic != 0 && periodic != 4)
            throw InputError(fmt::format("boundary conditions: {} must be periodic together, with both components", names));
    };
    check_pair(boundary.left, boundary.right, "left and right");
    check_pair(boundary.bottom, boundary.top, "bottom and top");
}

} // namespace ductile
