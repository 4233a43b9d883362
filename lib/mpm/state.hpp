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

inline void move_rigid_bodies(std::vector<RigidBody>& bodies, double dt) {
    for (RigidBody& body : bodies) {
        for (double& x : body.x)
            x += dt * body.velocity_x;
        for (double& y : body.y)
            y += dt * body.velocity_y;
    }
}

} // namespace ductile::mpm
