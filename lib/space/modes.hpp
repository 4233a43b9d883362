// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/aligned.hpp>
#include <ductile/space/equilibrium_solver.hpp>

#include <cstddef>
#include <vector>

namespace ductile {

/// Fourier coefficients of one row of nodes: u and i v of the modes 0 .. M/2, split into real and imaginary parts.
/// Each pointer leads to ModeSystems::padded_modes() values and is aligned as base/aligned.hpp says.
struct SpectralRow {
    double *u_re, *u_im, *v_re, *v_im;
};

/// Inverses of the symmetric pivots of row_unit modes, over 2 M.
struct alignas(alignment) ModePivots {
    double uu[row_unit], uv[row_unit], vv[row_unit];
};

/// The matrix U of row_unit modes, times 2 M. Zero beyond the last mode.
struct alignas(alignment) ModeCouplings {
    double a[row_unit], d[row_unit], e[row_unit];
};

/// The stiffness K in Fourier space: for each mode k of x (angle theta = 2 pi k/M) a block tridiagonal system in y.
///
/// With the tensor products of Stencil, stiffness -> s = 4 sin^2(theta/2), mass -> m = cos^2(theta/2) + (1 - 4 m_1)
/// sin^2(theta/2) and cross -> i sin(theta). The factor i would couple u and v by imaginary numbers; with i v in place of v all
/// blocks are real, the same for real and imaginary parts:
///     U^T w_{j-1} + A w_j + U w_{j+1} = f_j,   U = (a, -e; e, d),   A diagonal,   w = (u, i v),   f = (f_x, i f_y).
/// The systems are eliminated from both walls towards a middle row: the mirror image y -> -y, v -> -v, turns the upper half into
/// the lower one, so both use the same symmetric pivots
///     S_1 = A,   S_j = A - U^T S_{j-1}^{-1} U,                  j counted from the wall,
/// and two threads can work on them at once. Pivots converge geometrically in j (slowly only near k = 0 and, for the one-point
/// operator, near the Nyquist mode); those that agree with the last to round-off are not stored, and what remains fits into
/// cache. K with Dirichlet walls is positive definite, hence every pivot is, also at the Nyquist mode.
///
/// Eight modes (one block) are worked on at once. Rows of the upper half carry -v in place of v ("mirrored").
/// Right-hand sides are 2 M times the coefficients (what the transforms deliver); solutions are the coefficients themselves.
class ModeSystems {
public:
    ModeSystems(const Grid& grid, const IsotropicElasticity& elasticity, Stiffness stiffness);

    [[nodiscard]] int blocks() const { return static_cast<int>(couplings_.size()); }
    [[nodiscard]] int padded_modes() const { return blocks() * row_unit; }
    [[nodiscard]] std::size_t memory_bytes() const;

    /// Forward elimination z = S^{-1} (f - U^T z_previous) in place of f, on the modes of blocks [begin, end).
    /// `step` counts rows from the wall, the first is 1; before the first stands the Dirichlet data of the wall.
    void eliminate(SpectralRow row, SpectralRow previous, int step, int begin, int end) const;
    /// Solves for the middle row, in place, where both eliminations meet: `below` as it is, `above` mirrored.
    /// `mirrored` receives the mirror image of the solution, which the substitution in the upper half starts from.
    void meet(SpectralRow middle, SpectralRow below, SpectralRow above, SpectralRow mirrored, int begin, int end) const;
    /// Back substitution w = z - S^{-1} U w_next in place of z.
    void substitute(SpectralRow row, SpectralRow next, int step, int begin, int end) const;

private:
    [[nodiscard]] const ModePivots& pivots(int step, int block) const;

    aligned_vector<ModeCouplings> couplings_; ///< one a block
    aligned_vector<ModePivots> pivots_;       ///< block after block, rows from the wall inwards
    aligned_vector<ModePivots> middle_;       ///< one a block
    std::vector<int> first_, stored_;         ///< where a block's pivots begin, and how many of them are stored
};

} // namespace ductile
