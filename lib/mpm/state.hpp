// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/mpm/body.hpp>
#include <ductile/mpm/particles.hpp>

#include <cstdint>
#include <vector>

namespace ductile::mpm {

/// Everything that changes in a run.
struct State {
    Particles particles = {};
    std::vector<RigidBody> rigid_bodies = {};
    double time = 0.0; ///< [s]
    std::int64_t step = 0;
};

/// To where they are a step of dt seconds from state.time on.
inline void move_rigid_bodies(State& state, double dt) {
    for (RigidBody& body : state.rigid_bodies) {
        if (body.surface) {
            const Pose begin = pose_of(body, state.time), end = pose_of(body, state.time + dt);
            for (std::size_t p = 0; p < body.x.size(); ++p) {
                const auto place = end.place(body, begin.at_start(body, {body.x[p], body.y[p]}));
                body.x[p] = place[0];
                body.y[p] = place[1];
            }
            continue;
        }
        const Velocity mean = body.velocity.mean(state.time, state.time + dt);
        for (double& x : body.x)
            x += dt * mean.u;
        for (double& y : body.y)
            y += dt * mean.v;
    }
}

} // namespace ductile::mpm
