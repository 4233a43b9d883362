// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/space/grid.hpp>

namespace ductile {

/// What is known of one velocity component on one side of the rectangle.
enum class Condition {
    prescribed, ///< Dirichlet: the value is given
    traction,   ///< natural: the traction is given; it enters as nodal forces, none means a free side
    periodic,   ///< glued to the opposite side, where it must be periodic too, with both components
};

/// Both components on one side. Slip along a horizontal wall: {.u = Condition::traction, .v = Condition::prescribed}.
struct SideConditions {
    Condition u = Condition::traction;
    Condition v = Condition::traction;

    bool operator==(const SideConditions&) const = default;
};

/// The four sides of the rectangle. A corner that belongs to two sides is prescribed if either prescribes it.
struct BoundaryConditions {
    SideConditions left = {}, right = {}, bottom = {}, top = {};

    [[nodiscard]] bool periodic_x() const { return left.u == Condition::periodic; }
    [[nodiscard]] bool periodic_y() const { return bottom.u == Condition::periodic; }
    /// Columns and rows of distinct nodes: periodic images are not stored.
    [[nodiscard]] int node_columns(const Grid& grid) const { return grid.cells_x + (periodic_x() ? 0 : 1); }
    [[nodiscard]] int node_rows(const Grid& grid) const { return grid.cells_y + (periodic_y() ? 0 : 1); }

    bool operator==(const BoundaryConditions&) const = default;
};

/// Throws InputError, naming the side, when periodic conditions do not come in pairs.
void check(const BoundaryConditions& boundary);

} // namespace ductile
