// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/threads.hpp>
#include <ductile/material/point_rates.hpp>
#include <ductile/space/row_kernels.hpp>
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
constexpr double smallest_bend_of_unit = 1e-3 * 1e-3;

SmallestBends smallest_bends(const Law& law) {
    SmallestBends squares;
    squares.fill(smallest_bend_of_unit);
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

/// At the pack of cells from column i of row j on.
[[gnu::DUCTILE_ALWAYS_INLINE]] inline auto gradients_of_row(const Grid& grid, const VectorField& velocity, int j) {
    return [&, j ](int i) __attribute__((DUCTILE_ALWAYS_INLINE)) {
        const Corners u(velocity.u.row(j) + i, velocity.u.row(j + 1) + i);
        const Corners v(velocity.v.row(j) + i, velocity.v.row(j + 1) + i);
        return velocity_gradient(u, v, 0.5 / grid.dx(), 0.5 / grid.dy());
    };
}

class StaggeredSpace final : public Space {
public:
    StaggeredSpace(const Grid& grid, const Medium& medium, const SpaceOptions& options)
        : Space(grid, medium, uniform_rows(grid)), advection_(options.advection), bends_(smallest_bends(medium.law)),
          solver_(make_equilibrium_solver({.grid = grid, .elasticity = medium.law->elasticity(), .stiffness = options.stiffness},
                                          options.solver)) {}

    void solve(VectorField& force, WallData walls) override { solver_->solve(force, walls); }
    void divergence(const StressField& stress, double factor, VectorField& force) const override {
        ductile::divergence(grid(), stress, factor, force);
    }
    void close(const VectorField& velocity, CellState& rate) const override;
    void combine(std::span<const Term> terms, const OpenRate& open, CellState& out) const override;
    using Space::combine;
    [[nodiscard]] double wall_power(const StressField& stress, const Velocity& upper) const override;
    double correct(const VectorField& phi, const Velocity& wall, double dt, StressField& stress) override;
    void at_points(const VectorField& velocity, Field& u, Field& v) const override;
    void advect(std::span<Field> fields, const VectorField& velocity, std::span<Field> rates) const override;
    [[nodiscard]] std::size_t memory_bytes() const override { return solver_->memory_bytes(); }

    void prepare_transport(CellState& cells) const override { extrapolate_to_ghost_rows(cells); }
    /// Linear.
    [[nodiscard]] Interpolation interpolation(At at, const std::vector<double>& x, const std::vector<double>& y) const override {
        return {periodic_linear_weights(grid().cells_x, at == At::cells ? 0.5 : 0.0, x),
                linear_weights(at == At::cells ? rows().cell : rows().node, y)};
    }

protected:
    using Space::unresolved;
    [[nodiscard]] Unresolved unresolved(const Field& field) const override;
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
        Rows{grid().cells_y, grid().cells_x}, 0, visit,
        [&](int j) {
            if (factor != 0.0)
                divergence_row(grid(), sources.stress, factor, j, force);
        },
        [](int&, int) {});
}

void StaggeredSpace::close(const VectorField& velocity, CellState& rate) const {
    for_each_row({grid().cells_y, grid().cells_x},
                 [&](int j) { close_row(medium().law->elasticity(), gradients_of_row(grid(), velocity, j), j, rate); });
}

void StaggeredSpace::combine(std::span<const Term> terms, const OpenRate& open, CellState& out) const {
    const OpenTerms all(terms, open);
    for_each_row({grid().cells_y, grid().cells_x}, [&](int j) {
        all.combine_row(medium().law->elasticity(), gradients_of_row(grid(), *open.velocity, j), j, out);
    });
    combine_numbers(all.terms(), out);
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

Unresolved StaggeredSpace::unresolved(const Field& field) const {
    const Pack columns(static_cast<double>(grid().cells_x));
    const auto visit = [&](int j, Unresolved& largest) {
        Pack square_x(0.0), square_y(0.0), square(0.0);
        const auto fourth = [](const Pack& a, const Pack& b, const Pack& c, const Pack& d, const Pack& e) {
            return Pack(0.0625) * (a + e) - Pack(0.25) * (b + d) + Pack(0.375) * c;
        };
        const int to_wall = std::min(j, grid().cells_y - 1 - j), far = std::min(to_wall, 2), near = std::min(to_wall, 1);
        const double *here = field.row(j), *lower = field.row(j - far), *below = field.row(j - near),
                     *above = field.row(j + near), *upper = field.row(j + far);
        for (int i = 0; i < grid().cells_x; i += pack_size) {
            const Pack value = load(here + i);
            const Pack x = fourth(load(here + i - 2), load(here + i - 1), value, load(here + i + 1), load(here + i + 2));
            const Pack y = far == near ? Pack(0.25) * (load(below + i) - Pack(2.0) * value + load(above + i))
                                       : fourth(load(lower + i), load(below + i), value, load(above + i), load(upper + i));
            const Pack::Mask real = Pack::counting_from(i) < columns;
            square_x = square_x + select(real, x * x, Pack(0.0));
            square_y = square_y + select(real, y * y, Pack(0.0));
            square = square + select(real, value * value, Pack(0.0));
        }
        largest.take({.x = sum_of(square_x), .y = sum_of(square_y), .whole = sum_of(square)});
    };
    const Unresolved squares = gather_rows(Rows{grid().cells_y, grid().cells_x}, Unresolved{}, visit,
                                           [](Unresolved& total, const Unresolved& part) { total.take(part); });
    return {.x = std::sqrt(squares.x / grid().cells_x),
            .y = std::sqrt(squares.y / grid().cells_x),
            .whole = std::sqrt(squares.whole / grid().cells_x)};
}

double StaggeredSpace::correct(const VectorField& phi, const Velocity& wall, double dt, StressField& stress) {
    const IsotropicElasticity& c = medium().law->elasticity();
    for_each_row({grid().cells_y, grid().cells_x}, [&](int j) {
        row_sums()[static_cast<std::size_t>(j)] =
            correct_row(c, gradients_of_row(grid(), phi, j), wall_rate(wall), dt, j, stress);
    });
    return root_mean_of_row_sums();
}

void StaggeredSpace::at_points(const VectorField& velocity, Field& u, Field& v) const {
    for_each_row({grid().cells_y, grid().cells_x}, [&](int j) {
        for (const auto& [corners, cells] : {std::pair{&velocity.u, &u}, std::pair{&velocity.v, &v}})
            for (int i = 0; i < grid().cells_x; i += pack_size)
                store(Corners(corners->row(j) + i, corners->row(j + 1) + i).mean(), cells->row(j) + i);
    });
}

template <Advection advection>
void advect_row(const Grid& grid, std::span<const Field> fields, const VectorField& velocity, int j, std::span<Field> rates) {
    for (int i = 0; i < grid.cells_x; i += pack_size) {
        const Pack u = Corners(velocity.u.row(j) + i, velocity.u.row(j + 1) + i).mean();
        const Pack v = Corners(velocity.v.row(j) + i, velocity.v.row(j + 1) + i).mean();
        for (std::size_t k = 0; k < fields.size(); ++k)
            store(advection_rate<advection>(fields[k].row(j) + i, fields[k].stride(), u, v, 0.5 / grid.dx(), 0.5 / grid.dy(),
                                            smallest_bend_of_unit),
                  rates[k].row(j) + i);
    }
}

void StaggeredSpace::advect(std::span<Field> fields, const VectorField& velocity, std::span<Field> rates) const {
    for (Field& field : fields)
        extrapolate_to_ghost_rows(field);
    const auto row = advection_ == Advection::eno2 ? &advect_row<Advection::eno2> : &advect_row<Advection::weno3>;
    for_each_row({grid().cells_y, grid().cells_x}, [&](int j) { row(grid(), fields, velocity, j, rates); });
}

} // namespace

std::unique_ptr<Space> make_staggered_space(const Grid& grid, const Medium& medium, const SpaceOptions& options) {
    return std::make_unique<StaggeredSpace>(grid, medium, options);
}

} // namespace ductile
