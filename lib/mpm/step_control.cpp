// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/mpm/step_control.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace ductile::mpm {

namespace {
constexpr double smallest_rest = 1e-3; // of a step: less is not worth one
constexpr double infinity = std::numeric_limits<double>::infinity();

/// When a motion has covered a distance > 0; infinity if never.
double time_to_cover(double distance, double velocity, double acceleration) {
    if (acceleration == 0.0)
        return velocity > 0.0 ? distance / velocity : infinity;
    const double square = velocity * velocity + 2.0 * acceleration * distance; // of the velocity there
    const double sum = square >= 0.0 ? velocity + std::sqrt(square) : 0.0;
    return sum > 0.0 ? 2.0 * distance / sum : infinity;
}

/// A rigid body's motion along x or y, one way: its places, velocity and acceleration until the next knot.
struct Way {
    const std::vector<double>&place, &across;
    double origin, cell, origin_across, cell_across;
    double velocity, acceleration, sign;
    int period, period_across; // cells after which places repeat themselves; 0: never

    /// Time to so many cells from here.
    [[nodiscard]] double time(double cells) const {
        return acceleration == 0.0 ? (velocity > 0.0 ? cells * (cell / velocity) : infinity)
                                   : time_to_cover(cells * cell, velocity, acceleration);
    }
};

/// Those that the body may go.
std::vector<Way> ways(const RigidBody& body, double time, const Grid& grid) {
    const Velocity v = body.velocity.after(time), a = body.velocity.slope(time);
    const int period = grid.periodic() ? grid.cells_x : 0;
    std::vector<Way> all;
    for (const double sign : {1.0, -1.0}) {
        if (sign * v.u > 0.0 || sign * a.u > 0.0)
            all.push_back(
                {body.x, body.y, grid.left, grid.dx(), grid.bottom, grid.dy(), sign * v.u, sign * a.u, sign, period, 0});
        if (sign * v.v > 0.0 || sign * a.v > 0.0)
            all.push_back(
                {body.y, body.x, grid.bottom, grid.dy(), grid.left, grid.dx(), sign * v.v, sign * a.v, sign, 0, period});
    }
    return all;
}
} // namespace

const char* to_string(StepLimit limit) {
    constexpr const char* names[] = {"--dt",         "ramp",    "failed step", "Newton iterations",
                                     "rigid travel", "contact", "end",         "knot of a history"};
    return names[static_cast<int>(limit)];
}

double StepControl::sliver() const { return 1e-9 * std::min(plan_.next, options_.target); }

StepControl::Step StepControl::by_rigid_bodies(const State& state) const {
    const double planned = std::min(plan_.next, options_.target);
    constexpr StepLimit reasons[] = {StepLimit::ramp, StepLimit::failed_step, StepLimit::newton_iterations};
    Step step{planned, plan_.next < options_.target ? reasons[static_cast<int>(plan_.shortened)] : StepLimit::target, planned};
    if (plan_.rest > 0.0)
        step = {std::min(plan_.rest, planned), StepLimit::end, planned};
    const double now = state.time + sliver();
    constexpr double largest_travel = 0.99; // of a cell
    for (const RigidBody& body : state.rigid_bodies)
        for (const Way& way : ways(body, now, options_.grid))
            if (const double time = time_to_cover(largest_travel * way.cell, way.velocity, way.acceleration); time < step.dt)
                step = {time, StepLimit::rigid_travel, planned};
    for (const RigidBody& body : state.rigid_bodies)
        if (const double time =
                time_to_cover(largest_travel * options_.grid.smallest_spacing(), reach_of(body) * std::abs(body.spin.after(now)),
                              reach_of(body) * std::abs(body.spin.slope(now)));
            time < step.dt)
            step = {time, StepLimit::rigid_travel, planned};
    if (!options_.ends_at_contact)
        return step;
    const double limit = step.dt;
    const auto worth = [limit](double interval) { return interval > 8.0 * limit || interval < 2.0 * limit; };
    double earliest = 1.02 * limit; // a little longer than planned rather than a remainder too small to be worth a step
    for (std::size_t b = 0; b < state.rigid_bodies.size(); ++b) {
        if (state.rigid_bodies[b].surface) // which is found within a step
            continue;
        const bool touching = b < plan_.touching.size() && plan_.touching[b] != 0;
        const NewNodes nodes = time_to_new_nodes(state.rigid_bodies[b], now, options_.grid,
                                                 options_.boxes ? state.rigid_bodies[b].half_width : 0.0, options_.landing);
        if (nodes.time < earliest && (!touching || worth(nodes.interval))) {
            earliest = nodes.time;
            step = {earliest, StepLimit::contact, planned, !touching};
        }
    }
    return step;
}

StepControl::Step StepControl::next(const State& state, double end) const {
    Step step = by_rigid_bodies(state);
    double knot = infinity;
    for (const RigidBody& body : state.rigid_bodies)
        knot = std::min({knot, body.velocity.next_knot(state.time + sliver()), body.spin.next_knot(state.time + sliver())});
    const bool lands = !(knot < end - sliver());
    const double goal = lands ? end : knot, left = goal - state.time;
    step.end = state.time + step.dt;
    if (step.dt < left * (1.0 - 1e-6))
        return step;
    if (step.dt > left * (1.0 + 1e-6)) {
        step.limit = lands ? StepLimit::end : StepLimit::history_knot;
        step.first_contact = false; // that comes later
    }
    step.dt = left;
    step.end = goal;
    step.lands = lands;
    return step;
}

void StepControl::accepted(const Step& step, int newton_iterations, std::span<const std::int64_t> touching) {
    const double taken = step.limit == StepLimit::rigid_travel ? step.dt : step.planned;
    const bool cut = step.limit == StepLimit::history_knot || (step.lands && step.limit == StepLimit::end);
    const double rest = cut ? std::min(plan_.rest > 0.0 ? plan_.rest : step.planned, step.planned) - step.dt : 0.0;
    plan_.rest = rest > smallest_rest * step.planned ? rest : 0.0;
    if (newton_iterations > options_.many_newton_iterations) {
        plan_.next = 0.7 * taken;
        plan_.shortened = Shortened::by_newton_iterations;
        plan_.rest = 0.0;
    } else if (plan_.rest > 0.0) {
        plan_.next = step.planned; // grows once the rest is done
    } else {
        plan_.next = (2 * newton_iterations > options_.many_newton_iterations ? 1.0 : options_.growth) * step.planned;
    }
    if (step.first_contact && options_.first < plan_.next) {
        plan_.next = options_.first;
        plan_.shortened = Shortened::by_ramp;
    }
    if (plan_.next >= options_.target) {
        plan_.next = options_.target;
        plan_.shortened = Shortened::by_ramp;
    }
    plan_.touching.assign(touching.begin(), touching.end());
}

bool StepControl::failed(const Step& step) {
    plan_.next = 0.5 * step.dt;
    plan_.rest = 0.0;
    plan_.shortened = Shortened::by_failure;
    return plan_.next > std::ldexp(options_.target, -30);
}

NewNodes time_to_new_nodes(const RigidBody& body, double time, const Grid& grid, double reach, double landing) {
    NewNodes earliest;
    for (const Way& along : ways(body, time, grid)) {
        earliest.interval = std::min(earliest.interval, along.time(1.0));
        // cells passed, rising in the direction of motion
        const auto way = [&](std::size_t p) { return along.sign * (along.place[p] - along.origin) / along.cell + reach; };
        const auto number = [](double cells, int period) {
            const auto whole = static_cast<std::int64_t>(std::floor(cells));
            return period > 0 ? (whole % period + period) % period : whole;
        };
        const auto cell = [&](std::size_t p, double cells) {
            const double row = (along.across[p] - along.origin_across) / along.cell_across;
            return std::pair{number(row, along.period_across), number(cells, along.period)};
        };
        std::vector<std::pair<std::int64_t, std::int64_t>> occupied;
        for (std::size_t p = 0; p < along.place.size(); ++p)
            occupied.push_back(cell(p, way(p)));
        std::sort(occupied.begin(), occupied.end());
        occupied.erase(std::unique(occupied.begin(), occupied.end()), occupied.end());
        for (std::size_t p = 0; p < along.place.size(); ++p)
            if (!std::binary_search(occupied.begin(), occupied.end(), cell(p, way(p) + 1.0)))
                earliest.time = std::min(earliest.time, along.time(std::floor(way(p)) + 1.0 - way(p) + landing));
    }
    return earliest;
}

} // namespace ductile::mpm
