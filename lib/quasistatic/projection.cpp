#include <ductile/base/threads.hpp>
#include <ductile/base/timer.hpp>
#include <ductile/material/point_rates.hpp>
#include <ductile/quasistatic/projection.hpp>
#include <ductile/space/staggered.hpp>

#include <algorithm>
#include <cmath>

namespace ductile::quasistatic {

namespace {

/// Adds dt C : (D(phi) + wall) to cell row j; returns the row's sum of sbar_P^2/mu^2 + p_P^2/(K mu).
double correct_row(const Scene& scene, const VectorField& phi, const StressComponents<Pack>& wall_rate, double dt, int j,
                   StressField& stress) {
    const Grid& grid = scene.grid;
    const IsotropicElasticity& c = scene.law->elasticity();
    const double half_inverse_dx = 0.5 / grid.dx(), half_inverse_dy = 0.5 / grid.dy();
    const Pack deviatoric_weight(dt * dt / (c.shear_modulus * c.shear_modulus));
    const Pack pressure_weight(dt * dt / (c.bulk_modulus * c.shear_modulus));
    Pack sum(0.0);
    for (int i = 0; i < grid.cells_x; i += pack_size) {
        const Corners u(phi.u.row(j) + i, phi.u.row(j + 1) + i);
        const Corners v(phi.v.row(j) + i, phi.v.row(j + 1) + i);
        const StressComponents<Pack> rate = elastic_rate(c, velocity_gradient(u, v, half_inverse_dx, half_inverse_dy));
        const auto add = [&](Field& field, const Pack& correction, const Pack& wall) {
            double* f = field.row(j) + i;
            store(load(f) + Pack(dt) * (correction + wall), f);
        };
        add(stress.p, rate.p, wall_rate.p);
        add(stress.s, rate.s, wall_rate.s);
        add(stress.tau, rate.tau, wall_rate.tau);
        add(stress.q, rate.q, wall_rate.q);

        Pack measure = deviatoric_weight * (rate.s * rate.s + rate.tau * rate.tau + Pack(3.0) * (rate.q * rate.q)) +
                       pressure_weight * (rate.p * rate.p);
        if (i + pack_size > grid.cells_x) // lanes beyond the last column hold copies
            measure = select(Pack::counting_from(i) < Pack(static_cast<double>(grid.cells_x)), measure, Pack(0.0));
        sum = sum + measure;
    }
    for (Field* f : {&stress.p, &stress.s, &stress.tau, &stress.q})
        f->wrap_row(j);
    return sum_of(sum);
}

} // namespace

Projection::Projection(const Scene& scene, EquilibriumSolver& solver)
    : scene_(&scene), solver_(&solver), row_measure_(static_cast<std::size_t>(scene.grid.cells_y)) {}

double Projection::apply(VectorField& force, const WallVelocity& wall, double dt, CellState& cells) {
    Timer timer;
    solver_->solve(force, WallData::zero);
    ++solves_;
    solve_seconds_ += timer.lap();

    const double half_height = 0.5 * scene_->grid.height;
    const StressComponents<Pack> wall_rate =
        elastic_rate(scene_->law->elasticity(),
                     VelocityGradient<Pack>{Pack(0.0), Pack(wall.u / half_height), Pack(0.0), Pack(wall.v / half_height)});
    for_each_row({scene_->grid.cells_y, scene_->grid.cells_x}, [&](int j) {
        row_measure_[static_cast<std::size_t>(j)] = correct_row(*scene_, force, wall_rate, dt, j, cells.stress);
    });

    double sum = 0.0; // row after row, so that the result does not depend on the number of threads
    for (const double row : row_measure_)
        sum += row;
    update_seconds_ += timer.lap();
    return std::sqrt(sum * scene_->grid.cell_area() / scene_->grid.area());
}

double Projection::measure_of(const WallVelocity& wall, double dt) const {
    const double half_height = 0.5 * scene_->grid.height;
    const IsotropicElasticity& c = scene_->law->elasticity();
    const StressComponents<double> rate =
        elastic_rate(c, VelocityGradient<double>{0.0, wall.u / half_height, 0.0, wall.v / half_height});
    return dt / c.shear_modulus *
           std::sqrt(rate.s * rate.s + rate.tau * rate.tau + 3.0 * rate.q * rate.q +
                     c.shear_modulus / c.bulk_modulus * rate.p * rate.p);
}

double equilibrium_residual(const Scene& scene, const CellState& cells, VectorField& force) {
    const Grid& grid = scene.grid;
    struct Largest {
        double force = 0.0, stress = 0.0;
    };
    const auto visit = [&](int j, Largest& largest) {
        Pack force_here(0.0), stress_here(0.0);
        if (j > 0)
            divergence_row(grid, cells.stress, 1.0, j, force);
        for (int i = 0; i < grid.cells_x; i += pack_size) {
            if (j > 0)
                force_here =
                    maximum(force_here, maximum(magnitude(load(force.u.row(j) + i)), magnitude(load(force.v.row(j) + i))));
            const Pack p = load(cells.stress.p.row(j) + i), s = load(cells.stress.s.row(j) + i),
                       tau = load(cells.stress.tau.row(j) + i), q = load(cells.stress.q.row(j) + i);
            stress_here = maximum(maximum(stress_here, magnitude(tau)), maximum(magnitude(s - p - q), magnitude(p + s + q)));
        }
        largest.force = std::max(largest.force, largest_of(force_here));
        largest.stress = std::max(largest.stress, largest_of(stress_here));
    };
    const auto merge = [](Largest& total, const Largest& part) {
        total.force = std::max(total.force, part.force);
        total.stress = std::max(total.stress, part.stress);
    };
    const Largest largest = gather_rows(Rows{grid.cells_y, grid.cells_x}, Largest{}, visit, merge);
    return largest.stress > 0.0 ? largest.force / (largest.stress * std::max(grid.dx(), grid.dy())) : 0.0;
}

} // namespace ductile::quasistatic
