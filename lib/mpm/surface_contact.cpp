// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/mpm/carried_points.hpp>
#include <ductile/mpm/contact_spring.hpp>
#include <ductile/mpm/forwarding.hpp>
#include <ductile/mpm/surface_contact.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace ductile::mpm {

namespace {

using Vector = PlaneVector;

/// A point that a rigid body may touch in this step.
struct Touch {
    std::size_t point, body;
    Stencil stencil;          ///< its values are B
    NodalWeights at_particle; ///< N
    Vector place;             ///< where the step begins
    Vector way;               ///< of the rigid body there, over the step
    Vector normal;            ///< where the step begins
    ContactSpring spring;
};

/// What a touch comes to with a velocity of the point.
struct Force {
    Gap end, acting;                       ///< at the end of the step, and where the method takes the force
    double normal = 0.0, tangential = 0.0; ///< of the force that it takes
    double slid = 0.0;                     ///< way over the surface

    [[nodiscard]] Vector force() const { return normal * acting.normal + tangential * tangent_of(acting.normal); }
};

class SurfaceContact final : public Forwarding {
public:
    SurfaceContact(std::unique_ptr<Discretisation> within, const Scene& scene, bool midpoint)
        : Forwarding(std::move(within)), midpoint_(midpoint && scene.finite_rotation),
          reach_(2.0 * std::max(scene.grid.dx(), scene.grid.dy())) {}

    void prepare(Particles& particles, std::span<const RigidBody> rigid_bodies, double time, double dt) override {
        within().prepare(particles, rigid_bodies, time, dt);
        bodies_ = rigid_bodies;
        begin_.clear();
        middle_.clear();
        end_.clear();
        for (const RigidBody& body : bodies_) {
            begin_.push_back(pose_of(body, time));
            middle_.push_back(pose_of(body, time + 0.5 * dt));
            end_.push_back(pose_of(body, time + dt));
        }
        forces_.assign(bodies_.size(), {});
        find_touches(particles);
    }

    [[nodiscard]] std::span<const std::array<double, 2>> surface_forces() const override { return forces_; }
    [[nodiscard]] std::size_t memory_bytes() const override {
        return within().memory_bytes() + sizeof(Touch) * touches_.capacity();
    }

    void internal_force(const Particles& particles, std::span<double> force, std::span<double> magnitudes) const override {
        within().internal_force(particles, force, magnitudes);
        for (const Touch& touch : touches_)
            scatter(touch.stencil, touch.spring.force_at_begin(touch.normal), force, magnitudes);
    }

    void force_after(const Particles& particles, std::span<const double> velocity, double dt, std::span<double> force,
                     std::span<double> magnitudes) const override {
        within().force_after(particles, velocity, dt, force, magnitudes);
        for (const Touch& touch : touches_)
            scatter(touch.stencil, after(touch, dt * velocity_of(touch, velocity)).force(), force, magnitudes);
    }

    void linearise(const Particles& particles, std::span<const double> velocity, double dt) override {
        within().linearise(particles, velocity, dt);
        stiffness_.clear();
        for (const Touch& touch : touches_) {
            stiffness_.push_back(derivative(touch, dt * velocity_of(touch, velocity)));
            for (double& entry : stiffness_.back())
                entry *= dt;
        }
    }

    void stiffness_times(std::span<const double> x, std::span<double> result) const override {
        within().stiffness_times(x, result);
        for (std::size_t t = 0; t < touches_.size(); ++t) {
            const Vector v = velocity_of(touches_[t], x);
            const auto& k = stiffness_[t];
            scatter(touches_[t].stencil, {k[0] * v[0] + k[1] * v[1], k[2] * v[0] + k[3] * v[1]}, result, {});
        }
    }

    void stiffness_diagonal(std::span<double> diagonal) const override {
        within().stiffness_diagonal(diagonal);
        for_each_block([&](const Stencil& s, std::size_t i, std::size_t j, const std::array<double, 4>& block) {
            if (s.node[i] == s.node[j]) {
                diagonal[2 * s.node[i]] += block[0];
                diagonal[2 * s.node[i] + 1] += block[3];
            }
        });
    }

    void stiffness_blocks(const AddBlock& add) const override {
        within().stiffness_blocks(add);
        std::vector<double> matrix;
        for_each_block([&](const Stencil& s, std::size_t i, std::size_t j, const std::array<double, 4>& block) {
            const std::size_t width = 2 * s.count;
            matrix.resize(width * width);
            for (std::size_t a = 0; a < 2; ++a)
                for (std::size_t b = 0; b < 2; ++b) // those who factorise this take it as symmetric
                    matrix[(2 * i + a) * width + 2 * j + b] = 0.5 * (block[2 * a + b] + block[2 * b + a]);
            if (i + 1 == s.count && j + 1 == s.count)
                add({s.node.data(), s.count}, matrix);
        });
    }

    ParticleEnergies advance(Particles& particles, const NodalMotion& motion) override {
        ParticleEnergies of_contact;
        outcomes_.clear();
        std::ranges::fill(forces_, std::array<double, 2>{});
        for (const Touch& touch : touches_) {
            const Vector way = motion.dt * velocity_of(touch, motion.straining);
            const Force felt = after(touch, way);
            // in the momentum form particles move with another velocity than the one that strains them
            const Force& end = outcomes_.emplace_back(after(touch, way + motion.dt * carried_beyond(touch, motion)));
            const Vector begin = touch.spring.force_at_begin(touch.normal);
            const Vector acting = (1.0 - motion.weight_at_end) * begin + motion.weight_at_end * felt.force();
            forces_[touch.body] = forces_[touch.body] - acting;
            const bool grows = motion.weight_at_end > 0.0 && !midpoint_;
            const double work = dot(grows ? 0.5 * (begin + felt.force()) : acting, touch.way);
            const auto [rubbed, kept, held] = touch.spring.outcome(end.end.gap, end.tangential, end.slid);
            of_contact.surface_work += work;
            of_contact.friction += rubbed;
            of_contact.in_contact += kept;
            of_contact.of_lag += work - rubbed - kept;
            if (!moves()) // what the nodes do is counted there
                of_contact.of_lag -= dot(acting, way);
        }
        move(particles.surface, within(), motion);
        for (auto& held : particles.surface.held)
            std::ranges::fill(held, 0.0);
        for (std::size_t t = 0; t < touches_.size(); ++t) {
            Touch& touch = touches_[t];
            const Force& end = outcomes_[t];
            touch.spring.held = touch.spring.outcome(end.end.gap, end.tangential, end.slid).held;
            if (touch.spring.friction > 0.0)
                particles.surface.held[touch.body][touch.point] = touch.spring.held;
            touch.spring.gap = end.end.gap; // internal_force() is that of the particles where they are now
            touch.normal = end.end.normal;
        }
        ParticleEnergies energies = within().advance(particles, motion);
        energies.add(of_contact);
        return energies;
    }

private:
    void find_touches(const Particles& particles) {
        touches_.clear();
        const SurfacePoints& surface = particles.surface;
        for (std::size_t c = 0; c < surface.size(); ++c) {
            const Vector place = place_of(particles, surface, c);
            for (std::size_t b = 0; b < bodies_.size(); ++b) {
                const RigidBody& body = bodies_[b];
                if (!body.surface)
                    continue;
                const Gap gap = gap_to(body, begin_[b], place);
                const Vector way = end_[b].place(body, begin_[b].at_start(body, place)) - place;
                if (gap.gap > reach_ + std::hypot(way[0], way[1]))
                    continue;
                const Stencil stencil = within().stencil(surface.carrier(c));
                const double held = body.friction > 0.0 ? surface.held[b][c] : 0.0;
                touches_.push_back({c,
                                    b,
                                    carried(stencil, {surface.x[c], surface.y[c]}),
                                    stencil.value,
                                    place,
                                    way,
                                    gap.normal,
                                    {surface.stiffness[c], body.friction, gap.gap, held}});
            }
        }
    }

    static Vector velocity_of(const Touch& touch, std::span<const double> velocity) {
        return sum(touch.stencil, touch.stencil.value, velocity);
    }

    /// What the velocity of its particle is more than the one that strains it.
    static Vector carried_beyond(const Touch& touch, const NodalMotion& motion) {
        return sum(touch.stencil, touch.at_particle, motion.motion) - sum(touch.stencil, touch.at_particle, motion.straining);
    }

    /// With the way of the point in the step.
    [[nodiscard]] Force after(const Touch& touch, const Vector& way) const {
        const RigidBody& body = bodies_[touch.body];
        Force result{.end = gap_to(body, end_[touch.body], touch.place + way), .acting = {}};
        result.acting = midpoint_ ? gap_to(body, middle_[touch.body], touch.place + 0.5 * way) : result.end;
        result.normal = touch.spring.normal(result.end.gap, midpoint_);
        result.slid = dot(way - touch.way, tangent_of(result.acting.normal));
        result.tangential = touch.spring.tangential(result.slid, result.normal);
        return result;
    }

    /// Minus that of the force by the way of the point: xx, xy, yx, yy.
    [[nodiscard]] std::array<double, 4> derivative(const Touch& touch, const Vector& way) const {
        const Force f = after(touch, way);
        const Vector n = f.acting.normal, t = tangent_of(n);
        const double turn = (midpoint_ ? 0.5 : 1.0) * f.acting.curvature; // half of the way leads to the middle
        const double slope = touch.spring.slope_of_normal(f.end.gap, f.normal, midpoint_);
        const double friction = touch.spring.friction;
        const Vector of_tangential = touch.spring.sticks(f.slid, f.normal)
                                         ? -touch.spring.stiffness * (1.0 - turn * dot(way - touch.way, n)) * t
                                         : std::copysign(friction, f.tangential) * slope * f.end.normal;
        const Vector along_n = slope * f.end.normal - f.tangential * turn * t;
        const Vector along_t = f.normal * turn * t + (friction > 0.0 && f.normal > 0.0 ? 1.0 : 0.0) * of_tangential;
        return {-(n[0] * along_n[0] + t[0] * along_t[0]), -(n[0] * along_n[1] + t[0] * along_t[1]),
                -(n[1] * along_n[0] + t[1] * along_t[0]), -(n[1] * along_n[1] + t[1] * along_t[1])};
    }

    /// Calls `visit(stencil, i, j, block)` with the part of dt K that couples the i-th and j-th node of each touch.
    void for_each_block(const auto& visit) const {
        for (std::size_t t = 0; t < touches_.size(); ++t) {
            const Stencil& s = touches_[t].stencil;
            for (std::size_t i = 0; i < s.count; ++i)
                for (std::size_t j = 0; j < s.count; ++j) {
                    std::array<double, 4> block = stiffness_[t];
                    for (double& entry : block)
                        entry *= s.value[i] * s.value[j];
                    visit(s, i, j, block);
                }
        }
    }

    bool midpoint_;
    double reach_;                           ///< a step moves no particle farther than two cells
    std::span<const RigidBody> bodies_;      // where prepare() found them, until the step has been made
    std::vector<Pose> begin_, middle_, end_; // of the bodies
    std::vector<Touch> touches_;
    std::vector<Force> outcomes_;                  // of touches, in the last step
    std::vector<std::array<double, 4>> stiffness_; // of touches, times dt
    std::vector<std::array<double, 2>> forces_;    // on the bodies, in the last step
};

} // namespace

std::unique_ptr<Discretisation> with_surface_contact(std::unique_ptr<Discretisation> within, const Scene& scene, bool midpoint) {
    return std::make_unique<SurfaceContact>(std::move(within), scene, midpoint);
}

} // namespace ductile::mpm
