// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/mpm/diagnostics.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

namespace ductile::mpm {

Momenta momenta_of(const Particles& particles) {
    Momenta sum;
    for (std::size_t p = 0; p < particles.size(); ++p) {
        const double x = particles.mass[p] * particles.velocity_x[p], y = particles.mass[p] * particles.velocity_y[p];
        sum.x += x;
        sum.y += y;
        sum.angular += particles.x[p] * y - particles.y[p] * x;
    }
    return sum;
}

SymmetricTensor mean_stress(const Particles& particles) {
    SymmetricTensor sum;
    double volume = 0.0;
    for (std::size_t p = 0; p < particles.size(); ++p) {
        const double mine = particles.mass[p] / particles.density[p];
        sum = sum + mine * stress_of(particles, p);
        volume += mine;
    }
    return volume > 0.0 ? 1.0 / volume * sum : SymmetricTensor{};
}

namespace {

/// By the laws' own functions.
double stored_energy(const Scene& scene, const Particles& particles) {
    double sum = 0.0;
    for (std::size_t p = 0; p < particles.size(); ++p) {
        const Law& law = scene.materials[static_cast<std::size_t>(particles.material[p])].law;
        double internal[most_variables];
        for (std::size_t k = 0; k < law->variables().size(); ++k)
            internal[k] = particles.internal[k][p];
        sum += particles.mass[p] / particles.density[p] *
               law->stored_energy(stress_of(particles, p), {internal, law->variables().size()});
    }
    return sum;
}

} // namespace

Energies energies_of(const Scene& scene, const Particles& particles) {
    Energies sum;
    for (std::size_t p = 0; p < particles.size(); ++p) {
        const double vx = particles.velocity_x[p], vy = particles.velocity_y[p], mass = particles.mass[p];
        const SymmetricTensor stress = stress_of(particles, p);
        const Law& law = scene.materials[static_cast<std::size_t>(particles.material[p])].law;
        const SymmetricTensor strain = elastic_strain(law->elasticity(), stress);
        sum.kinetic += 0.5 * mass * (vx * vx + vy * vy);
        sum.strain += 0.5 * mass / particles.density[p] * contraction(stress, strain);
        sum.internal += mass * particles.energy[p];
    }
    if (has_finite_strain(scene))
        sum.strain = stored_energy(scene, particles);
    return sum;
}

namespace {

struct Cell {
    int i, j;
};

Cell cell_of(const Grid& grid, double x, double y) {
    return {std::clamp(static_cast<int>((x - grid.left) / grid.dx()), 0, grid.cells_x - 1),
            std::clamp(static_cast<int>((y - grid.bottom) / grid.dy()), 0, grid.cells_y - 1)};
}

/// The cells of one body, in the smallest box around them with a ring of empty cells.
class Map {
public:
    explicit Map(const std::vector<Cell>& cells) {
        Cell first = cells.front(), last = first;
        for (const Cell& c : cells) {
            first = {std::min(first.i, c.i), std::min(first.j, c.j)};
            last = {std::max(last.i, c.i), std::max(last.j, c.j)};
        }
        width_ = last.i - first.i + 3;
        height_ = last.j - first.j + 3;
        mark_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), empty);
        for (const Cell& c : cells)
            mark_[at(c.i - first.i + 1, c.j - first.j + 1)] = full;
    }

    void add_to(Connectivity& sum) {
        for (int j = 1; j < height_ - 1; ++j)
            for (int i = 1; i < width_ - 1; ++i)
                sum.enclosed_empty_cells +=
                    mark_[at(i, j)] == empty && ((mark_[at(i - 1, j)] == full && mark_[at(i + 1, j)] == full) ||
                                                 (mark_[at(i, j - 1)] == full && mark_[at(i, j + 1)] == full))
                        ? 1
                        : 0;
        sum.parts += flood(full, true);
        sum.holes += flood(empty, false) - 1; // the outside is one
    }

private:
    enum Mark : char { empty, full, visited };

    [[nodiscard]] std::size_t at(int i, int j) const {
        return static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(i);
    }

    /// Marks all cells of this kind as visited; the number of connected regions they were.
    int flood(Mark kind, bool over_corners) {
        int regions = 0;
        for (int start_j = 0; start_j < height_; ++start_j)
            for (int start_i = 0; start_i < width_; ++start_i) {
                if (mark_[at(start_i, start_j)] != kind)
                    continue;
                ++regions;
                mark_[at(start_i, start_j)] = visited;
                open_.assign(1, {start_i, start_j});
                while (!open_.empty()) {
                    const Cell c = open_.back();
                    open_.pop_back();
                    for (int dj = -1; dj <= 1; ++dj)
                        for (int di = -1; di <= 1; ++di) {
                            const int i = c.i + di, j = c.j + dj;
                            if ((!over_corners && di != 0 && dj != 0) || i < 0 || j < 0 || i >= width_ || j >= height_ ||
                                mark_[at(i, j)] != kind)
                                continue;
                            mark_[at(i, j)] = visited;
                            open_.push_back({i, j});
                        }
                }
            }
        return regions;
    }

    int width_, height_;
    std::vector<Mark> mark_;
    std::vector<Cell> open_;
};

/// Turns the cells of a body around a periodic grid until an empty column, if there is one, is the first: the body is in one
/// place.
void turn_to_gap(int columns, std::vector<Cell>& cells) {
    std::vector<char> full(static_cast<std::size_t>(columns), 0);
    for (const Cell& c : cells)
        full[static_cast<std::size_t>(c.i)] = 1;
    const auto gap = static_cast<int>(std::ranges::find(full, 0) - full.begin());
    for (Cell& c : cells)
        c.i = (c.i - gap + columns) % columns;
}

} // namespace

Connectivity connectivity_of(const Grid& grid, const Particles& particles) {
    std::map<std::int64_t, std::vector<Cell>> cells; // by body
    for (std::size_t p = 0; p < particles.size();) {
        std::vector<Cell>& own = cells[particles.body[p]];
        for (const std::int64_t body = particles.body[p]; p < particles.size() && particles.body[p] == body; ++p) {
            const Cell c = cell_of(grid, particles.x[p], particles.y[p]);
            if (own.empty() || own.back().i != c.i || own.back().j != c.j)
                own.push_back(c);
        }
    }
    Connectivity sum;
    for (auto& [body, own] : cells) {
        if (grid.periodic())
            turn_to_gap(grid.cells_x, own);
        Map(own).add_to(sum);
    }
    return sum;
}

double share_in_other_cells(const Grid& grid, const Particles& start, const Particles& now) {
    std::vector<Cell> cells(start.size());
    for (std::size_t p = 0; p < start.size(); ++p)
        cells[static_cast<std::size_t>(start.id[p])] = cell_of(grid, start.x[p], start.y[p]);
    std::size_t moved = 0;
    for (std::size_t p = 0; p < now.size(); ++p) {
        const Cell &before = cells[static_cast<std::size_t>(now.id[p])], after = cell_of(grid, now.x[p], now.y[p]);
        moved += before.i != after.i || before.j != after.j ? 1 : 0;
    }
    return static_cast<double>(moved) / static_cast<double>(std::max<std::size_t>(now.size(), 1));
}

double farthest_from_fixed_side(const Grid& grid, const Particles& start, const Particles& now) {
    const auto held = [&](std::size_t p) {
        const double x = (start.x[p] - grid.left) / grid.dx(), y = (start.y[p] - grid.bottom) / grid.dy();
        constexpr auto fixed = SideCondition::fixed;
        return (grid.sides.left == fixed && x < 1.0) || (grid.sides.right == fixed && x > grid.cells_x - 1.0) ||
               (grid.sides.bottom == fixed && y < 1.0) || (grid.sides.top == fixed && y > grid.cells_y - 1.0);
    };
    std::vector<std::ptrdiff_t> place(start.size(), -1); // of those that are held, by number
    for (std::size_t p = 0; p < start.size(); ++p)
        if (held(p))
            place[static_cast<std::size_t>(start.id[p])] = static_cast<std::ptrdiff_t>(p);
    double farthest = 0.0;
    for (std::size_t p = 0; p < now.size(); ++p)
        if (const std::ptrdiff_t before = place[static_cast<std::size_t>(now.id[p])]; before >= 0) {
            const auto b = static_cast<std::size_t>(before);
            farthest = std::max(farthest, std::hypot((now.x[p] - start.x[b]) / grid.dx(), (now.y[p] - start.y[b]) / grid.dy()));
        }
    return farthest;
}

double largest_change_of_density(const Particles& start, const Particles& now) {
    std::vector<double> density(start.size());
    for (std::size_t p = 0; p < start.size(); ++p)
        density[static_cast<std::size_t>(start.id[p])] = start.density[p];
    double largest = 1.0;
    for (std::size_t p = 0; p < now.size(); ++p)
        if (const double ratio = now.density[p] / density[static_cast<std::size_t>(now.id[p])];
            !(std::abs(std::log(ratio)) <= std::abs(std::log(largest))))
            largest = ratio;
    return largest;
}

PressureOscillation pressure_oscillation(const Grid& grid, const Particles& particles) {
    struct Mean {
        double volume = 0.0, pressure = 0.0, x = 0.0, y = 0.0;
    };
    std::vector<Mean> means(static_cast<std::size_t>(grid.cells_x) * static_cast<std::size_t>(grid.cells_y));
    const auto at = [&](int i, int j) -> Mean& { return means[static_cast<std::size_t>(j) * grid.cells_x + i]; };
    const auto pressure = [&](std::size_t p) {
        return (particles.stress_xx[p] + particles.stress_yy[p] + particles.stress_zz[p]) / -3.0;
    };
    for (std::size_t p = 0; p < particles.size(); ++p) {
        const Cell c = cell_of(grid, particles.x[p], particles.y[p]);
        Mean& mean = at(c.i, c.j);
        const double volume = particles.mass[p] / particles.density[p];
        mean.volume += volume;
        mean.pressure += volume * pressure(p);
        mean.x += volume * particles.x[p];
        mean.y += volume * particles.y[p];
    }
    for (Mean& mean : means)
        if (mean.volume > 0.0) {
            mean.pressure /= mean.volume;
            mean.x /= mean.volume;
            mean.y /= mean.volume;
        }
    // from cells on both sides, else from none
    const auto slope = [&](const Mean* before, const Mean* after, double Mean::*place) {
        return before && after && before->volume > 0.0 && after->volume > 0.0
                   ? (after->pressure - before->pressure) / (after->*place - before->*place)
                   : 0.0;
    };
    double oscillation = 0.0, shear = 0.0, whole = 0.0;
    for (std::size_t p = 0; p < particles.size(); ++p) {
        const auto [i, j] = cell_of(grid, particles.x[p], particles.y[p]);
        const Mean& mean = at(i, j);
        const double slope_x = slope(i > 0 ? &at(i - 1, j) : nullptr, i + 1 < grid.cells_x ? &at(i + 1, j) : nullptr, &Mean::x);
        const double slope_y = slope(j > 0 ? &at(i, j - 1) : nullptr, j + 1 < grid.cells_y ? &at(i, j + 1) : nullptr, &Mean::y);
        const double rest =
            pressure(p) - mean.pressure - slope_x * (particles.x[p] - mean.x) - slope_y * (particles.y[p] - mean.y);
        const double q = equivalent_stress(stress_of(particles, p));
        const double volume = particles.mass[p] / particles.density[p];
        oscillation += volume * rest * rest;
        shear += volume * q * q;
        whole += volume;
    }
    return {std::sqrt(oscillation / whole), std::sqrt(shear / whole)};
}

} // namespace ductile::mpm
