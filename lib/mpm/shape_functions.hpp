// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/simd.hpp>
#include <ductile/mpm/grid.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace ductile::mpm {

/// Equal cells side by side. Where they are periodic, the first follows on the last, and node `cells` and those after it are
/// images of node 0 and those after that.
struct CellLine {
    int cells;
    bool periodic = false;
};

/// Shape functions are products of functions of x and of y. Each type below describes those of one direction on a line of equal
/// cells of size h; a particle sees `support` consecutive nodes that follow from its cell, and its natural coordinate xi in [0,
/// 1] inside it:
/// - `support`: nodes that a particle sees each way;
/// - `nodes(line)`: nodes of the line, images included;
/// - `first(xi, cell, line)`: the first of the nodes it sees;
/// - `wall_layers`: how many nodes at either end take the condition of that side;
/// - `stored`: numbers a direction that a particle keeps for a step;
/// - `store(xi, cell, line, half_width/h, numbers)` computes them; `expand(numbers, 1/h)` turns them into values and
/// derivatives;
/// - `smooth`: whether the derivatives are continuous;
/// - `spacing(first, line)`: how far apart, in cells, the places of the nodes are where a velocity that is linear in space has
/// the
///   value of the node: those that make sum N_i x_i = x.
template <int Support> struct Factors {
    double w[Support];  ///< N
    double dw[Support]; ///< dN/dx [1/m]
};

/// Bilinear hat functions of the nodes at the corners of the cells: the paper's choice. Their gradients jump at cell edges.
struct Linear {
    static constexpr int support = 2, wall_layers = 1, stored = 1;
    static constexpr bool smooth = false;
    static constexpr int nodes(CellLine line) { return line.cells + 1; }
    static int first(double, int cell, CellLine) { return cell; }
    static std::array<double, 1> spacing(int, CellLine) { return {1.0}; }

    static void store(double xi, int, CellLine, double, double* stored_numbers) { stored_numbers[0] = xi; }
    [[gnu::DUCTILE_ALWAYS_INLINE]] static Factors<2> expand(const double* stored_numbers, double inverse_h) {
        const double xi = stored_numbers[0];
        return {{1.0 - xi, xi}, {-inverse_h, inverse_h}};
    }
};

/// The base of the two that see three nodes each way: they keep values and derivatives.
struct ThreeNodes {
    static constexpr int support = 3, stored = 6;
    static constexpr bool smooth = true;

    [[gnu::DUCTILE_ALWAYS_INLINE]] static Factors<3> expand(const double* s, double inverse_h) {
        return {{s[0], s[1], s[2]}, {inverse_h * s[3], inverse_h * s[4], inverse_h * s[5]}};
    }
};

/// The generalised interpolation material point method of Bardenhagen & Kober (2004) with particles of constant size ("uGIMP"):
/// the average of a hat function over the particle's width, which must not exceed a cell. A particle nearer to a side of the grid
/// than half its width is taken as narrow as to touch the side: so no velocity is left across a wall. A periodic side is none.
struct Gimp : ThreeNodes {
    static constexpr int wall_layers = 1;
    static constexpr int nodes(CellLine line) { return line.cells + (line.periodic ? 2 : 1); }
    /// In the lower half of a cell a particle reaches the node below the cell, in the upper half the one above.
    static int first(double xi, int cell, CellLine line) {
        const int reached = reached_from(xi, cell, line);
        return reached < 0 ? line.cells - 1 : reached;
    }

    static std::array<double, 2> spacing(int, CellLine) { return {1.0, 1.0}; }

    static void store(double xi, int cell, CellLine line, double half_width_over_h, double* s) {
        const double place = cell + xi;
        const double half_width = line.periodic ? half_width_over_h : std::min({half_width_over_h, place, line.cells - place});
        const int node = reached_from(xi, cell, line);
        if (half_width < 1e-6) { // at a side: the hat function itself
            std::fill_n(s, stored, 0.0);
            double* const own = s + (cell - node);
            own[0] = 1.0 - xi;
            own[1] = xi;
            own[3] = -1.0;
            own[4] = 1.0;
            return;
        }
        for (int k = 0; k < 3; ++k)
            averaged_hat(place - (node + k), half_width, s[k], s[k + 3]);
    }

private:
    /// The first node; -1 for one beyond a periodic side.
    static int reached_from(double xi, int cell, CellLine line) {
        const int reached = xi < 0.5 ? cell - 1 : cell;
        return line.periodic ? reached : std::clamp(reached, 0, line.cells - 2);
    }

    static void averaged_hat(double distance, double l, double& value, double& slope) {
        const double d = std::abs(distance), sign = distance < 0.0 ? -1.0 : 1.0;
        value = slope = 0.0;
        if (d < l) {
            value = 1.0 - (d * d + l * l) / (2.0 * l);
            slope = -sign * d / l;
        } else if (d < 1.0 - l) {
            value = 1.0 - d;
            slope = -sign;
        } else if (d < 1.0 + l) {
            const double rest = 1.0 + l - d;
            value = rest * rest / (4.0 * l);
            slope = -sign * rest / (2.0 * l);
        }
    }
};

/// Quadratic B-splines with cell edges as knots, repeated three times at the ends of a line that is not periodic, so that the
/// first and the last function are 1 there: a velocity prescribed at the outermost nodes is that of the wall.
struct BSpline : ThreeNodes {
    static constexpr int wall_layers = 1;
    static constexpr int nodes(CellLine line) { return line.cells + 2; }
    static int first(double, int cell, CellLine) { return cell; }

    /// The places are the means of two inner knots: half a cell from the first and from the last.
    static std::array<double, 2> spacing(int first, CellLine line) {
        return {first == 0 && !line.periodic ? 0.5 : 1.0, first == line.cells - 1 && !line.periodic ? 0.5 : 1.0};
    }

    static void store(double xi, int cell, CellLine line, double, double* s) {
        // Cox-de Boor with the knots a <= 0, 1 <= b around the cell [0, 1]: a = -1, b = 2 but at the ends
        const double a = cell == 0 && !line.periodic ? 0.0 : -1.0, b = cell == line.cells - 1 && !line.periodic ? 1.0 : 2.0;
        const double left = (xi - a) / (1.0 - a), right = (b - xi) / b;
        s[0] = (1.0 - left) * (1.0 - xi);
        s[2] = (1.0 - right) * xi;
        s[1] = 1.0 - s[0] - s[2];
        s[3] = -2.0 * (1.0 - left);
        s[5] = 2.0 * (1.0 - right);
        s[4] = -s[3] - s[5];
    }
};

/// Where the nodes are that a particle sees, from there: they make sum N_i o_i = 0.
template <std::size_t n>
[[gnu::DUCTILE_ALWAYS_INLINE]] inline std::array<double, n + 1> offsets(const Factors<int(n) + 1>& f,
                                                                        const std::array<double, n>& spacing) {
    std::array<double, n + 1> o{};
    double mean = 0.0;
    for (std::size_t k = 1; k <= n; ++k) {
        o[k] = o[k - 1] + spacing[k - 1];
        mean += f.w[k] * o[k];
    }
    for (double& place : o)
        place -= mean;
    return o;
}

/// The factors whose derivatives find the gradient by moving least squares, N_i o_i/sum N_i o_i^2; beside a side of the grid,
/// where that has nothing to divide by, and with hat functions, where they are the same, those of the functions. Offsets in
/// metres.
template <std::size_t n>
[[gnu::DUCTILE_ALWAYS_INLINE]] inline Factors<int(n)> least_squares(const Factors<int(n)>& f, const std::array<double, n>& o) {
    if constexpr (n == 2)
        return f;
    double moment = 0.0;
    for (std::size_t k = 0; k < n; ++k)
        moment += f.w[k] * o[k] * o[k];
    const double cell = o[n - 1] - o[0];
    Factors<int(n)> result = f;
    for (std::size_t k = 0; k < n && moment > 0.01 * cell * cell; ++k)
        result.dw[k] = f.w[k] * o[k] / moment;
    return result;
}

} // namespace ductile::mpm
