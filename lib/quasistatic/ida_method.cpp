// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/quasistatic/rate_system.hpp>
#include <ductile/sundials/ida.hpp>
#include <ductile/time/flat_stages.hpp>

namespace ductile::quasistatic {

namespace {

/// The system of index 1: y = (cells, interior velocity/U, and with walls under force control that of the upper wall/U),
///   0 = d(cells)/dt - f - C : D(v),   0 = B^T (f + C : D(v)) = K v + B^T f,   0 = v_wall - what f asks for (walls.hpp).
class Ida final : public CellMethod {
public:
    Ida(RateSystem& system, double tolerance)
        : system_(system), stages_(system, {.tolerance = tolerance, .poll = end_if_interrupted}), walls_(system.walls()),
          interior_(system.space().interior_size()), velocity_(system.space().make_velocity()), force_(velocity_),
          y_(stages_.size() + interior_ + walls_), rates_(y_.size()),
          ida_({.components = y_.size(),
                .differential = stages_.size(),
                .residual = [this](double t, std::span<const double> y, std::span<const double> rate,
                                   std::span<double> residual) { find_residual(t, y, rate, residual); },
                .precondition = [this](double factor, std::span<const double> r,
                                       std::span<double> z) { precondition(factor, r, z); }},
               {.absolute_tolerance = stages_.component_tolerance()}) {}

    [[nodiscard]] double advance(const time::Step<CellState>& step) override {
        std::ranges::copy(stages_.begin(step), y_.begin());
        scale_ = scale_of(system_.velocity());
        system_.space().pack_interior(system_.velocity(), 1.0 / scale_, interior_of(std::span(y_)));
        pack_wall(step.start_rate.wall, std::span(y_));
        system_.pack(step.start_rate, cells_of(std::span(rates_)));
        std::ranges::fill(std::span(rates_).subspan(stages_.size()), 0.0); // of all that is algebraic
        ida_.integrate(y_, rates_, 0.0, step.dt, stages_.dense(step));
        system_.unpack(cells_of(std::span(y_)), step.next);
        return stages_.finish(step);
    }
    [[nodiscard]] time::InnerCounts inner_counts() const override { return {ida_.counts().steps, ida_.counts().rejected}; }
    [[nodiscard]] int buffers() const override { return stages_.buffers; }

private:
    /// U: the speed of the walls, and if nobody prescribes that, of what moves at the start of the step.
    [[nodiscard]] double scale_of(const VectorField& velocity) const {
        double scale = system_.lines().speed_scale();
        if (walls_ > 0)
            scale = std::max(scale, largest_component(velocity));
        return scale > 0.0 ? scale : 1.0;
    }
    template <class T> [[nodiscard]] std::span<T> cells_of(std::span<T> y) const { return y.first(stages_.size()); }
    template <class T> [[nodiscard]] std::span<T> interior_of(std::span<T> y) const {
        return y.subspan(stages_.size(), interior_);
    }

    void pack_wall(const Velocity& wall, std::span<double> y) const {
        if (walls_ > 0) {
            y[y.size() - 2] = wall.u / scale_;
            y[y.size() - 1] = wall.v / scale_;
        }
    }
    [[nodiscard]] Velocity wall_of(std::span<const double> y) const {
        return walls_ > 0 ? Velocity{scale_ * y[y.size() - 2], scale_ * y[y.size() - 1]} : Velocity{};
    }

    void find_residual(double t, std::span<const double> y, std::span<const double> rate, std::span<double> residual) {
        stages_.poll();
        CellState &cells = stages_.stage(), &complete = stages_.stage_rate();
        system_.unpack(cells_of(y), cells);
        const WallRates told = system_.told(t / system_.step_length());
        const Velocity wall = walls_ > 0 ? wall_of(y) : Velocity{told.shear, told.opening};
        system_.space().unpack_interior(interior_of(y), scale_, velocity_);
        system_.space().set_walls(wall, velocity_);
        system_.lines().open_rate(cells, velocity_, complete);
        const Velocity wanted = wall_velocity(system_.scene(), told, system_.lines().mean_of_open(complete));
        system_.space().close(velocity_, complete);
        complete.wall = wall;
        complete.energy.work = system_.space().wall_power(cells.stress, wall);
        complete.wrap();
        system_.space().divergence(complete.stress, 1.0, force_);
        system_.pack(complete, cells_of(residual));
        std::ranges::transform(rate.first(stages_.size()), residual, residual.begin(), std::minus<>());
        system_.space().pack_interior(force_, 1.0 / scale_, interior_of(residual));
        pack_wall(wall - wanted, residual);
    }

    /// dF/dy without the derivatives of f: K dv = r_v, then derivative_factor d(cells) - C : D(dv) = r.
    void precondition(double derivative_factor, std::span<const double> r, std::span<double> z) {
        const Velocity wall = wall_of(r);
        system_.space().set_walls(wall, force_);
        system_.space().unpack_interior(interior_of(r), scale_, force_);
        system_.solve(force_, walls_ > 0 ? WallData::given : WallData::zero);
        CellState& change = stages_.stage_rate();
        system_.unpack(cells_of(r), change);
        system_.space().close(force_, change);
        change.wall = change.wall + wall;
        system_.pack(change, cells_of(z));
        for (double& value : cells_of(z))
            value /= derivative_factor;
        system_.space().pack_interior(force_, 1.0 / scale_, interior_of(z));
        pack_wall(wall, z);
    }

    RateSystem& system_;
    time::FlatStages<CellState> stages_;
    std::size_t walls_, interior_; ///< unknowns: the velocity of walls under force control
    double scale_ = 1.0;           ///< U
    VectorField velocity_, force_;
    std::vector<double> y_, rates_;
    sundials::IdaIntegrator ida_;
};

} // namespace

std::unique_ptr<CellMethod> make_ida(RateSystem& system, double tolerance) { return std::make_unique<Ida>(system, tolerance); }

} // namespace ductile::quasistatic
