// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/mpm/grid.hpp>
#include <ductile/mpm/particles.hpp>
#include <ductile/scene/history.hpp>
#include <ductile/scene/shape.hpp>

#include <string>
#include <vector>

namespace ductile::mpm {

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

struct Scene;

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

/// A rigid body: it moves with a given velocity, and every node that one of its points touches moves with it, over a step with
/// its mean.
struct RigidBody {
    std::string name;
    History<Velocity> velocity = {};     ///< [m/s]
    bool holds_x = true, holds_y = true; ///< which components of the nodes' velocity it prescribes; both: no slip
    std::vector<double> x = {}, y = {};  ///< its points
    double half_width = 0.25;            ///< of the box of a point for GIMP, in cells: half the distance of its points
};

/// The points of a rigid body, from trial points as in add_body. They may lie outside the grid, as far beyond a side as the grid
/// is wide or high, and hold nodes once they come in. Throws InputError when there is none.
[[nodiscard]] RigidBody make_rigid_body(const std::string& name, const Shape& shape, int particles_per_side, const Grid& grid);

} // namespace ductile::mpm
