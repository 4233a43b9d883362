#include <ductile/mpm/step_control.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace ductile::mpm {

namespace {
constexpr double smallest_rest = 1e-3; // of a step: less is not worth one
}

StepControl::Step StepControl::by_rigid_bodies(const State& state) const {
    const double planned = std::min(plan_.next, options_.target);
    constexpr std::string_view reasons[] = {"ramp", "failed step", "Newton iterations"};
    Step step{planned, plan_.next < options_.target ? reasons[static_cast<int>(plan_.shortened)] : "--dt", planned};
    if (plan_.rest > 0.0)
        step = {std::min(plan_.rest, planned), "output time", planned};
    constexpr double largest_travel = 0.99; // of a cell
    for (const RigidBody& body : state.rigid_bodies)
        for (const auto& [speed, cell] :
             {std::pair{std::abs(body.velocity_x), options_.grid.dx()}, {std::abs(body.velocity_y), options_.grid.dy()}})
            if (speed * step.dt > largest_travel * cell)
                step = {largest_travel * cell / speed, "rigid travel", planned};
    if (!options_.ends_at_contact)
        return step;
    const double limit = step.dt;
    const auto worth = [limit](double interval) { return interval > 8.0 * limit || interval < 2.0 * limit; };
    double earliest = 1.02 * limit; // a little longer than planned rather than a remainder too small to be worth a step
    for (std::size_t b = 0; b < state.rigid_bodies.size(); ++b) {
        const bool touching = b < plan_.touching.size() && plan_.touching[b] != 0;
        const NewNodes nodes = time_to_new_nodes(state.rigid_bodies[b], options_.grid, options_.reach, options_.landing);
        if (nodes.time < earliest && (!touching || worth(nodes.interval))) {
            earliest = nodes.time;
            step = {earliest, "contact", planned, !touching};
        }
    }
    return step;
}

StepControl::Step StepControl::next(const State& state, double output_time) const {
    Step step = by_rigid_bodies(state);
    const double left = output_time - state.time;
    if (step.dt < left * (1.0 - 1e-6))
        return step;
    if (step.dt > left * (1.0 + 1e-6)) {
        step.limit = "output time";
        step.first_contact = false; // that comes later
    }
    step.dt = left;
    step.lands = true;
    return step;
}

void StepControl::accepted(const Step& step, int newton_iterations, std::span<const std::int64_t> touching) {
    const double taken = step.limit == "rigid travel" ? step.dt : step.planned;
    const bool cut = step.lands && step.limit == "output time";
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

NewNodes time_to_new_nodes(const RigidBody& body, const Grid& grid, double reach, double landing) {
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
