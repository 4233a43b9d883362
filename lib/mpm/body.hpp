// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/mpm/grid.hpp>
#include <ductile/mpm/particles.hpp>
#include <ductile/scene/history.hpp>
#include <ductile/scene/shape.hpp>

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace ductile::mpm {

struct Scene;

/// A deformable body at the start.
struct Body {
    Shape shape;
    int material = 0; ///< number of its law in the scene
    double density = 0.0;
    double velocity_x = 0.0, velocity_y = 0.0;
    int particles_per_side = 2;        ///< of a cell: four particles a cell by default
    std::vector<double> internal = {}; ///< initial values of its law's internal variables; empty: what the law starts with
    std::string name = "a body";       ///< for messages
};

/// The initial values of a body's internal variables. Throws InputError when there is no such material, they are not as many as
/// its law has, or one is impossible.
[[nodiscard]] std::vector<double> starts_of(const Body& body, const Scene& scene);

/// Adds the particles of a body: trial points evenly spaced in every cell of the grid, kept where they lie in the shape, each
/// with the mass of its share of the cell (2.2.2), times its radius in axisymmetry. All must lie in the grid: throws InputError,
/// with the extents of both, for a shape that crosses its edge (looked for as far beyond a side as the grid is wide or high), but
/// where what lies beyond is the mirror image of what lies within, at a side that slips (a plane of symmetry) or at the axis.
/// Throws InputError, too, when there is no particle, or when density, velocity, internal variables or the number of particles a
/// cell are impossible, or there is no such material.
void add_body(Particles& particles, const Body& body, const Scene& scene);

/// A rigid body: it moves with a given velocity. Either every node that one of its points touches moves with it, over a step with
/// its mean; or it has a surface, which the surfaces of bodies touch and do not pass (SurfaceContact).
struct RigidBody {
    std::string name;
    History<Velocity> velocity = {};     ///< [m/s]
    bool holds_x = true, holds_y = true; ///< which components of the nodes' velocity it prescribes; both: no slip
    std::vector<double> x = {}, y = {};  ///< its points
    double half_width = 0.25;            ///< of the box of a point for GIMP, in cells: half the distance of its points
    std::optional<Outline> surface = {}; ///< at time 0
    double friction = 0.0;               ///< Coulomb's coefficient on its surface
    History<double> spin = {};           ///< angular velocity [1/s], where it has a surface
    std::array<double, 2> centre = {};   ///< that it turns about, at time 0
};

/// How far the surface reaches from the centre that it turns about [m]; zero without one.
[[nodiscard]] double reach_of(const RigidBody& body);

/// Where a rigid body is: displaced, and turned about its centre.
struct Pose {
    Velocity displacement = {}; ///< [m]
    double cosine = 1.0, sine = 0.0;

    [[nodiscard]] std::array<double, 2> place(const RigidBody& body, const std::array<double, 2>& at_start) const;
    [[nodiscard]] std::array<double, 2> at_start(const RigidBody& body, const std::array<double, 2>& place) const;
};
[[nodiscard]] Pose pose_of(const RigidBody& body, double time);

/// How far a point is from a body's surface.
struct Gap {
    double gap = 0.0;                  ///< negative within the body [m]
    std::array<double, 2> normal = {}; ///< out of the body, where the surface is nearest
    double curvature = 0.0;            ///< by which the normal turns along a line parallel to the surface [1/m]
};
[[nodiscard]] Gap gap_to(const RigidBody& body, const Pose& pose, const std::array<double, 2>& place);

/// How deep surface points lie within rigid bodies where they do most [m]; zero where none does.
[[nodiscard]] double deepest_contact(const Particles& particles, std::span<const RigidBody> bodies, double time);

/// Adds points on the edge of a shape to the surface of a body that has the particles from `first` to before `last`: corners, and
/// between them others, as near to each other as particles, and the sides from one to the next; of a shape without outlines, the
/// corners and sides of particles' boxes there.
/// Each goes with the nearest particle, and has the stiffness that `modulus` [Pa] and a particle's size give to its share of the
/// edge. Where no particle is within a cell there is no point, nor outside the grid.
void add_surface(Particles& particles, std::size_t first, std::size_t last, const Shape& shape, double modulus,
                 const Scene& scene);

/// The points of a rigid body, from trial points as in add_body. They may lie outside the grid, as far beyond a side as the grid
/// is wide or high, and hold nodes once they come in. Throws InputError when there is none.
[[nodiscard]] RigidBody make_rigid_body(const std::string& name, const Shape& shape, int particles_per_side, const Grid& grid);

/// Puts a load on the sides of a body's edge, as short as particles, whose middles lie in a region; of a shape without outlines,
/// on those of particles' boxes. Arguments as of add_surface().
void add_loaded_sides(Particles& particles, std::size_t first, std::size_t last, const Shape& shape, const Shape& region,
                      std::int64_t load, const Scene& scene);

} // namespace ductile::mpm
