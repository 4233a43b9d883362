// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/space/field.hpp>
#include <ductile/space/gauss.hpp>
#include <ductile/space/grid.hpp>

#include <vector>

namespace ductile {

/// The way from wall to wall, cut into elements of degree p. Velocity is a polynomial of degree p in each and continuous, known
/// by its values at the p + 1 Gauss-Lobatto points; stress and internal variables are known at the p Gauss-Legendre points, which
/// lie between them. Degree 1 is the one-point element of the staggered grid.
///
/// All matrices are those of the element [-1, 1]: slopes are to be multiplied by 2/h, weights by h/2.
struct ElementLine {
    int degree = 0;                                         ///< p
    std::vector<double> edges;                              ///< [elements + 1], growing
    Quadrature gauss;                                       ///< p points
    std::vector<double> nodes;                              ///< p + 1 points
    std::vector<double> value, slope;                       ///< [p][p + 1] from nodes to stress points
    std::vector<double> value_transposed, slope_transposed; ///< [p + 1][p]
    std::vector<double> slope_of_stress;                    ///< [p][p] between stress points
    std::vector<double> at_bottom, at_top;                  ///< [p] from stress points to the edges
    std::vector<double> legendre;                           ///< [p][p] from stress points to coefficients, see legendre_matrix()

    ElementLine(int degree, std::vector<double> edges);

    [[nodiscard]] int elements() const { return static_cast<int>(edges.size()) - 1; }
    [[nodiscard]] double height(int element) const {
        return edges[static_cast<std::size_t>(element) + 1] - edges[static_cast<std::size_t>(element)];
    }
    [[nodiscard]] RowSpacing rows() const;
    /// What the last quarter of the Legendre coefficients (one at least) have of the mean square over an element, and along x, of
    /// a field at its p rows of stress points from `first` on.
    [[nodiscard]] double mean_square_of_tail(const Field& field, int first) const;
};

/// As many edges as make elements of equal height, from 0 to `height`.
[[nodiscard]] std::vector<double> equal_elements(int elements, double height);

} // namespace ductile
