#include <ductile/mpm/kernels.hpp>

namespace ductile::mpm {

std::unique_ptr<Discretisation> make_discretisation(const Scene& scene) {
    switch (scene.shape) {
    case ShapeFunction::linear:
        return make_kernels<Linear>(scene);
    case ShapeFunction::gimp:
        return make_kernels<Gimp>(scene);
    case ShapeFunction::bspline:
        break;
    }
    return make_kernels<BSpline>(scene);
}

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

} // namespace ductile::mpm
