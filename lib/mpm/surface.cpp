// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/mpm/body.hpp>
#include <ductile/mpm/carried_points.hpp>
#include <ductile/mpm/scene.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>

namespace ductile::mpm {

namespace {

using Point = PlaneVector;

/// Of one of a polygon's sides the point that is nearest to another.
Point nearest_on(const Point& from, const Point& to, const Point& place) {
    const Point side = to - from;
    const double square = dot(side, side);
    return square > 0.0 ? from + std::clamp(dot(place - from, side) / square, 0.0, 1.0) * side : from;
}

/// Twice the area that a polygon encloses, positive if it goes around that counterclockwise.
double twice_area(const std::vector<Point>& corners) {
    double sum = 0.0;
    for (std::size_t k = 0; k < corners.size(); ++k) {
        const Point &a = corners[k], &b = corners[(k + 1) % corners.size()];
        sum += a[0] * b[1] - a[1] * b[0];
    }
    return sum;
}

Gap gap_to_polygon(const std::vector<Point>& corners, const Point& place) {
    double least = std::numeric_limits<double>::infinity();
    Point nearest{}, side{};
    for (std::size_t k = 0; k < corners.size(); ++k) {
        const Point &a = corners[k], &b = corners[(k + 1) % corners.size()];
        const Point candidate = nearest_on(a, b, place);
        if (const double distance = length(place - candidate); distance < least) {
            least = distance;
            nearest = candidate;
            side = b - a;
        }
    }
    const double sign = encloses(corners, place[0], place[1]) ? -1.0 : 1.0;
    const double turn = twice_area(corners) > 0.0 ? 1.0 : -1.0;
    const Point of_side = turn / length(side) * Point{side[1], -side[0]};
    const Point away = place - nearest;
    // at a corner the normal is that of the line to it; on the surface itself, that of the side
    const bool at_corner = std::abs(dot(away, of_side)) < (1.0 - 1e-9) * least;
    if (!at_corner)
        return {sign * least, of_side, 0.0};
    return {sign * least, sign / least * away, sign / least};
}

/// Points of an outline up to `spacing` apart, corners included.
std::vector<Point> places_on(const Outline& outline, double spacing) {
    std::vector<Point> corners = outline.corners;
    if (corners.empty()) {
        // symmetric in x and y, with corners on both axes: a plane of symmetry meets the edge there
        const int quarter = std::max(3, static_cast<int>(std::ceil(0.5 * std::numbers::pi * outline.radius / spacing)));
        for (int turns = 0; turns < 4; ++turns)
            for (int k = 0; k < quarter; ++k) {
                const double angle = 0.5 * std::numbers::pi * k / quarter, c = std::cos(angle),
                             s = k == 0 ? 0.0 : std::sin(angle);
                const Point turned[] = {{c, s}, {-s, c}, {-c, -s}, {s, -c}};
                corners.push_back(outline.centre + outline.radius * turned[turns]);
            }
    }
    std::vector<Point> places;
    for (std::size_t k = 0; k < corners.size(); ++k) {
        const Point side = corners[(k + 1) % corners.size()] - corners[k];
        const int parts = std::max(1, static_cast<int>(std::ceil(length(side) / spacing - 1e-9)));
        for (int j = 0; j < parts; ++j)
            places.push_back(corners[k] + (static_cast<double>(j) / parts) * side);
    }
    return places;
}

/// Which side of the way from one place to another is outside of a shape: 1, the right one, -1, the left one, or 0, both or none:
/// it is no edge. Looked for a little beside the middle, farther than a chord of a circle is from that.
int outside(const Shape& shape, const Point& from, const Point& to, double spacing) {
    const Point side = to - from, middle = 0.5 * (from + to);
    const double size = length(side);
    if (!(size > 0.0))
        return 0;
    const Point right = (0.25 * spacing / size) * Point{side[1], -side[0]};
    return static_cast<int>(shape(middle[0] - right[0], middle[1] - right[1])) -
           static_cast<int>(shape(middle[0] + right[0], middle[1] + right[1]));
}

/// The points of an outline, as far as that is the edge of a shape.
struct Edge {
    std::vector<Point> places;
    std::vector<double> share; ///< the part of the edge that each stands for; 0: it is not on the edge
    std::vector<int> right;    ///< outside() of the side that begins there
};

Edge edge_of(const Outline& outline, const Shape& shape, double spacing, const std::function<double(const Point&)>& weight) {
    Edge edge{.places = places_on(outline, spacing), .share = {}, .right = {}};
    const std::vector<Point>& places = edge.places;
    std::vector<double> before(places.size(), 0.0),
        after(places.size(), 0.0); // what a place stands for of the sides that meet there
    for (std::size_t k = 0; k < places.size(); ++k) {
        const std::size_t next = (k + 1) % places.size();
        edge.right.push_back(outside(shape, places[k], places[next], spacing));
        if (edge.right.back() == 0)
            continue;
        const double half = 0.5 * length(places[next] - places[k]);
        after[k] = half * weight(0.75 * places[k] + 0.25 * places[next]);
        before[next] = half * weight(0.25 * places[k] + 0.75 * places[next]);
    }
    for (std::size_t k = 0; k < places.size(); ++k) {
        const Point last = places[k] - places[(k + places.size() - 1) % places.size()];
        const Point next = places[(k + 1) % places.size()] - places[k];
        const double along = dot(last, next) / (length(last) * length(next));
        // a plane that a sharp corner lies on sees one of the sides
        edge.share.push_back(std::max(before[k], after[k]) + std::max(along, 0.0) * std::min(before[k], after[k]));
    }
    return edge;
}

/// Particles of a body by cells.
class Neighbours {
public:
    Neighbours(const Grid& grid, const Particles& particles, std::size_t first, std::size_t last)
        : grid_(grid), particles_(particles) {
        for (std::size_t p = first; p < last; ++p)
            cells_[cell_of({particles.x[p], particles.y[p]})].push_back(p);
    }

    /// The nearest within a cell of a place; the number of particles if there is none.
    [[nodiscard]] std::size_t nearest(const Point& place) const {
        const auto [i, j] = cell_of(place);
        std::size_t found = particles_.size();
        double least = std::max(grid_.dx(), grid_.dy());
        for (int b = j - 1; b <= j + 1; ++b)
            for (int a = i - 1; a <= i + 1; ++a)
                if (const auto cell = cells_.find({a, b}); cell != cells_.end())
                    for (const std::size_t p : cell->second)
                        if (const double distance = std::hypot(particles_.x[p] - place[0], particles_.y[p] - place[1]);
                            distance < least) {
                            least = distance;
                            found = p;
                        }
        return found;
    }

    /// Whether no particle lies beyond the side of a particle's box that is `towards` there from its middle.
    [[nodiscard]] bool none_beyond(std::size_t p, const Point& towards) const {
        const Point beyond = Point{particles_.x[p], particles_.y[p]} + 2.0 * towards;
        const std::size_t other = nearest(beyond);
        return other == particles_.size() || other == p ||
               std::hypot(particles_.x[other] - beyond[0], particles_.y[other] - beyond[1]) >
                   1.4 * std::max(particles_.half_width[p], particles_.half_height[p]);
    }

private:
    [[nodiscard]] std::pair<int, int> cell_of(const Point& place) const {
        return {static_cast<int>(std::floor((place[0] - grid_.left) / grid_.dx())),
                static_cast<int>(std::floor((place[1] - grid_.bottom) / grid_.dy()))};
    }

    const Grid& grid_;
    const Particles& particles_;
    std::map<std::pair<int, int>, std::vector<std::size_t>> cells_;
};

} // namespace

PlaneVector Pose::place(const RigidBody& body, const PlaneVector& at_start) const {
    const Point arm = at_start - body.centre;
    return body.centre + Point{displacement.u, displacement.v} +
           Point{cosine * arm[0] - sine * arm[1], sine * arm[0] + cosine * arm[1]};
}

PlaneVector Pose::at_start(const RigidBody& body, const PlaneVector& place) const {
    const Point arm = place - body.centre - Point{displacement.u, displacement.v};
    return body.centre + Point{cosine * arm[0] + sine * arm[1], cosine * arm[1] - sine * arm[0]};
}

double reach_of(const RigidBody& body) {
    if (!body.surface)
        return 0.0;
    double reach = body.surface->corners.empty() ? length(body.surface->centre - body.centre) + body.surface->radius : 0.0;
    for (const Point& corner : body.surface->corners)
        reach = std::max(reach, length(corner - body.centre));
    return reach;
}

Pose pose_of(const RigidBody& body, double time) {
    const double angle = body.spin.displacement(time);
    return {body.velocity.displacement(time), std::cos(angle), std::sin(angle)};
}

Gap gap_to(const RigidBody& body, const Pose& pose, const PlaneVector& place) {
    const Outline& surface = *body.surface;
    const Point there = pose.at_start(body, place);
    Gap gap;
    if (surface.corners.empty()) {
        const Point arm = there - surface.centre;
        const double distance = length(arm);
        gap = distance > 0.0 ? Gap{distance - surface.radius, 1.0 / distance * arm, 1.0 / distance}
                             : Gap{-surface.radius, {1.0, 0.0}, 0.0};
    } else {
        gap = gap_to_polygon(surface.corners, there);
    }
    const auto [x, y] = gap.normal;
    gap.normal = {pose.cosine * x - pose.sine * y, pose.sine * x + pose.cosine * y};
    return gap;
}

double deepest_contact(const Particles& particles, std::span<const RigidBody> bodies, double time) {
    double deepest = 0.0;
    for (const RigidBody& body : bodies)
        if (body.surface) {
            const Pose pose = pose_of(body, time);
            for (std::size_t c = 0; c < particles.surface.size(); ++c)
                deepest = std::max(deepest, -gap_to(body, pose, place_of(particles, particles.surface, c)).gap);
        }
    return deepest;
}

void add_surface(Particles& particles, std::size_t first, std::size_t last, const Shape& shape, double modulus,
                 const Scene& scene) {
    const Neighbours neighbours(scene.grid, particles, first, last);
    const auto radius = [&](const Point& place) { return scene.geometry == Geometry::axisymmetric ? std::abs(place[0]) : 1.0; };
    SurfacePoints& surface = particles.surface;
    /// Its number, or -1 where none is added.
    const auto add = [&](const Point& place, double share) -> std::int64_t {
        const bool wanted = share > 0.0 && contains(scene.grid, place[0], place[1]);
        const std::size_t p = wanted ? neighbours.nearest(place) : particles.size();
        if (p == particles.size())
            return -1;
        const double size = 2.0 * std::sqrt(particles.half_width[p] * particles.half_height[p]);
        surface.particle.push_back(static_cast<std::int64_t>(p));
        surface.x.push_back(place[0] - particles.x[p]);
        surface.y.push_back(place[1] - particles.y[p]);
        surface.next.push_back(-1);
        surface.stiffness.push_back(modulus * share / size);
        return static_cast<std::int64_t>(surface.size()) - 1;
    };
    const auto join = [&](std::int64_t from, std::int64_t to) {
        if (from >= 0 && to >= 0)
            surface.next[static_cast<std::size_t>(from)] = to;
    };
    const double spacing = 2.0 * std::min(particles.half_width[first], particles.half_height[first]);
    for (const Outline& outline : shape.outlines()) {
        const Edge edge = edge_of(outline, shape, spacing, radius);
        std::vector<std::int64_t> number;
        for (std::size_t k = 0; k < edge.places.size(); ++k)
            number.push_back(add(edge.places[k], edge.share[k]));
        for (std::size_t k = 0; k < number.size(); ++k)
            if (const std::int64_t here = number[k], there = number[(k + 1) % number.size()]; edge.right[k] > 0)
                join(here, there);
            else if (edge.right[k] < 0)
                join(there, here);
    }
    if (!shape.outlines().empty())
        return;
    // of particles without a shape, the corners of their boxes at sides beyond which there is no other
    constexpr std::array<Point, 4> corners{{{1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}, {-1.0, -1.0}}}; // counterclockwise
    for (std::size_t p = first; p < last; ++p) {
        const Point centre{particles.x[p], particles.y[p]}, half{particles.half_width[p], particles.half_height[p]};
        const auto at = [&](const Point& part) { return centre + Point{part[0] * half[0], part[1] * half[1]}; };
        std::array<bool, 4> is_edge{}; // the side from a corner to the next
        std::array<double, 4> part{};  // of it, that each end stands for
        for (std::size_t k = 0; k < 4; ++k) {
            const Point out = 0.5 * (corners[k] + corners[(k + 1) % 4]);
            is_edge[k] = neighbours.none_beyond(p, {out[0] * half[0], out[1] * half[1]});
            part[k] = is_edge[k] ? half[k % 2 == 0 ? 1 : 0] : 0.0;
        }
        std::array<std::int64_t, 4> number{};
        for (std::size_t k = 0; k < 4; ++k) {
            const std::size_t before = (k + 3) % 4;
            number[k] = add(at(corners[k]), std::max(part[before] * radius(at(0.25 * corners[before] + 0.75 * corners[k])),
                                                     part[k] * radius(at(0.75 * corners[k] + 0.25 * corners[(k + 1) % 4]))));
        }
        for (std::size_t k = 0; k < 4; ++k)
            if (is_edge[k])
                join(number[k], number[(k + 1) % 4]);
    }
}

void add_loaded_sides(Particles& particles, std::size_t first, std::size_t last, const Shape& shape, const Shape& region,
                      std::int64_t load, const Scene& scene) {
    const Neighbours neighbours(scene.grid, particles, first, last);
    LoadedSides& loaded = particles.loaded;
    const auto add = [&](const Point& from, const Point& to) {
        const Point middle = 0.5 * (from + to);
        if (!region(middle[0], middle[1]) || !contains(scene.grid, middle[0], middle[1]))
            return;
        const std::size_t p = neighbours.nearest(middle);
        if (p == particles.size())
            return;
        loaded.particle.push_back(static_cast<std::int64_t>(p));
        loaded.x.push_back(middle[0] - particles.x[p]);
        loaded.y.push_back(middle[1] - particles.y[p]);
        loaded.along_x.push_back(to[0] - from[0]);
        loaded.along_y.push_back(to[1] - from[1]);
        loaded.area.push_back(length(to - from) * (scene.geometry == Geometry::axisymmetric ? middle[0] : 1.0));
        loaded.load.push_back(load);
    };
    const double spacing = 2.0 * std::min(particles.half_width[first], particles.half_height[first]);
    for (const Outline& outline : shape.outlines()) {
        const std::vector<Point> places = places_on(outline, spacing);
        for (std::size_t k = 0; k < places.size(); ++k) {
            const Point &from = places[k], &to = places[(k + 1) % places.size()];
            if (const int right = outside(shape, from, to, spacing); right > 0)
                add(from, to);
            else if (right < 0)
                add(to, from);
        }
    }
    if (!shape.outlines().empty())
        return;
    for (std::size_t p = first; p < last; ++p) {
        const Point centre{particles.x[p], particles.y[p]};
        const double a = particles.half_width[p], b = particles.half_height[p];
        for (const Point& out : {Point{a, 0.0}, Point{-a, 0.0}, Point{0.0, b}, Point{0.0, -b}})
            if (neighbours.none_beyond(p, out)) {
                const Point along = out[0] != 0.0 ? Point{0.0, std::copysign(b, out[0])} : Point{std::copysign(a, -out[1]), 0.0};
                add(centre + out - along, centre + out + along);
            }
    }
}

} // namespace ductile::mpm
