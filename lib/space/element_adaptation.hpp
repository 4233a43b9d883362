// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: elements that are narrow where fields are fine.
#include <ductile/space/element_line.hpp>
#include <ductile/space/field.hpp>

#include <span>
#include <vector>

namespace ductile {

/// A field in units of what counts as large.
struct ScaledField {
    const Field* field = nullptr;
    double unit = 1.0;
};

/// Edges of as many elements, each of which shows the fields, at stress points, about as well as the others. Empty where those of
/// the line are good.
///
/// What an element does not show is estimated as
///   eta^2 = h_e/H sum over fields of [mean over x of (last quarter of the Legendre coefficients)^2],
/// for two that became one plus what the polynomials of both lose when the best one of the same degree takes their place. As long
/// as the element with the largest eta has more than `gain` times that of a pair that may become one, it is halved and the pair
/// joined: the largest eta falls with each exchange, so that there is an end to them, and edges do not go to and fro. Halves are
/// judged by the polynomials that they inherit. No element becomes narrower than 1/`narrowest` of the mean.
[[nodiscard]] std::vector<double> adapted_edges(const ElementLine& line, std::span<const ScaledField> fields);

/// Carries a field over to other elements of the same degree and number, images included. One at stress points, with a row for
/// each, becomes the best polynomial in the mean square, element by element: its integral over the height stays, of every column,
/// and in halves of an element it is what it was. One at nodes, with a row more, takes the values of the old polynomials there.
void carry_over(const ElementLine& from, const ElementLine& to, Field& field);

} // namespace ductile
