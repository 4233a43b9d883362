// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/threads.hpp>
#include <ductile/material/point_rates.hpp>
#include <ductile/space/staggered.hpp>
#include <ductile/space/terms.hpp>
#include <ductile/space/transport.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace ductile {

namespace {

/// The e of weno3 for every field: a thousandth of the unit that its error is measured in, squared. Where fields bend less from
/// cell to cell the differences are linear, where they bend more they choose a side.
using SmallestBends = std::array<double, stress_fields + most_variables>;

SmallestBends smallest_bends(const Law& law) {
    constexpr double bend = 1e-3;
    SmallestBends squares;
    squares.fill(bend * bend);
    for (std::size_t k = stress_fields; const InternalVariable& variable : law->variables())
        squares[k++] *= variable.natural_scale() * variable.natural_scale();
    return squares;
}

/// What carries a state along.
enum class Carried { not_at_all, by_eno2, by_weno3 };

/// Writes to row j of `sources` the elastic rate C : D(v) (if `elastic`) and spin minus advection by v (if `carried`), whole
/// vectors, images not wrapped. The Jaumann spin, Eq. (5), with (grad v)_ij = dv_i/dx_j reads
/// ds/dt += (du/dy - dv/dx) tau, dtau/dt -= (du/dy - dv/dx) s.
/// Returns the row's sum of sigma : C^-1 : (advection).
template <bool elastic, Carried carried>
double store_sources(const Grid& grid, const IsotropicElasticity& elasticity, const SmallestBends& bends, const CellState& cells,
                     const VectorField& velocity, int j, CellState& sources) {
    constexpr bool transported = carried != Carried::not_at_all;
    constexpr Advection differences = carried == Carried::by_weno3 ? Advection::weno3 : Advection::eno2;
    const double half_inverse_dx = 0.5 / grid.dx(), half_inverse_dy = 0.5 / grid.dy();
    const Pack by_bulk_modulus(1.0 / elasticity.bulk_modulus), by_shear_modulus(1.0 / elasticity.shear_modulus);
    Pack power(0.0);
    for (int i = 0; i < grid.cells_x; i += pack_size) {
        StressComponents<Pack> rate{Pack(0.0), Pack(0.0), Pack(0.0), Pack(0.0)};
        if constexpr (elastic || transported) {
            const Corners u(velocity.u.row(j) + i, velocity.u.row(j + 1) + i);
            const Corners v(velocity.v.row(j) + i, velocity.v.row(j + 1) + i);
            const VelocityGradient<Pack> gradient = velocity_gradient(u, v, half_inverse_dx, half_inverse_dy);
            if constexpr (elastic)
                rate = elastic_rate(elasticity, gradient);
            if constexpr (transported) {
                const Pack uc = u.mean(), vc = v.mean(), turn = gradient.uy - gradient.vx;
                const auto advection = [&](const Field& f, std::size_t k) __attribute__((DUCTILE_ALWAYS_INLINE)) {
                    return advection_rate<differences>(f.row(j) + i, f.stride(), uc, vc, half_inverse_dx, half_inverse_dy,
                                                       bends[k]);
                };
                const Pack p = load(cells.stress.p.row(j) + i), s = load(cells.stress.s.row(j) + i);
                const Pack tau = load(cells.stress.tau.row(j) + i), q = load(cells.stress.q.row(j) + i);
                const Pack p_rate = advection(cells.stress.p, 0), s_rate = advection(cells.stress.s, 1);
                const Pack tau_rate = advection(cells.stress.tau, 2), q_rate = advection(cells.stress.q, 3);
                rate.p = rate.p + p_rate;
                rate.s = rate.s + turn * tau + s_rate;
                rate.tau = rate.tau + tau_rate - turn * s;
                rate.q = rate.q + q_rate;
                Pack here =
                    by_bulk_modulus * (p * p_rate) + by_shear_modulus * (s * s_rate + tau * tau_rate + Pack(3.0) * (q * q_rate));
                if (i + pack_size > grid.cells_x) // lanes beyond the last column hold copies
                    here = select(Pack::counting_from(i) < Pack(static_cast<double>(grid.cells_x)), here, Pack(0.0));
                power = power + here;
                for (std::size_t k = 0; k < cells.internal.size(); ++k)
                    store(advection(cells.internal[k], stress_fields + k), sources.internal[k].row(j) + i);
            }
        }
        store(rate.p, sources.stress.p.row(j) + i);
        store(rate.s, sources.stress.s.row(j) + i);
        store(rate.tau, sources.stress.tau.row(j) + i);
        store(rate.q, sources.stress.q.row(j) + i);
        if constexpr (!transported)
            for (Field& internal : sources.internal)
                store(Pack(0.0), internal.row(j) + i);
    }
    return sum_of(power);
}

[[gnu::DUCTILE_ALWAYS_INLINE]] inline std::array<Pack, stress_fields>
elastic_rate_at(const Grid& grid, const IsotropicElasticity& elasticity, const VectorField& velocity, int i, int j) {
    const Corners u(velocity.u.row(j) + i, velocity.u.row(j + 1) + i);
    const Corners v(velocity.v.row(j) + i, velocity.v.row(j + 1) + i);
    const StressComponents<Pack> rate = elastic_rate(elasticity, velocity_gradient(u, v, 0.5 / grid.dx(), 0.5 / grid.dy()));
    return {rate.p, rate.s, rate.tau, rate.q};
}

/// Adds dt C : (D(phi) + wall) to cell row j; returns the row's sum of sbar_P^2/mu^2 + p_P^2/(K mu).
double correct_row(const Grid& grid, const IsotropicElasticity& c, const VectorField& phi,
                   const StressComponents<Pack>& wall_rate, double dt, int j, StressField& stress) {
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

class StaggeredSpace final : public Space {
public:
    StaggeredSpace(const Grid& grid, const Medium& medium, const SpaceOptions& options)
        : Space(grid, medium), advection_(options.advection), bends_(smallest_bends(medium.law)),
          solver_(make_equilibrium_solver({.grid = grid, .elasticity = medium.law->elasticity(), .stiffness = options.stiffness},
                                          options.solver)) {}

    void solve(VectorField& force, WallData walls) override { solver_->solve(force, walls); }
    void divergence(const StressField& stress, double factor, VectorField& force) const override {
        ductile::divergence(grid(), stress, factor, force);
    }
    [[nodiscard]] double equilibrium_residual(const StressField& stress, VectorField& force) const override;
    void close(const VectorField& velocity, CellState& rate) const override;
    void combine(std::span<const Term> terms, const OpenRate& open, CellState& out) const override;
    using Space::combine;
    [[nodiscard]] double wall_power(const StressField& stress, const Velocity& upper) const override;
    double correct(const VectorField& phi, const Velocity& wall, double dt, StressField& stress) override;
    void add_affine(const Velocity& change, VectorField& velocity) const override;
    VelocityChange add_affine_and_compare(const Velocity& wall, const VectorField& guess, VectorField& velocity) const override;
    [[nodiscard]] std::size_t interior_size() const override {
        return 2 * static_cast<std::size_t>(grid().cells_x) * static_cast<std::size_t>(grid().cells_y - 1);
    }
    void pack_interior(const VectorField& velocity, double factor, std::span<double> values) const override;
    void unpack_interior(std::span<const double> values, double factor, VectorField& velocity) const override;
    void set_walls(const Velocity& upper, VectorField& velocity) const override;
    void at_points(const VectorField& velocity, Field& u, Field& v) const override;
    [[nodiscard]] std::size_t memory_bytes() const override { return solver_->memory_bytes(); }

protected:
    void sweep(const CellState& cells, const VectorField& velocity, bool elastic, CellState& sources, RowKernel kernel,
               double factor, VectorField& force) override;

private:
    Advection advection_;
    SmallestBends bends_;
    std::unique_ptr<EquilibriumSolver> solver_;
};

void StaggeredSpace::sweep(const CellState& cells, const VectorField& velocity, bool elastic, CellState& sources,
                           RowKernel kernel, double factor, VectorField& force) {
    using enum Carried;
    const auto choose = [&]<bool with_elastic>() {
        if (!medium().transported)
            return &store_sources<with_elastic, not_at_all>;
        return advection_ == Advection::eno2 ? &store_sources<with_elastic, by_eno2> : &store_sources<with_elastic, by_weno3>;
    };
    const auto store_row = elastic ? choose.operator()<true>() : choose.operator()<false>();
    const auto visit = [&](int j, int&) {
        kernel(j, store_row(grid(), medium().law->elasticity(), bends_, cells, velocity, j, sources));
    };
    (void)sweep_rows(
        Rows{grid().cells_y, grid().cells_x}, 0, visit, [&](int j) { divergence_row(grid(), sources.stress, factor, j, force); },
        [](int&, int) {});
}

double StaggeredSpace::equilibrium_residual(const StressField& stress, VectorField& force) const {
    struct Largest {
        double force = 0.0, stress = 0.0;
    };
    const auto visit = [&](int j, Largest& largest) {
        Pack force_here(0.0), stress_here(0.0);
        if (j > 0)
            divergence_row(grid(), stress, 1.0, j, force);
        for (int i = 0; i < grid().cells_x; i += pack_size) {
            if (j > 0)
                force_here =
                    maximum(force_here, maximum(magnitude(load(force.u.row(j) + i)), magnitude(load(force.v.row(j) + i))));
            const Pack p = load(stress.p.row(j) + i), s = load(stress.s.row(j) + i), tau = load(stress.tau.row(j) + i),
                       q = load(stress.q.row(j) + i);
            stress_here = maximum(maximum(stress_here, magnitude(tau)), maximum(magnitude(s - p - q), magnitude(p + s + q)));
        }
        largest.force = std::max(largest.force, largest_of(force_here));
        largest.stress = std::max(largest.stress, largest_of(stress_here));
    };
    const auto merge = [](Largest& total, const Largest& part) {
        total.force = std::max(total.force, part.force);
        total.stress = std::max(total.stress, part.stress);
    };
    const Largest largest = gather_rows(Rows{grid().cells_y, grid().cells_x}, Largest{}, visit, merge);
    return largest.stress > 0.0 ? largest.force / (largest.stress * std::max(grid().dx(), grid().dy())) : 0.0;
}

void StaggeredSpace::close(const VectorField& velocity, CellState& rate) const {
    for_each_row({grid().cells_y, grid().cells_x}, [&](int j) {
        for (int i = 0; i < grid().cells_x; i += pack_size) {
            const auto elastic = elastic_rate_at(grid(), medium().law->elasticity(), velocity, i, j);
            for (int k = 0; k < stress_fields; ++k) {
                double* const row = rate.field(k).row(j) + i;
                store(load(row) + elastic[static_cast<std::size_t>(k)], row);
            }
        }
    });
}

void StaggeredSpace::combine(std::span<const Term> terms, const OpenRate& open, CellState& out) const {
    std::array<Term, most_terms> array;
    std::ranges::copy(terms, array.begin());
    array[terms.size()] = {open.fields, open.factor}; // all but the stress is complete
    const std::span<const Term> all = std::span(array).first(terms.size() + 1);
    for_each_row({grid().cells_y, grid().cells_x}, [&](int j) {
        const auto rows = stress_rows_of(terms, j);
        std::array<double*, stress_fields> rate, target;
        for (int k = 0; k < stress_fields; ++k) {
            rate[static_cast<std::size_t>(k)] = open.fields->field(k).row(j);
            target[static_cast<std::size_t>(k)] = out.field(k).row(j);
        }
        for (int i = 0; i < grid().cells_x; i += pack_size) {
            const auto elastic = elastic_rate_at(grid(), medium().law->elasticity(), *open.velocity, i, j);
            for (std::size_t k = 0; k < stress_fields; ++k) {
                const Pack closed = load(rate[k] + i) + elastic[k];
                const Pack sum = sum_terms(terms, rows[k], i) + Pack(open.factor) * closed;
                if (open.close)
                    store(closed, rate[k] + i);
                store(sum, target[k] + i);
            }
        }
        combine_row(all, stress_fields, j, out);
    });
    combine_numbers(all, out);
}

double StaggeredSpace::wall_power(const StressField& stress, const Velocity& upper) const {
    double force_x = 0.0, force_y = 0.0; // of both walls, on either side of a cell
    for (const int j : {0, grid().cells_y - 1})
        for (int i = 0; i < grid().cells_x; ++i) {
            force_x += stress.tau(i, j);
            force_y -= stress.p(i, j) + stress.s(i, j) + stress.q(i, j);
        }
    return grid().dx() * (force_x * upper.u + force_y * upper.v);
}

double StaggeredSpace::correct(const VectorField& phi, const Velocity& wall, double dt, StressField& stress) {
    const double half_height = 0.5 * grid().height;
    const IsotropicElasticity& c = medium().law->elasticity();
    const StressComponents<Pack> wall_rate =
        elastic_rate(c, VelocityGradient<Pack>{Pack(0.0), Pack(wall.u / half_height), Pack(0.0), Pack(wall.v / half_height)});
    for_each_row({grid().cells_y, grid().cells_x},
                 [&](int j) { row_sums()[static_cast<std::size_t>(j)] = correct_row(grid(), c, phi, wall_rate, dt, j, stress); });
    double sum = 0.0; // row after row, so that the result does not depend on the number of threads
    for (int j = 0; j < grid().cells_y; ++j)
        sum += row_sums()[static_cast<std::size_t>(j)];
    return std::sqrt(sum * grid().cell_area() / grid().area());
}

void StaggeredSpace::add_affine(const Velocity& change, VectorField& velocity) const {
    for (int j = 0; j <= grid().cells_y; ++j) {
        const double y = static_cast<double>(2 * j - grid().cells_y) / grid().cells_y;
        for (const auto& [field, amplitude] : {std::pair{&velocity.u, change.u}, std::pair{&velocity.v, change.v}}) {
            if (amplitude == 0.0)
                continue;
            double* row = field->row(j);
            for (int i = 0; i < grid().cells_x; ++i)
                row[i] += amplitude * y;
            field->wrap_row(j);
        }
    }
}

VelocityChange StaggeredSpace::add_affine_and_compare(const Velocity& wall, const VectorField& guess,
                                                      VectorField& velocity) const {
    const auto visit = [&](int j, VelocityChange& largest) {
        const double y = static_cast<double>(2 * j - grid().cells_y) / grid().cells_y;
        const Pack shift_u(wall.u * y), shift_v(wall.v * y), inverse_dx(1.0 / grid().dx()), inverse_dy(1.0 / grid().dy());
        double *u = velocity.u.row(j), *v = velocity.v.row(j);
        const double *old_u = guess.u.row(j), *old_v = guess.v.row(j);
        Pack change(0.0), rate(0.0);
        for (int i = 0; i < grid().cells_x; i += pack_size) {
            const Pack new_u = load(u + i) + shift_u, new_v = load(v + i) + shift_v;
            store(new_u, u + i);
            store(new_v, v + i);
            change = maximum(change, maximum(magnitude(new_u - load(old_u + i)), magnitude(new_v - load(old_v + i))));
            rate = maximum(rate, inverse_dx * magnitude(new_u) + inverse_dy * magnitude(new_v));
        }
        velocity.u.wrap_row(j);
        velocity.v.wrap_row(j);
        largest.change = std::max(largest.change, largest_of(change));
        largest.courant_rate = std::max(largest.courant_rate, largest_of(rate));
    };
    return gather_rows(Rows{grid().cells_y + 1, grid().cells_x}, VelocityChange{}, visit,
                       [](VelocityChange& total, const VelocityChange& part) {
                           total.change = std::max(total.change, part.change);
                           total.courant_rate = std::max(total.courant_rate, part.courant_rate);
                       });
}

void StaggeredSpace::pack_interior(const VectorField& velocity, double factor, std::span<double> values) const {
    auto target = values.begin();
    for (const Field* f : {&velocity.u, &velocity.v})
        for (int j = 1; j < grid().cells_y; ++j)
            target = std::transform(f->row(j), f->row(j) + grid().cells_x, target, [=](double x) { return factor * x; });
}

void StaggeredSpace::unpack_interior(std::span<const double> values, double factor, VectorField& velocity) const {
    auto source = values.begin();
    for (Field* f : {&velocity.u, &velocity.v})
        for (int j = 1; j < grid().cells_y; ++j, source += grid().cells_x) {
            std::transform(source, source + grid().cells_x, f->row(j), [=](double x) { return factor * x; });
            f->wrap_row(j);
        }
}

void StaggeredSpace::set_walls(const Velocity& upper, VectorField& velocity) const {
    for (const auto& [row, sign] : {std::pair{0, -1.0}, std::pair{grid().cells_y, 1.0}})
        for (const auto& [field, value] : {std::pair{&velocity.u, sign * upper.u}, std::pair{&velocity.v, sign * upper.v}}) {
            std::fill_n(field->row(row), grid().cells_x, value);
            field->wrap_row(row);
        }
}

void StaggeredSpace::at_points(const VectorField& velocity, Field& u, Field& v) const {
    for_each_row({grid().cells_y, grid().cells_x}, [&](int j) {
        for (const auto& [corners, cells] : {std::pair{&velocity.u, &u}, std::pair{&velocity.v, &v}})
            for (int i = 0; i < grid().cells_x; i += pack_size)
                store(Corners(corners->row(j) + i, corners->row(j + 1) + i).mean(), cells->row(j) + i);
    });
}

} // namespace

std::unique_ptr<Space> make_staggered_space(const Grid& grid, const Medium& medium, const SpaceOptions& options) {
    return std::make_unique<StaggeredSpace>(grid, medium, options);
}

} // namespace ductile
