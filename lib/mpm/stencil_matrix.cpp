// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/mpm/stencil_matrix.hpp>

#include <cstdlib>

namespace ductile::mpm {

StencilMatrix::StencilMatrix(const ActiveNodes& nodes, int reach, int components)
    : reach_(reach), components_(components), period_(nodes.period), before_(nodes.period > 0 ? reach : 0),
      places_(reach * (2 * reach + 1) + before_ + 1 + reach),
      block_(static_cast<std::size_t>(components) * static_cast<std::size_t>(components)), width_(nodes.lattice_width),
      lattice_(nodes.lattice) {
    std::vector<std::int32_t> number(static_cast<std::size_t>(width_) * static_cast<std::size_t>(nodes.lattice_height), -1);
    for (std::size_t n = 0; n < lattice_.size(); ++n)
        number[static_cast<std::size_t>(lattice_[n])] = static_cast<std::int32_t>(n);
    neighbour_.assign(lattice_.size() * static_cast<std::size_t>(places_), -1);
    for (std::size_t n = 0; n < lattice_.size(); ++n) {
        const int i = lattice_[n] % width_, j = lattice_[n] / width_;
        for (int dj = 0; dj <= reach && j + dj < nodes.lattice_height; ++dj)
            for (int di = dj == 0 ? -before_ : -reach; di <= reach; ++di) {
                const int column = period_ > 0 ? (i + di + period_) % period_ : i + di;
                if (column < 0 || column >= width_)
                    continue;
                const std::int32_t other = number[static_cast<std::size_t>((j + dj) * width_ + column)];
                if (other >= static_cast<std::int32_t>(n))
                    neighbour_[n * static_cast<std::size_t>(places_) +
                               static_cast<std::size_t>(dj * (2 * reach + 1) + di + before_)] = other;
            }
    }
    value_.assign(neighbour_.size() * block_, 0.0);
}

void StencilMatrix::add(std::span<const std::int32_t> nodes, std::span<const double> dense) {
    const std::size_t c = static_cast<std::size_t>(components_), columns = nodes.size() * c;
    for (std::size_t k = 0; k < nodes.size(); ++k)
        for (std::size_t l = 0; l < nodes.size(); ++l) {
            // several of the nodes may be one: one that stands in for others without mass
            const bool diagonal = nodes[k] == nodes[l], below = nodes[k] > nodes[l];
            const std::int32_t low = below ? nodes[l] : nodes[k], high = below ? nodes[k] : nodes[l];
            int di = lattice_[high] % width_ - lattice_[low] % width_;
            if (std::abs(di) > reach_)
                di += di < 0 ? period_ : -period_; // across a periodic side
            const int dj = lattice_[high] / width_ - lattice_[low] / width_;
            const int place = dj * (2 * reach_ + 1) + di + before_;
            double* const block = &value_[(static_cast<std::size_t>(low) * places_ + place) * block_];
            for (std::size_t a = 0; a < c; ++a)
                for (std::size_t b = 0; b < c; ++b) {
                    const double share = 0.5 * dense[(k * c + a) * columns + l * c + b];
                    if (diagonal || below)
                        block[a * c + b] += share;
                    if (diagonal || !below)
                        block[b * c + a] += share;
                }
        }
}

} // namespace ductile::mpm
