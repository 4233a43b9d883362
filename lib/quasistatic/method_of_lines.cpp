#include <ductile/base/threads.hpp>
#include <ductile/base/timer.hpp>
#include <ductile/quasistatic/cell_rates.hpp>
#include <ductile/quasistatic/method_of_lines.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace ductile::quasistatic {

namespace {

/// f at a batch of cells; returns the largest relaxation rate 2 mu dD^pl/dsbar.
template <bool transported, class M>
[[gnu::DUCTILE_ALWAYS_INLINE]] inline Pack rate_at(const Scene& scene, const M& model, const CellState& cells,
                                                   const VectorField& velocity, int i, int j, CellState& rate) {
    const auto [p_source, source] = cell_sources<false, transported>(scene, cells, velocity, i, j);
    const FlowState<Pack> y{load(cells.stress.s.row(j) + i), load(cells.stress.tau.row(j) + i), load(cells.stress.q.row(j) + i),
                            load(cells.internal.row(j) + i)};
    const Pack two_mu(2.0 * scene.elasticity.shear_modulus);
    FlowState<Pack> slope = source;
    Pack relaxation(0.0);
    const Pack sbar = deviatoric_magnitude(y);
    if (any_of(!(sbar < model.yield_stress(y[3])))) { // not a number counts as plastic and is found out later
        slope = FlowRate<M, Pack>{model, two_mu, source}(y);
        relaxation = two_mu * model.flow_slope(sbar, y[3]);
    }
    store(p_source, rate.stress.p.row(j) + i);
    store(slope[0], rate.stress.s.row(j) + i);
    store(slope[1], rate.stress.tau.row(j) + i);
    store(slope[2], rate.stress.q.row(j) + i);
    store(slope[3], rate.internal.row(j) + i);
    return relaxation;
}

/// f everywhere and -B^T f on the interior corner rows.
template <bool transported, class M>
double sweep(const Scene& scene, const M& model, const CellState& cells, const VectorField& velocity, CellState& rate,
             VectorField& force) {
    const auto visit = [&](int j, Pack& relaxation) {
        for (int i = 0; i < scene.grid.cells_x; i += pack_size)
            relaxation = maximum(relaxation, rate_at<transported>(scene, model, cells, velocity, i, j, rate));
        for (Field* f : {&rate.stress.p, &rate.stress.s, &rate.stress.tau, &rate.stress.q})
            f->wrap_row(j);
    };
    return largest_of(sweep_rows(
        Rows{scene.grid.cells_y, scene.grid.cells_x}, Pack(0.0), visit,
        [&](int j) { divergence_row(scene.grid, rate.stress, -1.0, j, force); },
        [](Pack& total, const Pack& part) { total = maximum(total, part); }));
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

/// The ghost rows that transport reads.
void close_at_walls(const Scene& scene, CellState& cells) {
    if (scene.model == Model::full)
        for (Field* f : {&cells.stress.p, &cells.stress.s, &cells.stress.tau, &cells.stress.q, &cells.internal})
            extrapolate_to_ghost_rows(*f);
}

} // namespace

MethodOfLines::MethodOfLines(const Scene& scene, EquilibriumSolver& solver, const PassOptions& passes)
    : scene_(scene), solver_(solver), passes_(passes), next_velocity_(scene.grid), speed_scale_(0.0) {
    for (const WallKnot& knot : scene.walls.knots())
        speed_scale_ = std::max({speed_scale_, std::abs(knot.velocity.u), std::abs(knot.velocity.v)});
    if (speed_scale_ == 0.0)
        speed_scale_ = 1.0; // walls at rest for ever: any scale will do
}

double MethodOfLines::sweep_rates(CellState& cells, const VectorField& velocity, CellState& rate) {
    return std::visit(
        [&](const auto& model) {
            return scene_.model == Model::full ? sweep<true>(scene_, model, cells, velocity, rate, next_velocity_)
                                               : sweep<false>(scene_, model, cells, velocity, rate, next_velocity_);
        },
        scene_.plasticity);
}

void MethodOfLines::open_rate(CellState& cells, const VectorField& velocity, CellState& rate) {
    Timer timer;
    close_at_walls(scene_, cells);
    (void)sweep_rates(cells, velocity, rate);
    ++evaluations_;
    rate_seconds_ += timer.lap();
}

RateReport MethodOfLines::evaluate(CellState& cells, const WallVelocity& wall, VectorField& velocity, CellState& rate) {
    const bool transported = scene_.model == Model::full;
    close_at_walls(scene_, cells);
    ++evaluations_;

    RateReport report;
    double contraction = passes_.contraction, previous_change = 0.0;
    while (true) {
        Timer timer;
        report.largest_relaxation = sweep_rates(cells, velocity, rate);
        rate_seconds_ += timer.lap();
        solver_.solve(next_velocity_, WallData::zero);
        ++report.solves;
        ++solves_;
        solve_seconds_ += timer.lap();
        const Comparison comparison = add_walls_and_compare(scene_.grid, wall, velocity, next_velocity_);
        report.velocity_change = comparison.change / speed_scale_;
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
template <class M> double yield_square(const M& model, const CellState& cells, double dt, const CellState& rate, int j) {
    const auto at = [&](const Field& value, const Field& slope, int i) __attribute__((DUCTILE_ALWAYS_INLINE)) {
        return load(value.row(j) + i) + Pack(dt) * load(slope.row(j) + i);
    };
    Pack square(0.0);
    for (int i = 0; i < cells.internal.columns(); i += pack_size) {
        const FlowState<Pack> y{at(cells.stress.s, rate.stress.s, i), at(cells.stress.tau, rate.stress.tau, i),
                                at(cells.stress.q, rate.stress.q, i), at(cells.internal, rate.internal, i)};
        const Pack yield = model.yield_stress(y[3]);
        // a model without elastic range is always above yield
        square = maximum(square, select(yield > Pack(0.0), deviatoric_square(y) / (yield * yield),
                                        Pack(std::numeric_limits<double>::infinity())));
    }
    return largest_of(square);
}

template <class M> double yield_square(const M& model, const CellState& cells, double dt, const CellState& rate) {
    return gather_rows(
        Rows{cells.internal.rows(), cells.internal.columns()}, 0.0,
        [&](int j, double& largest) { largest = std::max(largest, yield_square(model, cells, dt, rate, j)); },
        [](double& total, double part) { total = std::max(total, part); });
}

} // namespace

double yield_ratio(const Scene& scene, const CellState& cells, double dt, const CellState& rate) {
    return std::sqrt(std::visit([&](const auto& model) { return yield_square(model, cells, dt, rate); }, scene.plasticity));
}

} // namespace ductile::quasistatic
