// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/space/element_line.hpp>
#include <ductile/space/small_products.hpp>

#include <algorithm>
#include <array>

namespace ductile {

namespace {

std::vector<double> transposed(const std::vector<double>& matrix, std::size_t columns) {
    std::vector<double> result;
    for (std::size_t column = 0; column < columns; ++column)
        for (std::size_t at = column; at < matrix.size(); at += columns)
            result.push_back(matrix[at]);
    return result;
}

} // namespace

ElementLine::ElementLine(int p, std::vector<double> at)
    : degree(p), edges(std::move(at)), gauss(gauss_legendre(p)), nodes(gauss_lobatto_points(p + 1)),
      value(interpolation_matrix(nodes, gauss.points)), slope(slope_matrix(nodes, gauss.points)),
      value_transposed(transposed(value, nodes.size())), slope_transposed(transposed(slope, nodes.size())),
      slope_of_stress(slope_matrix(gauss.points, gauss.points)), at_bottom(interpolation_matrix(gauss.points, std::array{-1.0})),
      at_top(interpolation_matrix(gauss.points, std::array{1.0})), legendre(legendre_matrix(gauss)) {}

double ElementLine::mean_square_of_tail(const Field& field, int first) const {
    const int tail = std::max(1, degree / 4), padded = field.padded_columns();
    thread_local aligned_vector<double> coefficients;
    if (coefficients.size() < static_cast<std::size_t>(tail * padded))
        coefficients.resize(static_cast<std::size_t>(tail * padded));
    multiply(tail, degree, padded, {legendre.data() + static_cast<std::ptrdiff_t>(degree - tail) * degree, degree},
             {field.row(first), field.stride()}, {coefficients.data(), padded});
    double square = 0.0;
    for (int l = 0; l < tail; ++l) {
        double sum = 0.0;
        for (int i = 0; i < field.columns(); ++i) {
            const double c = coefficients[static_cast<std::size_t>(l * padded + i)];
            sum += c * c;
        }
        square += 0.5 * sum / field.columns();
    }
    return square;
}

RowSpacing ElementLine::rows() const {
    RowSpacing rows;
    rows.node.push_back(0.0);
    const double mean_height = (edges.back() - edges.front()) / (elements() * degree);
    for (int e = 0; e < elements(); ++e) {
        const double begin = edges[static_cast<std::size_t>(e)] - edges.front(), half = 0.5 * height(e);
        for (std::size_t l = 0; l < gauss.points.size(); ++l) {
            rows.cell.push_back((begin + half * (1.0 + gauss.points[l])) / mean_height);
            rows.node.push_back((begin + half * (1.0 + nodes[l + 1])) / mean_height);
            rows.weight.push_back(gauss.weights[l] * half / mean_height);
        }
    }
    rows.node.back() = elements() * degree; // the wall, to the last digit
    return rows;
}

std::vector<double> equal_elements(int elements, double height) {
    std::vector<double> edges;
    for (int e = 0; e <= elements; ++e)
        edges.push_back(height * e / elements);
    return edges;
}

} // namespace ductile
