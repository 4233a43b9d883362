// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/quasistatic/resolution.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace ductile::quasistatic {

namespace {

constexpr int fewest_columns = 16, places_each = 6;                 // along the shorter side; of the first run's columns
constexpr double rows_a_column = 2.0;                               // bands lie along x
constexpr double longest_side = 16.0;                               // over the shorter one
constexpr double growth = 1.5, smallest_jump = 1.25, falling = 0.7; // of points from run to run; what differences must do
constexpr std::size_t fewest_runs = 3;                              // after the first
constexpr double most_points = 4e5;
constexpr double share_of_steps = 0.25; // of the error that is asked for

/// Equal cells in the domain, finer than the first run.
io::CellCount comparison_cells(const Grid& grid) {
    const double shorter = std::min(grid.width, grid.height);
    const auto count = [&](double side) {
        return static_cast<int>(std::lround(places_each * fewest_columns * std::min(side / shorter, longest_side)));
    };
    return {count(grid.width), 2 * count(grid.height)};
}

} // namespace

EndState::EndState(const Scene& scene, Space& space, const State& state, double wall_speed)
    : traction(space.mean_traction(state.cells.stress)), speed(std::max(wall_speed, largest_component(state.velocity))) {
    const Grid& grid = scene.grid;
    const io::CellCount cells = comparison_cells(grid);
    const std::vector<double> x = middles(cells.x, grid.cells_x), y = middles(cells.y, grid.cells_y);
    const Interpolation at_cells = space.interpolation(Space::At::cells, x, y);
    const Interpolation at_nodes = space.interpolation(Space::At::nodes, x, y);
    for (const Field* f : {&state.cells.stress.p, &state.cells.stress.s, &state.cells.stress.tau, &state.cells.stress.q})
        stress.push_back(at_cells(*f));
    const auto variables = scene.law->variables();
    for (std::size_t k = 0; k < variables.size(); ++k) {
        Field& values = internal.emplace_back(at_cells(state.cells.internal[k]));
        combine({{&values, 1.0 / variables[k].natural_scale()}}, values);
    }
    for (const Field* f : {&state.velocity.u, &state.velocity.v})
        velocity.push_back(at_nodes(*f));
}

EndErrors difference(const EndState& a, const EndState& b) {
    const auto stress = [&](std::size_t k) { return mean_square_difference(a.stress[k], b.stress[k]); };
    EndErrors d{.stress = std::sqrt(3.0 * stress(0) + 2.0 * (stress(1) + stress(2)) + 6.0 * stress(3)),
                .traction =
                    std::max(std::abs(a.traction.shear - b.traction.shear), std::abs(a.traction.normal - b.traction.normal))};
    for (std::size_t k = 0; k < a.internal.size(); ++k)
        d.internal = std::max(d.internal, std::sqrt(mean_square_difference(a.internal[k], b.internal[k])));
    if (const double speed = std::max(a.speed, b.speed); speed > 0.0)
        d.velocity = std::sqrt(mean_square_difference(a.velocity[0], b.velocity[0]) +
                               mean_square_difference(a.velocity[1], b.velocity[1])) /
                     speed;
    return d;
}

std::string missed_accuracy(const EndErrors& errors, double asked) {
    const double error = errors.largest();
    if (error <= asked)
        return {};
    return fmt::format("the error at the end is an estimated {:.1e}, and --accuracy asked for {:g}: ask for {:.1g}", error, asked,
                       asked * std::clamp(0.5 * asked / error, 0.1, 0.5));
}

double Refinement::power() const {
    const double first = std::log(fineness[1] / fineness[0]), second = std::log(fineness[2] / fineness[1]);
    const double ratio = differences[1] / differences[0];
    // d_2/d_1 falls with p, from second/first on
    const auto ratio_of = [&](double p) { return std::exp(-p * first) * std::expm1(-p * second) / std::expm1(-p * first); };
    if (!(ratio < second / first))
        return 0.0;
    double low = 0.0, high = 100.0;
    for (int k = 0; k < 50; ++k)
        (ratio_of(0.5 * (low + high)) > ratio ? low : high) = 0.5 * (low + high);
    return high;
}

double Refinement::error_of_last() const { return 1.0 / std::expm1(power() * std::log(fineness[2] / fineness[1])); }

double Refinement::refinement_for(double factor) const { return std::pow(factor, 1.0 / power()); }

Resolution::Resolution(Options& options, const std::function<EndState(const Options&)>& integrate,
                       const std::function<void(const std::string&)>& say)
    : degree_(options.space.elements.degree) {
    const double asked = options.accuracy, shorter = std::min(options.width, options.height);
    options.space.kind = SpaceKind::elements;
    options.space.elements.adapt = options.space.elements.adapt || degree_ >= 4; // less cannot
    const auto made = [&](Run run) {
        options.cells = run.points;
        run.end = integrate(options);
        runs_.push_back(std::move(run));
    };
    const auto negligible = [&](const EndErrors& e) { return e.largest() < 0.01 * asked; };
    const auto told = [&](const EndErrors& e) {
        return fmt::format("stress {:.1e}, internal variable {:.1e}, velocity {:.1e}, traction {:.1e}", e.stress, e.internal,
                           e.velocity, e.traction);
    };
    const auto count = [&](double side) { return std::lround(fewest_columns * std::min(side / shorter, longest_side)); };
    const auto elements = std::lround(rows_a_column * static_cast<double>(count(options.height)) / degree_);
    runs_.push_back({.points = {static_cast<int>(count(options.width)), degree_ * static_cast<int>(std::max(3L, elements))}});

    double tolerance = 0.1 * asked;
    const auto check_tolerance = [&](double value) {
        if (value < 1e-10)
            throw RunError(fmt::format("--accuracy {:g}: steps with a tolerance of {:.2g} are still off by {:.1e}: ask for less",
                                       asked, value, in_time_.largest()));
    };
    const auto with_tolerance = [&](double value) {
        options.tolerance = fmt::format("{:.3g}", value);
        options.cells = runs_.front().points;
        return integrate(options);
    };
    runs_.front().end = with_tolerance(tolerance);
    while (true) {
        EndState tighter = with_tolerance(tolerance / 8.0);
        in_time_ = difference(runs_.front().end, tighter);
        if (in_time_.largest() <= share_of_steps * asked)
            break;
        runs_.front().end = std::move(tighter);
        tolerance /= 8.0;
        check_tolerance(tolerance);
    }
    options.tolerance = fmt::format("{:.3g}", tolerance);
    say(fmt::format("accuracy  --tolerance {}: {}\n", options.tolerance, told(in_time_)));

    while (true) {
        made(refined(runs_.back(), growth));
        const std::size_t last = runs_.size() - 1;
        const io::CellCount points = runs_[last].points;
        differences_.push_back(difference(runs_[last - 1].end, runs_[last].end));
        if (last < 2) {
            say(fmt::format("accuracy  {} x {} points: {} from fewer\n", points.x, points.y, told(differences_.back())));
            continue;
        }
        if (negligible(differences_[last - 1]) && negligible(differences_[last - 2])) { // by round-off, at last, they do not fall
            say(fmt::format("accuracy  {} x {} points: {} from fewer\n", points.x, points.y, told(differences_.back())));
            runs_.push_back(runs_.back());
            break;
        }
        const Refinement found = refinement(last);
        const double factor = found.error_of_last(), error = factor * differences_.back().largest();
        say(fmt::format("accuracy  {} x {} points: {}\n", points.x, points.y,
                        std::isfinite(factor) ? told(factor * differences_.back() + in_time_)
                                              : told(differences_.back()) + " from fewer, which does not fall"));
        const bool falls = found.differences[1] < falling * found.differences[0] &&
                           (last < 3 || found.differences[0] < falling * differences_[last - 3].largest());
        if (falls && last >= fewest_runs) {
            const double needed = error <= 0.5 * asked ? 1.0 : found.refinement_for(error / (0.5 * asked));
            if (needed <= growth) {
                runs_.push_back(needed > 1.0 ? refined(runs_.back(), std::max(needed, smallest_jump)) : runs_.back());
                break;
            }
        }
        if (static_cast<double>(points.x) * points.y * growth * growth > most_points)
            throw RunError(fmt::format(
                "--accuracy {:g}: {} x {} points are off by {}: the fields are too rough for it, or where flow localises hangs "
                "on what is smaller than that; ask for less, or for a shorter --duration, or take --space staggered with --cells "
                "as "
                "many as you can wait for, and see what half as many change",
                asked, points.x, points.y,
                std::isfinite(error) ? fmt::format("an estimated {:.1e}", error)
                                     : fmt::format("{:.1e} or more", differences_.back().largest())));
    }
    // where flow localises, it does so on the points that show it, and steps matter more there than they did on few
    while (true) {
        Run& seen = runs_[differences_.size()];
        options.cells = seen.points;
        options.tolerance = fmt::format("{:.3g}", tolerance / 8.0);
        EndState tighter = integrate(options);
        in_time_ = difference(seen.end, tighter);
        seen.end = std::move(tighter);
        if (in_time_.largest() <= share_of_steps * asked)
            break;
        tolerance /= 8.0;
        check_tolerance(tolerance);
    }
    options.tolerance = fmt::format("{:.3g}", tolerance);
    say(fmt::format("accuracy  --tolerance {}: {}\n", options.tolerance, told(in_time_)));
    options.cells = runs_.back().points;
    say(fmt::format("accuracy  {:g} asked for: --space elements --cells {}x{} --degree {} --tolerance {}\n", asked,
                    options.cells.x, options.cells.y, degree_, options.tolerance));
}

Resolution::Run Resolution::refined(const Run& run, double factor) const {
    const auto finer = [&](int count) { return std::max(count + 1, static_cast<int>(std::ceil(factor * count))); };
    const io::CellCount points{finer(run.points.x), degree_ * finer(run.points.y / degree_)};
    const auto density = [](io::CellCount c) { return std::sqrt(static_cast<double>(c.x) * c.y); };
    return {.points = points, .fineness = run.fineness * density(points) / density(run.points)};
}

Refinement Resolution::refinement(std::size_t k) const {
    return {{runs_[k - 2].fineness, runs_[k - 1].fineness, runs_[k].fineness},
            {differences_[k - 2].largest(), differences_[k - 1].largest()}};
}

EndErrors Resolution::errors(const EndState& end) const {
    const std::size_t chosen = runs_.size() - 1;
    if (runs_[chosen].fineness == runs_[chosen - 1].fineness) {
        const double factor = refinement(chosen - 1).error_of_last();
        return (std::isfinite(factor) ? factor : 1.0) * differences_.back() + in_time_;
    }
    const EndErrors change = difference(runs_[chosen - 1].end, end);
    const Refinement found{{runs_[chosen - 2].fineness, runs_[chosen - 1].fineness, runs_[chosen].fineness},
                           {differences_.back().largest(), change.largest()}};
    return found.error_of_last() * change + in_time_;
}

} // namespace ductile::quasistatic
