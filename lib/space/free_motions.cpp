// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/space/free_motions.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

#include <algorithm>
#include <array>

namespace ductile {
namespace {

using Candidates = Eigen::Matrix<double, Eigen::Dynamic, 6>;

constexpr std::array<const char*, 6> names = {
    "translation in x",   "translation in y", "rotation", "alternating translation in x", "alternating translation in y",
    "alternating stretch"};

Candidates candidates(const Grid& grid, const NodeNumbering& nodes) {
    Candidates z = Candidates::Zero(nodes.free_count(), 6);
    const double dx2 = grid.dx() * grid.dx(), dy2 = grid.dy() * grid.dy();
    for (int j = 0; j < nodes.rows(); ++j)
        for (int i = 0; i < nodes.columns(); ++i) {
            const double x = grid.x(i), y = grid.y(j), s = (i + j) % 2 == 0 ? 1.0 : -1.0;
            if (const int n = nodes.index(i, j, 0); n >= 0)
                z.row(n) << 1.0, 0.0, -y, s, 0.0, s * x / dx2;
            if (const int n = nodes.index(i, j, 1); n >= 0)
                z.row(n) << 0.0, 1.0, x, 0.0, s, -s * y / dy2;
        }
    z.colwise().normalize();
    return z;
}

/// q^T K q, cell by cell.
Eigen::MatrixXd energies(const Eigen::MatrixXd& q, const Grid& grid, const NodeNumbering& nodes, const CellStiffness& stiffness) {
    Eigen::Matrix<double, 8, 8> k;
    for (int row = 0; row < 8; ++row)
        for (int column = 0; column < 8; ++column)
            k(row, column) = stiffness[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(q.cols(), q.cols());
    Eigen::MatrixXd local(8, q.cols());
    for (int j = 0; j < grid.cells_y; ++j)
        for (int i = 0; i < grid.cells_x; ++i) {
            const std::array<int, 8> cell = nodes.of_cell(i, j);
            for (int row = 0; row < 8; ++row)
                if (const int n = cell[static_cast<std::size_t>(row)]; n >= 0)
                    local.row(row) = q.row(n);
                else
                    local.row(row).setZero();
            sum.noalias() += local.transpose() * k * local;
        }
    return sum;
}

} // namespace

FreeMotions find_free_motions(const Grid& grid, const NodeNumbering& nodes, const CellStiffness& stiffness) {
    FreeMotions motions;
    motions.named = candidates(grid, nodes);
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> span(motions.named);
    span.setThreshold(1e-10);
    const Eigen::MatrixXd q = span.householderQ() * Eigen::MatrixXd::Identity(nodes.free_count(), span.rank());

    // A held motion costs energy in the cells along a side: of order 1/N of the stiffness, far less on elongated grids where most
    // of a motion may vanish there. A free one costs round-off: some 10^-15.
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> spectrum(energies(q, grid, nodes, stiffness));
    const double negligible = 1e-13 * std::max(stiffness[0][0], stiffness[1][1]);
    const Eigen::Index count = (spectrum.eigenvalues().array() < negligible).count();
    motions.modes = q * spectrum.eigenvectors().leftCols(count);

    if (count > 0) {
        const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> choice(motions.modes.transpose());
        for (Eigen::Index pin = 0; pin < count; ++pin)
            motions.pins.push_back(choice.colsPermutation().indices()(pin));
        std::sort(motions.pins.begin(), motions.pins.end());
    }
    return motions;
}

std::string FreeMotions::name(const Eigen::VectorXd& unbalanced) const {
    Eigen::Index largest = 0;
    (named.transpose() * unbalanced).cwiseAbs().maxCoeff(&largest);
    return names[static_cast<std::size_t>(largest)];
}

} // namespace ductile
