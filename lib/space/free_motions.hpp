// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: users of the library need not have Eigen.
#include <ductile/space/nodes.hpp>
#include <ductile/space/stencil.hpp>

#include <Eigen/Core>

#include <string>
#include <vector>

namespace ductile {

/// The motions that cost no elastic energy and that the boundary conditions do not hold: the null space of K on the free
/// degrees of freedom.
///
/// On the rectangle the one-point gradient B has exactly six null vectors. du/dx = 0 in every cell leaves
/// u_ij = a_j + (-1)^j b_i, dv/dy = 0 leaves v_ij = c_i + (-1)^i d_j, and the shear couples them,
///     (a_{j+1} - a_j)/dy + (c_{i+1} - c_i)/dx = (-1)^j (b_i + b_{i+1})/dy + (-1)^i (d_j + d_{j+1})/dx.
/// The left side is a sum of a function of i and one of j; the right side is only if (-1)^i (b_{i+1} + b_{i+2} - b_i -
/// b_{i+1})/dy =
/// -(-1)^j (...)/dx = constant. With that constant and the two of its integration, one that separates i from j, and one for
/// each of a, b, c, d less two that cancel, six parameters remain: two translations, the rotation (-y, x), and with the
/// checkerboard s = (-1)^(i+j) two alternating translations and s (x/dx^2, -y/dy^2). Of the fully integrated stiffness the first
/// three are null. A null vector on the free degrees of freedom, continued by zero on prescribed ones and across periodic sides,
/// is one of these; so the null space is found in the span of the six, restricted, by the eigenvalues of their 6 x 6 energies.
struct FreeMotions {
    Eigen::MatrixXd modes;          ///< orthonormal columns, one row a free degree of freedom (NodeNumbering::index)
    Eigen::MatrixXd named;          ///< the six candidates, normalised (zero if nothing of them is free)
    std::vector<Eigen::Index> pins; ///< as many degrees of freedom as modes; holding them holds every mode, well conditioned

    /// The part of a load that no stress can balance is named after the candidate it resembles most.
    [[nodiscard]] std::string name(const Eigen::VectorXd& unbalanced) const;
};

[[nodiscard]] FreeMotions find_free_motions(const Grid& grid, const NodeNumbering& nodes, const CellStiffness& stiffness);

} // namespace ductile
