// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/timer.hpp>
#include <ductile/quasistatic/method_of_lines.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace ductile::quasistatic {

MethodOfLines::MethodOfLines(const Scene& scene, Space& space, const PassOptions& passes)
    : scene_(scene), space_(space), passes_(passes), next_velocity_(space.make_velocity()), speed_scale_(0.0) {
    for (const WallControl* control : {&scene.walls.shear, &scene.walls.opening})
        if (control->by == WallControl::By::velocity)
            for (const auto& knot : control->history.knots())
                speed_scale_ = std::max(speed_scale_, std::abs(knot.value));
    if (speed_scale_ == 0.0 && !scene.walls.by_traction())
        speed_scale_ = 1.0; // walls at rest for ever: any scale will do
}

MeanTraction MethodOfLines::mean_of_open(const CellState& rate) {
    return scene_.walls.by_traction() ? space_.mean_traction(rate.stress) : MeanTraction{};
}

void MethodOfLines::open_rate(CellState& cells, const VectorField& velocity, CellState& rate) {
    Timer timer;
    if (scene_.model == Model::full)
        space_.prepare_transport(cells);
    (void)space_.rates(cells, velocity, rate, next_velocity_);
    ++evaluations_;
    rate_seconds_ += timer.lap();
}

RateReport MethodOfLines::evaluate(CellState& cells, const WallRates& told, VectorField& velocity, CellState& rate) {
    const bool transported = scene_.model == Model::full;
    Timer preparing;
    if (transported)
        space_.prepare_transport(cells);
    rate_seconds_ += preparing.lap();
    ++evaluations_;

    RateReport report;
    double contraction = passes_.contraction, previous_change = 0.0;
    while (true) {
        Timer timer;
        report.largest_relaxation = space_.rates(cells, velocity, rate, next_velocity_);
        rate.wall = wall_velocity(scene_, told, mean_of_open(rate));
        rate.energy.work = space_.wall_power(cells.stress, rate.wall);
        rate_seconds_ += timer.lap();
        space_.solve(next_velocity_, WallData::zero);
        ++report.solves;
        ++solves_;
        solve_seconds_ += timer.lap();
        const VelocityChange comparison = space_.add_affine_and_compare(rate.wall, velocity, next_velocity_);
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

} // namespace ductile::quasistatic
