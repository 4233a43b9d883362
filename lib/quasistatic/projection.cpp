// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/timer.hpp>
#include <ductile/material/point_rates.hpp>
#include <ductile/quasistatic/projection.hpp>

#include <cmath>

namespace ductile::quasistatic {

namespace {

/// Sum of squares over all cells and components, of `a` less `b` if there is one.
double square_of(const StressField& a, const StressField* b) {
    double sum = 0.0;
    for (const auto component : {&StressField::p, &StressField::s, &StressField::tau, &StressField::q})
        for (int j = 0; j < (a.*component).rows(); ++j)
            for (int i = 0; i < (a.*component).columns(); ++i) {
                const double difference = (a.*component)(i, j) - (b ? (b->*component)(i, j) : 0.0);
                sum += difference * difference;
            }
    return sum;
}

} // namespace

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

double put_into_equilibrium(const Scene& scene, Space& space, double time, CellState& cells) {
    const StressField given = cells.stress;
    VectorField force = space.make_velocity();
    space.divergence(given, -1.0, force);
    (void)Projection(scene, space).apply(force, {}, 1.0, cells);
    bring_to_load(scene, space, time, cells);
    const double square = square_of(given, nullptr);
    return square > 0.0 ? std::sqrt(square_of(cells.stress, &given) / square) : 0.0;
}

} // namespace ductile::quasistatic
