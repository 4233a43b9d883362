// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/timer.hpp>
#include <ductile/material/point_rates.hpp>
#include <ductile/quasistatic/projection.hpp>

#include <cmath>

namespace ductile::quasistatic {

Projection::Projection(const Scene& scene, Space& space) : scene_(scene), space_(space) {}

double Projection::apply(VectorField& force, const WallVelocity& wall, double dt, CellState& cells) {
    Timer timer;
    space_.solve(force, WallData::zero);
    ++solves_;
    solve_seconds_ += timer.lap();
    const double measure = space_.correct(force, wall, dt, cells.stress);
    update_seconds_ += timer.lap();
    return measure;
}

double Projection::measure_of(const WallVelocity& wall, double dt) const {
    const double half_height = 0.5 * scene_.grid.height;
    const IsotropicElasticity& c = scene_.law->elasticity();
    const StressComponents<double> rate =
        elastic_rate(c, VelocityGradient<double>{0.0, wall.u / half_height, 0.0, wall.v / half_height});
    return dt / c.shear_modulus *
           std::sqrt(rate.s * rate.s + rate.tau * rate.tau + 3.0 * rate.q * rate.q +
                     c.shear_modulus / c.bulk_modulus * rate.p * rate.p);
}

} // namespace ductile::quasistatic
