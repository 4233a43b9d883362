// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/mpm/body_contact.hpp>
#include <ductile/mpm/carried_points.hpp>
#include <ductile/mpm/contact_spring.hpp>
#include <ductile/mpm/forwarding.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_map>
#include <vector>

namespace ductile::mpm {

namespace {

using Vector = PlaneVector;

Vector normal_of(const Vector& side) { return 1.0 / length(side) * Vector{side[1], -side[0]}; }

/// Where an edge is nearest to a point.
struct Nearest {
    std::size_t from = 0, to = 0; ///< surface points at the ends of the side
    double share = 0.0;           ///< xi
    double gap = std::numeric_limits<double>::infinity();
    Vector normal = {};
    double length = 0.0; ///< of the side; zero at a corner
};

/// What changes of places make of it.
struct Change {
    double gap, turn, share; ///< turn: dn.t
};

/// Edges of bodies, to look for what is near.
class Edges {
public:
    Edges(const Scene& scene, const Particles& particles)
        : scene_(&scene), particles_(&particles), deepest_(std::max(scene.grid.dx(), scene.grid.dy())), reach_(4.0 * deepest_) {
        const SurfacePoints& surface = particles.surface;
        previous_.assign(surface.size(), -1);
        for (std::size_t c = 0; c < surface.size(); ++c)
            if (surface.next[c] >= 0) {
                previous_[static_cast<std::size_t>(surface.next[c])] = static_cast<std::int64_t>(c);
                bins_[bin_of(place_of(particles, surface, c))].push_back(c);
            }
    }

    [[nodiscard]] std::size_t body_of(std::size_t c) const {
        return static_cast<std::size_t>(particles_->body[particles_->surface.carrier(c)]);
    }
    [[nodiscard]] double modulus_of(std::size_t c) const {
        const auto material = static_cast<std::size_t>(particles_->material[particles_->surface.carrier(c)]);
        return scene_->materials[material].law->elasticity().alpha();
    }

    /// The beginnings of sides of other fields that the point could come to in a step, body by body.
    void find(std::size_t c, std::vector<std::size_t>& sides) const {
        sides.clear();
        const Vector place = place_of(*particles_, particles_->surface, c);
        const auto [i, j] = bin_of(place);
        const int field = scene_->field_of_body[body_of(c)];
        const Vector outwards = outwards_at(c);
        for (int b = j - 1; b <= j + 1; ++b)
            for (int a = i - 1; a <= i + 1; ++a)
                if (const auto bin = bins_.find({a, b}); bin != bins_.end())
                    for (const std::size_t side : bin->second)
                        if (scene_->field_of_body[body_of(side)] != field &&
                            length(place_of(*particles_, particles_->surface, side) - place) <= reach_ && faces(outwards, side))
                            sides.push_back(side);
        std::ranges::sort(sides, {}, [&](std::size_t side) { return std::pair(body_of(side), side); });
    }

    /// Of these sides, with the places of surface points; the gap is infinite where none is near.
    [[nodiscard]] Nearest nearest(const Vector& place, std::span<const std::size_t> sides, const auto& place_of_point) const {
        Nearest found;
        double least = std::numeric_limits<double>::infinity(), xi = 0.0;
        bool beyond = false;
        for (const std::size_t from : sides) {
            const std::size_t to = after(from);
            const Vector a = place_of_point(from), side = place_of_point(to) - a;
            const double square = dot(side, side);
            if (!(square > 0.0))
                continue;
            const double along = dot(place - a, side) / square;
            const double low = previous_[from] < 0 ? -1.0 : 0.0, high = particles_->surface.next[to] < 0 ? 2.0 : 1.0;
            const double held = std::clamp(along, low, high);
            if (dot(place - a, normal_of(side)) < -deepest_)
                continue; // the far edge of a body
            if (const double distance = length(place - a - held * side); distance < least) {
                least = distance;
                xi = along;
                beyond = std::abs(along - held) > 1e-9;
                found = {.from = from, .to = to, .share = held};
            }
        }
        if (!std::isfinite(least))
            return found;
        const Vector a = place_of_point(found.from), side = place_of_point(found.to) - a;
        if (!beyond) {
            found.normal = normal_of(side);
            found.gap = dot(place - a, found.normal);
            found.length = length(side);
            return found;
        }
        const std::size_t corner = xi < 0.0 ? found.from : found.to;
        const std::int64_t before = previous_[corner], next = particles_->surface.next[corner];
        if (before < 0 || next < 0)
            return {};
        const Vector at = place_of_point(corner), arm = place - at;
        const Vector last = at - place_of_point(static_cast<std::size_t>(before)),
                     first = place_of_point(static_cast<std::size_t>(next)) - at;
        const bool reentrant = dot(normal_of(first), last) < 0.0; // only those are nearest to points within
        if (reentrant && (least > deepest_ || dot(arm, last) < 0.0 || dot(arm, first) > 0.0))
            return {}; // beside the end of a side that was not looked at
        found = {.from = corner, .to = corner};
        found.gap = reentrant ? -least : least;
        const Vector outwards = normal_of(last) + normal_of(first);
        found.normal = least > 0.0 ? 1.0 / found.gap * arm : 1.0 / length(outwards) * outwards;
        return found;
    }

    [[nodiscard]] std::size_t after(std::size_t c) const { return static_cast<std::size_t>(particles_->surface.next[c]); }
    [[nodiscard]] std::int64_t before(std::size_t c) const { return previous_[c]; }

private:
    [[nodiscard]] Vector side_from(std::size_t c) const {
        return place_of(*particles_, particles_->surface, after(c)) - place_of(*particles_, particles_->surface, c);
    }
    /// The mean normal of the sides that meet at a point; zero if none does.
    [[nodiscard]] Vector outwards_at(std::size_t c) const {
        Vector sum{};
        if (particles_->surface.next[c] >= 0)
            sum = sum + normal_of(side_from(c));
        if (previous_[c] >= 0)
            sum = sum + normal_of(side_from(static_cast<std::size_t>(previous_[c])));
        const double size = length(sum);
        return size > 0.0 ? 1.0 / size * sum : sum;
    }
    /// A side that does not face the edge that a point is on does not touch it: the front of a block would catch on the points of
    /// what it slides on.
    [[nodiscard]] bool faces(const Vector& outwards, std::size_t side) const {
        const Vector along = side_from(side);
        return dot(along, along) > 0.0 && (outwards == Vector{} || dot(outwards, normal_of(along)) < -0.2);
    }

    using Bin = std::pair<int, int>;
    struct Hash {
        std::size_t operator()(const Bin& bin) const {
            return static_cast<std::size_t>(bin.first) * 73856093u ^ static_cast<std::size_t>(bin.second) * 19349663u;
        }
    };
    [[nodiscard]] Bin bin_of(const Vector& place) const {
        return {static_cast<int>(std::floor((place[0] - scene_->grid.left) / reach_)),
                static_cast<int>(std::floor((place[1] - scene_->grid.bottom) / reach_))};
    }

    const Scene* scene_;
    const Particles* particles_;
    double deepest_; ///< that a point can be within a body
    double reach_;   ///< a step moves no particle farther than two cells
    std::vector<std::int64_t> previous_;
    std::unordered_map<Bin, std::vector<std::size_t>, Hash> bins_;
};

/// A surface point that another body may touch in this step.
struct Carried {
    Stencil stencil;          ///< its values are B
    NodalWeights at_particle; ///< N
    Vector place;             ///< where the step begins
};

struct BodyTouch {
    std::size_t point, body; ///< the body that it touches
    std::size_t first, last; ///< of the sides that it may come to
    Nearest begin;
    ContactSpring spring;
};

/// What a touch comes to with the ways of all points.
struct BodyForce {
    Nearest end, acting;                   ///< at the end of the step, and where the method takes the force
    double normal = 0.0, tangential = 0.0; ///< of the force that it takes
    double slid = 0.0;                     ///< way over the side

    [[nodiscard]] Vector force() const { return normal * acting.normal + tangential * tangent_of(acting.normal); }
};

/// Nodes that both ends of a side see.
struct United {
    std::size_t count = 0;
    std::array<std::int32_t, 18> node = {};
    std::array<double, 18> value = {};

    void add(const Stencil& s, double weight) {
        for (std::size_t k = 0; k < s.count; ++k) {
            const auto end = node.begin() + static_cast<std::ptrdiff_t>(count);
            const auto place = static_cast<std::size_t>(std::find(node.begin(), end, s.node[k]) - node.begin());
            if (place == count)
                node[count++] = s.node[k];
            value[place] += weight * s.value[k];
        }
    }
};

class BodyContact final : public Forwarding {
public:
    BodyContact(std::unique_ptr<Discretisation> within, const Scene& scene, bool midpoint)
        : Forwarding(std::move(within)), scene_(scene), midpoint_(midpoint && scene.finite_rotation) {}

    void prepare(Particles& particles, std::span<const RigidBody> rigid_bodies, double time, double dt) override {
        within().prepare(particles, rigid_bodies, time, dt);
        edges_.emplace(scene_, particles);
        find_touches(particles);
    }

    void internal_force(const Particles& particles, std::span<double> force, std::span<double> magnitudes) const override {
        within().internal_force(particles, force, magnitudes);
        for (const BodyTouch& touch : touches_)
            scatter_all(touch.point, touch.begin, touch.spring.force_at_begin(touch.begin.normal), force, magnitudes);
    }

    void force_after(const Particles& particles, std::span<const double> velocity, double dt, std::span<double> force,
                     std::span<double> magnitudes) const override {
        within().force_after(particles, velocity, dt, force, magnitudes);
        find_ways(velocity, dt);
        for (const BodyTouch& touch : touches_) {
            const BodyForce felt = after(touch);
            scatter_all(touch.point, felt.acting, felt.force(), force, magnitudes);
        }
    }

    void linearise(const Particles& particles, std::span<const double> velocity, double dt) override {
        within().linearise(particles, velocity, dt);
        find_ways(velocity, dt);
        linear_ways_ = ways_;
        dt_ = dt;
        linear_.clear();
        for (const BodyTouch& touch : touches_)
            linear_.push_back(after(touch));
    }

    void stiffness_times(std::span<const double> x, std::span<double> result) const override {
        within().stiffness_times(x, result);
        find_ways(x, dt_);
        for (std::size_t t = 0; t < touches_.size(); ++t) {
            const BodyForce& f = linear_[t];
            if (!(f.normal > 0.0))
                continue;
            const auto [of_force, of_share] = derivative(touches_[t], f);
            const Nearest& at = f.acting;
            const Vector moved = of_share * f.force();
            const std::size_t c = touches_[t].point;
            scatter(points_[c].stencil, -1.0 * of_force, result, {});
            scatter(points_[local(at.from)].stencil, (1.0 - at.share) * of_force - moved, result, {});
            scatter(points_[local(at.to)].stencil, at.share * of_force + moved, result, {});
        }
    }

    void stiffness_diagonal(std::span<double> diagonal) const override {
        within().stiffness_diagonal(diagonal);
        for_each_part([&](const United& part, const std::array<double, 4>& matrix) {
            for (std::size_t k = 0; k < part.count; ++k)
                for (std::size_t a = 0; a < 2; ++a)
                    diagonal[2 * part.node[k] + a] += part.value[k] * part.value[k] * matrix[3 * a];
        });
    }

    void stiffness_blocks(const AddBlock& add) const override {
        within().stiffness_blocks(add);
        std::vector<double> block;
        for_each_part([&](const United& part, const std::array<double, 4>& matrix) {
            const std::size_t width = 2 * part.count;
            block.resize(width * width);
            for (std::size_t r = 0; r < width; ++r)
                for (std::size_t c = 0; c < width; ++c)
                    block[r * width + c] = part.value[r / 2] * part.value[c / 2] * matrix[2 * (r % 2) + c % 2];
            add({part.node.data(), part.count}, block);
        });
    }

    ParticleEnergies advance(Particles& particles, const NodalMotion& motion) override {
        ParticleEnergies of_contact;
        find_ways(motion.straining, motion.dt);
        double lag = 0.0; // the work of what acts
        for (const BodyTouch& touch : touches_) {
            const Vector begin = touch.spring.force_at_begin(touch.begin.normal);
            lag -= (1.0 - motion.weight_at_end) * dot(begin, way_on(touch.point, touch.begin));
            if (motion.weight_at_end > 0.0) {
                const BodyForce felt = after(touch);
                lag -= motion.weight_at_end * dot(felt.force(), way_on(touch.point, felt.acting));
            }
        }
        // in the momentum form particles move with another velocity than the one that strains them
        for (std::size_t c = 0; c < points_.size(); ++c)
            ways_[c] = ways_[c] + motion.dt * (sum(points_[c].stencil, points_[c].at_particle, motion.motion) -
                                               sum(points_[c].stencil, points_[c].at_particle, motion.straining));
        std::vector<BodyForce> ends;
        for (const BodyTouch& touch : touches_)
            ends.push_back(after(touch));
        for (auto& held : particles.surface.held_by_bodies)
            std::ranges::fill(held, 0.0);
        for (std::size_t t = 0; t < touches_.size(); ++t) {
            BodyTouch& touch = touches_[t];
            const BodyForce& end = ends[t];
            const auto [rubbed, kept, held] = touch.spring.outcome(end.end.gap, end.tangential, end.slid);
            of_contact.friction += rubbed;
            of_contact.in_contact += kept;
            of_contact.of_lag -= rubbed + kept;
            if (touch.spring.friction > 0.0)
                particles.surface.held_by_bodies[touch.body][points_in_touch_[touch.point]] = held;
            touch.begin = end.end; // internal_force() is that of the particles where they are now
            touch.spring.gap = end.end.gap;
            touch.spring.held = held;
        }
        if (!moves()) // what the nodes do is counted there
            of_contact.of_lag += lag;
        ParticleEnergies energies = within().advance(particles, motion);
        energies.add(of_contact);
        return energies;
    }

    [[nodiscard]] std::size_t memory_bytes() const override {
        return within().memory_bytes() + sizeof(BodyTouch) * touches_.capacity() + sizeof(Carried) * points_.capacity();
    }

private:
    [[nodiscard]] std::size_t local(std::size_t c) const { return static_cast<std::size_t>(local_[c]); }

    void find_touches(const Particles& particles) {
        const SurfacePoints& surface = particles.surface;
        touches_.clear();
        sides_.clear();
        points_.clear();
        points_in_touch_.clear();
        local_.assign(surface.size(), -1);
        const auto take = [&](std::size_t c) {
            if (local_[c] >= 0)
                return;
            local_[c] = static_cast<std::int64_t>(points_.size());
            const Stencil s = within().stencil(surface.carrier(c));
            points_.push_back({carried(s, {surface.x[c], surface.y[c]}), s.value, place_of(particles, surface, c)});
            points_in_touch_.push_back(c);
        };
        std::vector<std::size_t> near;
        for (std::size_t c = 0; c < surface.size(); ++c) {
            edges_->find(c, near);
            for (std::size_t first = 0, last = 0; first < near.size(); first = last) {
                const std::size_t body = edges_->body_of(near[first]);
                while (last < near.size() && edges_->body_of(near[last]) == body)
                    ++last;
                const Nearest begin =
                    edges_->nearest(place_of(particles, surface, c), std::span(near).subspan(first, last - first),
                                    [&](std::size_t k) { return place_of(particles, surface, k); });
                take(c);
                for (std::size_t k = first; k < last; ++k) {
                    take(near[k]);
                    take(edges_->after(near[k]));
                    if (const std::int64_t before = edges_->before(near[k]); before >= 0)
                        take(static_cast<std::size_t>(before));
                    if (const std::int64_t next = surface.next[edges_->after(near[k])]; next >= 0)
                        take(static_cast<std::size_t>(next));
                }
                const double mine = edges_->modulus_of(c), other = edges_->modulus_of(near[first]);
                const std::vector<double>& friction = scene_.friction_of_body;
                const double rubs = friction.empty() ? 0.0 : std::max(friction[edges_->body_of(c)], friction[body]);
                touches_.push_back({local(c),
                                    body,
                                    sides_.size(),
                                    sides_.size() + last - first,
                                    begin,
                                    {0.5 * surface.stiffness[c] * other / (mine + other), rubs, begin.gap,
                                     rubs > 0.0 ? surface.held_by_bodies[body][c] : 0.0}});
                sides_.insert(sides_.end(), near.begin() + static_cast<std::ptrdiff_t>(first),
                              near.begin() + static_cast<std::ptrdiff_t>(last));
            }
        }
        ways_.resize(points_.size());
    }

    void find_ways(std::span<const double> velocity, double dt) const {
        for (std::size_t c = 0; c < points_.size(); ++c)
            ways_[c] = dt * sum(points_[c].stencil, points_[c].stencil.value, velocity);
    }

    /// Of a point over what it is near to, d_c - (1 - xi) d_a - xi d_b.
    [[nodiscard]] Vector way_on(std::size_t point, const Nearest& at) const {
        if (!std::isfinite(at.gap))
            return {};
        return ways_[point] - (1.0 - at.share) * ways_[local(at.from)] - at.share * ways_[local(at.to)];
    }

    [[nodiscard]] Nearest nearest_after(const BodyTouch& touch, double part) const {
        return edges_->nearest(points_[touch.point].place + part * ways_[touch.point],
                               std::span(sides_).subspan(touch.first, touch.last - touch.first),
                               [&](std::size_t c) { return points_[local(c)].place + part * ways_[local(c)]; });
    }

    /// With the ways of find_ways().
    [[nodiscard]] BodyForce after(const BodyTouch& touch) const {
        BodyForce result{.end = nearest_after(touch, 1.0), .acting = {}};
        result.acting = midpoint_ ? nearest_after(touch, 0.5) : result.end;
        if (!std::isfinite(result.acting.gap) || !std::isfinite(result.end.gap))
            return result;
        result.normal = touch.spring.normal(result.end.gap, midpoint_);
        result.slid = dot(way_on(touch.point, result.acting), tangent_of(result.acting.normal));
        result.tangential = touch.spring.tangential(result.slid, result.normal);
        return result;
    }

    /// By the ways of find_ways().
    [[nodiscard]] Change change(std::size_t point, const Nearest& at) const {
        const Vector over = way_on(point, at), t = tangent_of(at.normal);
        if (at.length == 0.0)
            return {dot(at.normal, over), at.gap != 0.0 ? dot(t, over) / at.gap : 0.0, 0.0};
        const double turned = dot(at.normal, ways_[local(at.to)] - ways_[local(at.from)]) / at.length;
        return {dot(at.normal, over), -turned, (dot(t, over) + at.gap * turned) / at.length};
    }

    /// Of F and xi, by the ways of find_ways().
    [[nodiscard]] std::pair<Vector, double> derivative(const BodyTouch& touch, const BodyForce& f) const {
        const double part = midpoint_ ? 0.5 : 1.0; // of the ways leads to where the force acts
        const Nearest& at = f.acting;
        const Change end = change(touch.point, f.end), acting = change(touch.point, at);
        const double turn = part * acting.turn, share = part * acting.share;
        const Vector n = at.normal, t = tangent_of(n);
        const double of_normal = touch.spring.slope_of_normal(f.end.gap, f.normal, midpoint_) * end.gap;
        double of_tangential = 0.0;
        if (touch.spring.friction > 0.0) {
            const auto& way = linear_ways_;
            const Vector over = way[touch.point] - (1.0 - at.share) * way[local(at.from)] - at.share * way[local(at.to)];
            of_tangential = touch.spring.sticks(f.slid, f.normal)
                                ? -touch.spring.stiffness * (dot(t, way_on(touch.point, at)) - turn * dot(n, over) +
                                                             share * dot(t, way[local(at.from)] - way[local(at.to)]))
                                : std::copysign(touch.spring.friction, f.tangential) * of_normal;
        }
        return {(of_normal - f.tangential * turn) * n + (f.normal * turn + of_tangential) * t, share};
    }

    /// Calls `visit(part, matrix)` with the point and the side of each touch: their nodes, and the symmetric 2 x 2 matrix that
    /// couples the i-th and the j-th, divided by their values.
    void for_each_part(const auto& visit) const {
        for (std::size_t k = 0; k < touches_.size(); ++k) {
            const BodyTouch& touch = touches_[k];
            const BodyForce& f = linear_[k];
            if (!(f.normal > 0.0))
                continue;
            const Vector n = f.acting.normal, t = tangent_of(n);
            const double along_n = -dt_ * touch.spring.slope_of_normal(f.end.gap, f.normal, midpoint_);
            const double along_t =
                touch.spring.friction > 0.0 && touch.spring.sticks(f.slid, f.normal) ? dt_ * touch.spring.stiffness : 0.0;
            std::array<double, 4> matrix{};
            for (std::size_t a = 0; a < 2; ++a)
                for (std::size_t b = 0; b < 2; ++b)
                    matrix[2 * a + b] = along_n * n[a] * n[b] + along_t * t[a] * t[b];
            United point, side;
            point.add(points_[touch.point].stencil, 1.0);
            side.add(points_[local(f.acting.from)].stencil, 1.0 - f.acting.share);
            side.add(points_[local(f.acting.to)].stencil, f.acting.share);
            visit(point, matrix);
            visit(side, matrix);
        }
    }

    void scatter_all(std::size_t point, const Nearest& at, const Vector& force, std::span<double> nodal,
                     std::span<double> magnitudes) const {
        if (force == Vector{})
            return;
        scatter(points_[point].stencil, force, nodal, magnitudes);
        scatter(points_[local(at.from)].stencil, -(1.0 - at.share) * force, nodal, magnitudes);
        scatter(points_[local(at.to)].stencil, -at.share * force, nodal, magnitudes);
    }

    Scene scene_;
    bool midpoint_;
    std::optional<Edges> edges_;
    std::vector<Carried> points_;
    std::vector<std::size_t> points_in_touch_; // which surface points they are
    std::vector<std::int64_t> local_;          // their place in points_
    std::vector<std::size_t> sides_;           // of the touches
    std::vector<BodyTouch> touches_;
    mutable std::vector<Vector> ways_; // of points_
    std::vector<Vector> linear_ways_;  // and of linear_
    std::vector<BodyForce> linear_;    // of the touches, where the derivative is taken
    double dt_ = 0.0;
};

} // namespace

std::unique_ptr<Discretisation> with_body_contact(std::unique_ptr<Discretisation> within, const Scene& scene, bool midpoint) {
    return std::make_unique<BodyContact>(std::move(within), scene, midpoint);
}

double deepest_body_contact(const Particles& particles, const Scene& scene) {
    if (!has_fields(scene))
        return 0.0;
    const Edges edges(scene, particles);
    double deepest = 0.0;
    std::vector<std::size_t> near;
    for (std::size_t c = 0; c < particles.surface.size(); ++c) {
        edges.find(c, near);
        for (std::size_t first = 0, last = 0; first < near.size(); first = last) {
            while (last < near.size() && edges.body_of(near[last]) == edges.body_of(near[first]))
                ++last;
            const Nearest nearest =
                edges.nearest(place_of(particles, particles.surface, c), std::span(near).subspan(first, last - first),
                              [&](std::size_t k) { return place_of(particles, particles.surface, k); });
            deepest = std::max(deepest, -nearest.gap);
        }
    }
    return deepest;
}

} // namespace ductile::mpm
