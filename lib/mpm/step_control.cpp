#include <ductile/mpm/step_control.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace ductile::mpm {

StepControl::Step StepControl::next(const State& state) const {
    const double planned = std::min(plan_.next, options_.target);
    constexpr std::string_view reasons[] = {"ramp", "failed step", "Newton iterations"};
    Step step{planned, plan_.next < options_.target ? reasons[static_cast<int>(plan_.shortened)] : "--dt", planned};
    constexpr double largest_travel = 0.99; // of a cell
    constexpr double stretch = 1.02;        // a little longer than planned rather than a remainder too small to be worth a step
    // In contact an event is worth a shorter step if it comes seldom, or if steps are so long that one could miss it altogether.
    const auto worth = [](double interval, double dt) { return interval > 8.0 * dt || interval < 2.0 * dt; };
    for (const RigidBody& body : state.rigid_bodies)
        for (const auto& [speed, cell] :
             {std::pair{std::abs(body.velocity_x), options_.grid.dx()}, {std::abs(body.velocity_y), options_.grid.dy()}})
            if (speed * step.dt > largest_travel * cell)
                step = {largest_travel * cell / speed, "rigid travel", planned};
    if (options_.ends_at_contact)
        for (const RigidBody& body : state.rigid_bodies) {
            const auto [time, interval] = time_to_new_nodes(body, options_.grid, options_.reach);
            if (time < stretch * step.dt && (!plan_.touching || worth(interval, step.dt)))
                step = {time, "contact", planned};
        }
    return step;
}

void StepControl::accepted(const Step& step, int newton_iterations, bool touching) {
    const double growth = newton_iterations > options_.many_newton_iterations       ? 0.7
                          : 2 * newton_iterations > options_.many_newton_iterations ? 1.0
                                                                                    : options_.growth;
    plan_.next = std::min(step.planned * growth, options_.target);
    if (step.limit == "contact" && !plan_.touching)
        plan_.next = std::min(options_.first, options_.target);
    if (newton_iterations > options_.many_newton_iterations)
        plan_.shortened = Shortened::by_newton_iterations;
    else if (plan_.next >= options_.target)
        plan_.shortened = Shortened::by_ramp;
    plan_.touching = touching;
}

bool StepControl::failed(const Step& step) {
    plan_.next = 0.5 * step.dt;
    plan_.shortened = Shortened::by_failure;
    return plan_.next > std::ldexp(options_.target, -30);
}

NewNodes time_to_new_nodes(const RigidBody& body, const Grid& grid, double reach) {
    constexpr double landing = 1e-9; // cells beyond the edge: there and not on it
    struct Axis {
        const std::vector<double>& place;
        double velocity, origin, cell;
    };
    const Axis axes[2] = {{body.x, body.velocity_x, grid.left, grid.dx()}, {body.y, body.velocity_y, grid.bottom, grid.dy()}};
    NewNodes earliest;
    for (int a = 0; a < 2; ++a) {
        const Axis &along = axes[a], &across = axes[1 - a];
        if (along.velocity == 0.0)
            continue;
        const double interval = along.cell / std::abs(along.velocity), sign = along.velocity > 0.0 ? 1.0 : -1.0;
        earliest.interval = std::min(earliest.interval, interval);
        // cells passed, rising in the direction of motion
        const auto way = [&](std::size_t p) { return sign * (along.place[p] - along.origin) / along.cell + reach; };
        const auto cell = [&](std::size_t p, double cells) {
            const double row = std::floor((across.place[p] - across.origin) / across.cell);
            return std::pair{static_cast<std::int64_t>(row), static_cast<std::int64_t>(std::floor(cells))};
        };
        std::vector<std::pair<std::int64_t, std::int64_t>> occupied;
        for (std::size_t p = 0; p < along.place.size(); ++p)
            occupied.push_back(cell(p, way(p)));
        std::sort(occupied.begin(), occupied.end());
        occupied.erase(std::unique(occupied.begin(), occupied.end()), occupied.end());
        for (std::size_t p = 0; p < along.place.size(); ++p)
            if (!std::binary_search(occupied.begin(), occupied.end(), cell(p, way(p) + 1.0)))
                earliest.time = std::min(earliest.time, (std::floor(way(p)) + 1.0 - way(p) + landing) * interval);
    }
    return earliest;
}

} // namespace ductile::mpm
