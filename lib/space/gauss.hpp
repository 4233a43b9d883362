// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <span>
#include <vector>

/// Polynomials on [-1, 1] by their values at points. Matrices are rows of numbers, [points to][points from].
namespace ductile {

struct Quadrature {
    std::vector<double> points; ///< in growing order
    std::vector<double> weights;
};

/// The n zeros of the Legendre polynomial P_n, with weights that integrate degree 2 n - 1 exactly.
[[nodiscard]] Quadrature gauss_legendre(int n);

/// -1, the n - 2 zeros of P'_{n-1}, and 1. The zeros of P_{n-1} lie between them, one in each gap.
[[nodiscard]] std::vector<double> gauss_lobatto_points(int n);

/// Values at the points `to` of the polynomial of degree from.size() - 1 that has given values at the points `from`.
[[nodiscard]] std::vector<double> interpolation_matrix(std::span<const double> from, std::span<const double> to);
/// Its slopes there.
[[nodiscard]] std::vector<double> slope_matrix(std::span<const double> from, std::span<const double> to);
/// Its Legendre coefficients, times sqrt(2/(2 l + 1)) so that the sum of their squares is the integral of its square; `from` are
/// the points of gauss_legendre.
[[nodiscard]] std::vector<double> legendre_matrix(const Quadrature& from);

} // namespace ductile
