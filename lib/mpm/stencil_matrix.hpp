// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: what the preconditioners assemble.
#include <ductile/base/aligned.hpp>
#include <ductile/mpm/active_nodes.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace ductile::mpm {

/// A symmetric matrix of `components` x `components` blocks that couple each active node with those at most `reach` nodes away on
/// the lattice, each way. Of the two blocks of a pair of nodes only that below the diagonal is kept: the mean of what is added
/// to it and of the transpose of what is added to the other.
class StencilMatrix {
public:
    StencilMatrix(const ActiveNodes& nodes, int reach, int components);

    /// Adds a dense matrix, row by row, over the components of these nodes (active numbers).
    void add(std::span<const std::int32_t> nodes, std::span<const double> dense);

    /// Calls `visit(k, block)` for the nodes k >= l that node l may couple with, k rising; the block's rows belong to k.
    void for_each_below(std::int32_t l, const auto& visit) const {
        const int row = 2 * reach_ + 1, column = lattice_[static_cast<std::size_t>(l)] % width_;
        // where a periodic side cuts a row of the stencil, what lies beyond it on the right has the lower numbers
        const int cut = period_ == 0                 ? 0
                        : column < reach_            ? reach_ - column
                        : column + reach_ >= period_ ? reach_ + period_ - column
                                                     : 0;
        for (int place = 0; place < places_; ++place) {
            const std::size_t n = static_cast<std::size_t>(l) * places_ + place / row * row + (place % row + cut) % row;
            if (neighbour_[n] >= 0)
                visit(neighbour_[n], std::span<const double>(&value_[n * block_], block_));
        }
    }

private:
    int reach_, components_;
    int period_, before_; // columns of the lattice, and of the stencil's lowest row before the node itself
    int places_;
    std::size_t block_; // numbers
    int width_;
    const std::vector<std::int32_t>& lattice_;
    std::vector<std::int32_t> neighbour_; // [node][place of the stencil's upper half]: active number, or -1
    aligned_vector<double> value_;        // [node][place][row][column]
};

} // namespace ductile::mpm
