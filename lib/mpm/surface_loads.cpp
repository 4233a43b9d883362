// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/mpm/carried_points.hpp>
#include <ductile/mpm/forwarding.hpp>
#include <ductile/mpm/surface_loads.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace ductile::mpm {

namespace {

/// A loaded side in this step.
struct LoadedSide {
    Stencil stencil;     ///< its values are B of the middle
    NodalWeights turn;   ///< s . g
    PlaneVector along;   ///< s where the step begins
    double radius = 1.0; ///< there; 1 in plane geometries
    double area;
    std::size_t load;
};

class SurfaceLoads final : public Forwarding {
public:
    SurfaceLoads(std::unique_ptr<Discretisation> within, const Scene& scene, bool midpoint)
        : Forwarding(std::move(within)), loads_(scene.loads), axisymmetric_(scene.geometry == Geometry::axisymmetric),
          midpoint_(midpoint && scene.finite_rotation) {}

    void prepare(Particles& particles, std::span<const RigidBody> rigid_bodies, double time, double dt) override {
        within().prepare(particles, rigid_bodies, time, dt);
        time_ = time;
        const LoadedSides& loaded = particles.loaded;
        sides_.clear();
        for (std::size_t c = 0; c < loaded.size(); ++c) {
            const Stencil stencil = within().stencil(loaded.carrier(c));
            const PlaneVector along = {loaded.along_x[c], loaded.along_y[c]};
            LoadedSide side{carried(stencil, {loaded.x[c], loaded.y[c]}), slopes(stencil, along), along, 1.0, loaded.area[c],
                            static_cast<std::size_t>(loaded.load[c])};
            if (axisymmetric_)
                side.radius = place_of(particles, loaded, c)[0];
            sides_.push_back(side);
        }
    }

    void internal_force(const Particles& particles, std::span<double> force, std::span<double> magnitudes) const override {
        within().internal_force(particles, force, magnitudes);
        for (const LoadedSide& side : sides_)
            scatter(side.stencil, force_of(side, time_, side.along, side.radius), force, magnitudes);
    }

    void force_after(const Particles& particles, std::span<const double> velocity, double dt, std::span<double> force,
                     std::span<double> magnitudes) const override {
        within().force_after(particles, velocity, dt, force, magnitudes);
        for (const LoadedSide& side : sides_)
            scatter(side.stencil, force_after(side, velocity, dt), force, magnitudes);
    }

    void linearise(const Particles& particles, std::span<const double> velocity, double dt) override {
        within().linearise(particles, velocity, dt);
        derivatives_.clear();
        const double way = share() * dt;
        for (const LoadedSide& side : sides_) {
            const double pressure = loads_[side.load].pressure.after(time_ + way);
            Derivative d{.of_along = pressure * way * (side.radius + (axisymmetric_ ? way * middle(side, velocity)[0] : 0.0)),
                         .of_radius = {}};
            if (axisymmetric_) {
                const PlaneVector along = side.along + way * turned(side, velocity);
                d.of_radius = pressure * way * PlaneVector{along[1], -along[0]};
            }
            derivatives_.push_back(d);
        }
    }

    void stiffness_times(std::span<const double> x, std::span<double> result) const override {
        within().stiffness_times(x, result);
        for (std::size_t c = 0; c < sides_.size(); ++c) {
            const LoadedSide& side = sides_[c];
            const Derivative& d = derivatives_[c];
            const PlaneVector along = turned(side, x);
            const double radius = axisymmetric_ ? middle(side, x)[0] : 0.0;
            scatter(side.stencil, d.of_along * PlaneVector{along[1], -along[0]} + radius * d.of_radius, result, {});
        }
    }

    ParticleEnergies advance(Particles& particles, const NodalMotion& motion) override {
        ParticleEnergies of_loads;
        for (const LoadedSide& side : sides_) {
            const PlaneVector begin = force_of(side, time_, side.along, side.radius);
            const PlaneVector after = force_after(side, motion.straining, motion.dt);
            const PlaneVector acting = (1.0 - motion.weight_at_end) * begin + motion.weight_at_end * after;
            const PlaneVector way = motion.dt * middle(side, motion.straining);
            const bool grows = motion.weight_at_end > 0.0 && !midpoint_;
            const double work = dot(grows ? 0.5 * (begin + after) : acting, way);
            of_loads.load_work += work;
            of_loads.of_lag += work;
            if (!moves()) // what the nodes do is counted there
                of_loads.of_lag -= dot(acting, way);
        }
        time_ += motion.dt; // internal_force() is that of the particles where they are from now on
        LoadedSides& loaded = particles.loaded;
        move(loaded, within(), motion);
        for (std::size_t c = 0; c < sides_.size(); ++c) {
            LoadedSide& side = sides_[c];
            const PlaneVector turn = motion.dt * turned(side, motion.straining);
            loaded.along_x[c] += turn[0];
            loaded.along_y[c] += turn[1];
            side.along = side.along + turn;
            if (axisymmetric_)
                side.radius += motion.dt * middle(side, motion.straining)[0];
        }
        ParticleEnergies energies = within().advance(particles, motion);
        energies.add(of_loads);
        return energies;
    }

    [[nodiscard]] std::size_t memory_bytes() const override {
        return within().memory_bytes() + sizeof(LoadedSide) * sides_.capacity();
    }

private:
    /// What multiplies the change of a side's normal and of its radius, in minus the force.
    struct Derivative {
        double of_along;
        PlaneVector of_radius;
    };

    /// Of the step, at which the method takes the force.
    [[nodiscard]] double share() const { return midpoint_ ? 0.5 : 1.0; }

    [[nodiscard]] PlaneVector force_of(const LoadedSide& side, double time, const PlaneVector& along, double radius) const {
        const Load& load = loads_[side.load];
        const Velocity traction = load.traction.after(time);
        return side.area * PlaneVector{traction.u, traction.v} -
               load.pressure.after(time) * radius * PlaneVector{along[1], -along[0]};
    }

    [[nodiscard]] PlaneVector force_after(const LoadedSide& side, std::span<const double> velocity, double dt) const {
        const double way = share() * dt;
        const double radius = side.radius + (axisymmetric_ ? way * middle(side, velocity)[0] : 0.0);
        return force_of(side, time_ + way, side.along + way * turned(side, velocity), radius);
    }

    static PlaneVector middle(const LoadedSide& side, std::span<const double> nodal) {
        return sum(side.stencil, side.stencil.value, nodal);
    }
    /// C s
    static PlaneVector turned(const LoadedSide& side, std::span<const double> nodal) {
        return sum(side.stencil, side.turn, nodal);
    }

    std::vector<Load> loads_;
    bool axisymmetric_, midpoint_;
    double time_ = 0.0; // where the step begins
    std::vector<LoadedSide> sides_;
    std::vector<Derivative> derivatives_;
};

} // namespace

std::unique_ptr<Discretisation> with_loads(std::unique_ptr<Discretisation> within, const Scene& scene, bool midpoint) {
    return std::make_unique<SurfaceLoads>(std::move(within), scene, midpoint);
}

} // namespace ductile::mpm
