#include <ductile/mpm/step_control.hpp>

#include <algorithm>
#include <cmath>

namespace ductile::mpm {

StepControl::Step StepControl::next(const State& state) const {
    Step step{std::min(next_, options_.target), recovering_ ? "failed step" : next_ < options_.target ? "ramp" : "--dt"};
    constexpr double largest_travel = 0.99; // of a cell
    for (const RigidBody& body : state.rigid_bodies)
        for (const auto& [speed, cell] :
             {std::pair{std::abs(body.velocity_x), options_.cell_x}, {std::abs(body.velocity_y), options_.cell_y}})
            if (speed * step.dt > largest_travel * cell)
                step = {largest_travel * cell / speed, "rigid travel"};
    return step;
}

void StepControl::accepted(const Step& step) {
    next_ = std::min(step.dt * options_.growth, options_.target);
    recovering_ = recovering_ && next_ < options_.target;
}

bool StepControl::failed(const Step& step) {
    next_ = 0.5 * step.dt;
    recovering_ = true;
    return next_ > std::ldexp(options_.target, -30);
}

} // namespace ductile::mpm
