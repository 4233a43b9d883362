#include <ductile/mpm/diagnostics.hpp>

#include <algorithm>
#include <vector>

namespace ductile::mpm {

Energies energies_of(const Scene& scene, const Particles& particles) {
    Energies sum;
    for (std::size_t p = 0; p < particles.size(); ++p) {
        const double vx = particles.velocity_x[p], vy = particles.velocity_y[p], mass = particles.mass[p];
        const SymmetricTensor stress{particles.stress_xx[p], particles.stress_yy[p], particles.stress_zz[p],
                                     particles.stress_xy[p]};
        const auto& law = scene.materials[static_cast<std::size_t>(particles.material[p])].law;
        const SymmetricTensor strain = std::visit([&](const auto& l) { return elastic_strain(l.elasticity(), stress); }, law);
        sum.kinetic += 0.5 * mass * (vx * vx + vy * vy);
        sum.strain += 0.5 * mass / particles.density[p] * contraction(stress, strain);
        sum.internal += mass * particles.energy[p];
    }
    return sum;
}

int enclosed_empty_cells(const Grid& grid, const Particles& particles) {
    std::vector<char> occupied(static_cast<std::size_t>(grid.cells_x) * static_cast<std::size_t>(grid.cells_y), 0);
    const auto cell = [&](int i, int j) -> char& { return occupied[static_cast<std::size_t>(j) * grid.cells_x + i]; };
    for (std::size_t p = 0; p < particles.size(); ++p) {
        const int i = static_cast<int>((particles.x[p] - grid.left) / grid.dx());
        const int j = static_cast<int>((particles.y[p] - grid.bottom) / grid.dy());
        cell(std::clamp(i, 0, grid.cells_x - 1), std::clamp(j, 0, grid.cells_y - 1)) = 1;
    }
    int count = 0;
    for (int j = 0; j < grid.cells_y; ++j)
        for (int i = 0; i < grid.cells_x; ++i) {
            const bool in_row = i > 0 && i < grid.cells_x - 1 && cell(i - 1, j) && cell(i + 1, j);
            const bool in_column = j > 0 && j < grid.cells_y - 1 && cell(i, j - 1) && cell(i, j + 1);
            count += !cell(i, j) && (in_row || in_column) ? 1 : 0;
        }
    return count;
}

} // namespace ductile::mpm
