#include <ductile/base/threads.hpp>
#include <ductile/base/timer.hpp>
#include <ductile/quasistatic/cell_rates.hpp>
#include <ductile/quasistatic/method_of_lines.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace ductile::quasistatic {

namespace {

/// f everywhere and -B^T f on the interior corner rows; returns the largest relaxation rate 2 mu dD^pl/dsbar.
template <bool transported>
double sweep(const Scene& scene, const CellState& cells, const VectorField& velocity, CellState& rate, VectorField& force) {
    const auto visit = [&](int j, double& relaxation) {
        store_sources<false, transported>(scene, cells, velocity, j, rate);
        relaxation = std::max(relaxation, scene.law->add_flow_rates(scene.grid.cells_x, flow_rows(cells, j), flow_rows(rate, j)));
        for (Field* f : {&rate.stress.p, &rate.stress.s, &rate.stress.tau, &rate.stress.q})
            f->wrap_row(j);
    };
    return sweep_rows(
        Rows{scene.grid.cells_y, scene.grid.cells_x}, 0.0, visit,
        [&](int j) { divergence_row(scene.grid, rate.stress, -1.0, j, force); },
        [](double& total, double part) { total = std::max(total, part); });
}

struct Comparison {
    double change = 0.0;       ///< largest difference of a component to the guess
    double courant_rate = 0.0; ///< largest |u|/dx + |v|/dy
};

/// Adds the affine motion of the walls to a velocity that vanishes there, and compares it with `guess`.
Comparison add_walls_and_compare(const Grid& grid, const WallVelocity& wall, const VectorField& guess, VectorField& velocity) {
    const auto visit = [&](int j, Comparison& largest) {
        const double y = static_cast<double>(2 * j - grid.cells_y) / grid.cells_y;
        const Pack shift_u(wall.u * y), shift_v(wall.v * y), inverse_dx(1.0 / grid.dx()), inverse_dy(1.0 / grid.dy());
        double *u = velocity.u.row(j), *v = velocity.v.row(j);
        const double *old_u = guess.u.row(j), *old_v = guess.v.row(j);
        Pack change(0.0), rate(0.0);
        for (int i = 0; i < grid.cells_x; i += pack_size) {
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
    return gather_rows(Rows{grid.cells_y + 1, grid.cells_x}, Comparison{}, visit, [](Comparison& total, const Comparison& part) {
        total.change = std::max(total.change, part.change);
        total.courant_rate = std::max(total.courant_rate, part.courant_rate);
    });
}

} // namespace

MethodOfLines::MethodOfLines(const Scene& scene, EquilibriumSolver& solver, const PassOptions& passes)
    : scene_(scene), solver_(solver), passes_(passes), next_velocity_(scene.grid), speed_scale_(0.0) {
    for (const WallControl* control : {&scene.walls.shear, &scene.walls.opening})
        if (control->by == WallControl::By::velocity)
            for (const auto& knot : control->history.knots())
                speed_scale_ = std::max(speed_scale_, std::abs(knot.value));
    if (speed_scale_ == 0.0 && !scene.walls.by_traction())
        speed_scale_ = 1.0; // walls at rest for ever: any scale will do
}

double MethodOfLines::sweep_rates(CellState& cells, const VectorField& velocity, CellState& rate) {
    return scene_.model == Model::full ? sweep<true>(scene_, cells, velocity, rate, next_velocity_)
                                       : sweep<false>(scene_, cells, velocity, rate, next_velocity_);
}

void MethodOfLines::open_rate(CellState& cells, const VectorField& velocity, CellState& rate) {
    Timer timer;
    if (scene_.model == Model::full)
        extrapolate_to_ghost_rows(cells);
    (void)sweep_rates(cells, velocity, rate);
    ++evaluations_;
    rate_seconds_ += timer.lap();
}

RateReport MethodOfLines::evaluate(CellState& cells, const WallRates& told, VectorField& velocity, CellState& rate) {
    const bool transported = scene_.model == Model::full;
    if (transported)
        extrapolate_to_ghost_rows(cells);
    ++evaluations_;

    RateReport report;
    double contraction = passes_.contraction, previous_change = 0.0;
    while (true) {
        Timer timer;
        report.largest_relaxation = sweep_rates(cells, velocity, rate);
        rate.wall = wall_velocity(scene_, told, rate.stress);
        rate_seconds_ += timer.lap();
        solver_.solve(next_velocity_, WallData::zero);
        ++report.solves;
        ++solves_;
        solve_seconds_ += timer.lap();
        const Comparison comparison = add_walls_and_compare(scene_.grid, rate.wall, velocity, next_velocity_);
        double scale = speed_scale_;
        if (scene_.walls.by_traction()) // nobody knows beforehand how fast they will be
            scale = std::max(scale, comparison.courant_rate * std::min(scene_.grid.dx(), scene_.grid.dy()));
        report.velocity_change = scale > 0.0 ? comparison.change / scale : 0.0;
        report.courant_rate = transported ? comparison.courant_rate : 0.0;
        std::swap(velocity, next_velocity_);
        rate_seconds_ += timer.lap();

        if (!transported || report.solves >= passes_.largest)
            return report;
        if (report.solves > 1 && previous_change > 0.0)
            contraction = std::max(contraction, report.velocity_change / previous_change);
        // the transport in f still sees the velocity before this pass: its error is about contraction * change
        if (contraction * report.velocity_change < passes_.tolerance)
            return report;
        previous_change = report.velocity_change;
    }
}

namespace {

/// Largest (sbar/yield stress)^2 in row j of the state cells + dt rate.
double yield_square(const Scene& scene, const CellState& cells, double dt, const CellState& rate, int j) {
    constexpr int chunk = 4 * row_unit;
    std::array<std::array<double, chunk>, 1 + most_variables> values; // of the internal variables, and the yield stress
    std::array<const double*, most_variables> internal;
    double* const yield = values.back().data();
    Pack square(0.0);
    for (int first = 0; first < scene.grid.cells_x; first += chunk) {
        const int count = std::min(chunk, scene.grid.cells_x - first);
        const auto at = [&](const Field& value, const Field& slope, int i) __attribute__((DUCTILE_ALWAYS_INLINE)) {
            return load(value.row(j) + first + i) + Pack(dt) * load(slope.row(j) + first + i);
        };
        for (std::size_t k = 0; k < cells.internal.size(); ++k) {
            internal[k] = values[k].data();
            for (int i = 0; i < count; i += pack_size)
                store(at(cells.internal[k], rate.internal[k], i), values[k].data() + i);
        }
        scene.law->yield_stress(count, internal.data(), yield);
        for (int i = 0; i < count; i += pack_size) {
            const std::array<Pack, 3> y{at(cells.stress.s, rate.stress.s, i), at(cells.stress.tau, rate.stress.tau, i),
                                        at(cells.stress.q, rate.stress.q, i)};
            const Pack limit = load(yield + i);
            // a law without elastic range is always above yield
            square = maximum(square, select(limit > Pack(0.0), deviatoric_square(y) / (limit * limit),
                                            Pack(std::numeric_limits<double>::infinity())));
        }
    }
    return largest_of(square);
}

} // namespace

double yield_ratio(const Scene& scene, const CellState& cells, double dt, const CellState& rate) {
    return std::sqrt(gather_rows(
        Rows{scene.grid.cells_y, scene.grid.cells_x}, 0.0,
        [&](int j, double& largest) { largest = std::max(largest, yield_square(scene, cells, dt, rate, j)); },
        [](double& total, double part) { total = std::max(total, part); }));
}

} // namespace ductile::quasistatic
