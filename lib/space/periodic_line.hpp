// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/aligned.hpp>

#include <vector>

namespace ductile {

/// How a periodic line differentiates.
enum class LineRule {
    spectral, ///< the trigonometric polynomial through the values
    staggered ///< neighbours, of second order: Lu & Rycroft's (2)
};

/// M nodes x_i = i dx and M cells between them, x_m = (m + 1/2) dx, on a period, as matrices.
///
/// The wave exp(i k x), k = 2 pi l/width, |l| <= M/2, at the nodes has at the cells the slope i kappa exp(i k dx/2) and the value
/// iota exp(i k dx/2) times that at the node before: kappa = k and iota = 1, at the Nyquist wave (M even) 0; of neighbours
/// kappa = 2 sin(k dx/2)/dx and iota = cos(k dx/2). The common phase drops out of B^T C B.
class PeriodicLine {
public:
    PeriodicLine(int points, double width, LineRule rule);

    [[nodiscard]] int points() const { return points_; }
    /// Columns of all matrices to points: padded; those beyond the last point repeat the first ones.
    [[nodiscard]] int padded() const { return padded_; }
    [[nodiscard]] double spacing() const { return spacing_; }
    [[nodiscard]] int modes() const { return points_ / 2 + 1; }
    [[nodiscard]] double kappa(int mode) const { return kappa_[static_cast<std::size_t>(mode)]; }
    [[nodiscard]] double iota(int mode) const { return iota_[static_cast<std::size_t>(mode)]; }

    /// [M][padded()], for rows of values times matrix: from nodes to the slope and the value at cells, and the transposed.
    [[nodiscard]] const double* slope_at_cells() const { return slope_at_cells_.data(); }
    [[nodiscard]] const double* value_at_cells() const { return value_at_cells_.data(); }
    [[nodiscard]] const double* slope_transposed() const { return slope_transposed_.data(); }
    [[nodiscard]] const double* value_transposed() const { return value_transposed_.data(); }
    /// From cells to the slope there, always spectral; the Nyquist wave has none.
    [[nodiscard]] const double* slope_between_cells() const { return slope_between_cells_.data(); }
    /// From cells to what the last quarter of the waves makes there.
    [[nodiscard]] const double* short_waves() const { return short_waves_.data(); }
    /// What a value 1 at one point is `shift` spacings to the right of it, in the trigonometric polynomial (of neighbours,
    /// linearly).
    [[nodiscard]] double value_between(double shift) const;
    [[nodiscard]] std::size_t memory_bytes() const { return 6 * slope_at_cells_.size() * sizeof(double); }

private:
    int points_, padded_;
    LineRule rule_;
    double spacing_;
    std::vector<double> kappa_, iota_;
    aligned_vector<double> slope_at_cells_, value_at_cells_, slope_transposed_, value_transposed_, slope_between_cells_,
        short_waves_;
};

} // namespace ductile
