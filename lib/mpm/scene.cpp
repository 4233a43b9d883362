#include <ductile/base/error.hpp>
#include <ductile/mpm/scene.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace ductile::mpm {

bool is_linear(const Scene& scene) {
    return !scene.finite_rotation && std::all_of(scene.materials.begin(), scene.materials.end(), [](const Material& material) {
        return std::visit([](const auto& law) { return law.linear; }, material.law);
    });
}

double fastest_wave(const Scene& scene, const Particles& particles) {
    std::vector<double> modulus;
    for (const Material& material : scene.materials) {
        const IsotropicElasticity e = std::visit([](const auto& law) { return law.elasticity(); }, material.law);
        modulus.push_back(scene.geometry == Geometry::plane_stress ? e.alpha() - e.beta() * e.beta() / e.alpha() : e.alpha());
    }
    double largest = 0.0;
    for (std::size_t p = 0; p < particles.size(); ++p)
        largest = std::max(largest, modulus[static_cast<std::size_t>(particles.material[p])] / particles.density[p]);
    return std::sqrt(largest);
}

double largest_wave_speed(const Scene& scene, const Particles& particles) {
    std::vector<double> young;
    for (const Material& material : scene.materials)
        young.push_back(std::visit([](const auto& law) { return young_modulus(law.elasticity()); }, material.law));
    double largest = 0.0;
    for (std::size_t p = 0; p < particles.size(); ++p)
        largest = std::max(largest, young[static_cast<std::size_t>(particles.material[p])] / particles.density[p]);
    return std::sqrt(largest);
}

void check(const Scene& scene, const Particles& particles) {
    check(scene.grid, scene.geometry);
    if (particles.size() == 0)
        throw InputError("the scene has no deformable particle: add a body");
    if (particles.size() > 2'000'000'000)
        throw InputError(fmt::format("the scene has {} particles: at most 2000000000 are possible", particles.size()));
    for (std::size_t p = 0; p < particles.size(); ++p) {
        if (particles.material[p] < 0 || particles.material[p] >= static_cast<std::int64_t>(scene.materials.size()))
            throw InputError(fmt::format("particle {} is of material {}, but the scene has {} materials", particles.id[p],
                                         particles.material[p], scene.materials.size()));
        if (scene.shape == ShapeFunction::gimp &&
            !(particles.half_width[p] > 0.0 && particles.half_width[p] <= 0.5 * scene.grid.dx() &&
              particles.half_height[p] > 0.0 && particles.half_height[p] <= 0.5 * scene.grid.dy()))
            throw InputError(fmt::format("particle {} is {} x {} m wide: GIMP needs particles no wider than a cell",
                                         particles.id[p], 2.0 * particles.half_width[p], 2.0 * particles.half_height[p]));
    }
}

} // namespace ductile::mpm
