// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/material/law.hpp>
#include <ductile/material/plausibility.hpp>
#include <ductile/mpm/body.hpp>
#include <ductile/mpm/grid.hpp>

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace ductile::mpm {

enum class ShapeFunction { linear, gimp, bspline };

/// A law and what else belongs to a material.
struct Material {
    Law law;                    ///< in SI
    double heat_capacity = 0.0; ///< per mass, c of (2.3.5) [J/(kg K)]; 0: the temperature stays
};

/// Specific body force b of (2.1.2) [m/s^2] on the particle with this number, at this place and time. It is called on several
/// threads at once, and must not throw.
using BodyForce = std::function<std::array<double, 2>(std::int64_t id, double x, double y, double time)>;

/// What presses or pulls the edge of a body, on LoadedSides: a pressure, along the normal of the deformed edge and on its area
/// there; and a traction in a fixed direction, on the area at the start.
struct Load {
    std::string name;
    History<double> pressure = {};   ///< [Pa]
    History<Velocity> traction = {}; ///< [Pa]
};

/// What does not change during a run.
struct Scene {
    Geometry geometry = Geometry::plane_strain;
    Grid grid = {};
    ShapeFunction shape = ShapeFunction::linear;
    std::vector<Material> materials = {};
    /// Jaumann's rate: the stress turns with the material. Without it strains and rotations must be small.
    bool finite_rotation = true;
    BodyForce body_force = {}; ///< none if empty
    /// Affine transfers, see Discretisation. Otherwise those of the paper.
    bool affine = false;
    /// Whether rigid bodies may have surfaces, which the surface points of the particles touch.
    bool surface_contact = false;
    /// By number of body: bodies of one field share the nodes' velocity, and stick where they meet; those of different ones touch
    /// by their surfaces (BodyContact). Empty: all are of one.
    std::vector<int> field_of_body = {};
    std::vector<double> friction_of_body = {}; ///< Coulomb's coefficient; of two that touch the larger one; empty: none
    std::vector<Load> loads = {};
};

/// Whether the stress depends linearly on the velocity, for any state: one linear solve is an implicit step.
[[nodiscard]] bool is_linear(const Scene& scene);

/// Whether some bodies do not share the nodes' velocity.
[[nodiscard]] bool has_fields(const Scene& scene);

/// Whether a law of the scene is one at finite strain.
[[nodiscard]] bool has_finite_strain(const Scene& scene);

/// The speed of the fastest elastic wave of any particle [m/s]: that of dilatation, sqrt((lambda + 2 mu)/rho), or, in plane
/// stress, of a plate, sqrt(E/((1 - nu^2) rho)).
[[nodiscard]] double fastest_wave(const Scene& scene, const Particles& particles);
/// The largest speed of longitudinal bar waves sqrt(E/rho) among the particles [m/s].
[[nodiscard]] double largest_wave_speed(const Scene& scene, const Particles& particles);

/// The numbers of each material that has particles, as they are at the start: its smallest density, the largest speed of its
/// particles and of rigid bodies.
[[nodiscard]] std::vector<MaterialNumbers> material_numbers(const Scene& scene, const Particles& particles,
                                                            std::span<const RigidBody> rigid_bodies);

/// Throws InputError unless the particles have room for the internal variables of every law, and for affine velocities where the
/// transfers are affine.
void check_internal(const Scene& scene, const Particles& particles);

/// Throws InputError, naming the particle or the rigid body and what is wrong with it, unless a run can start from here: the grid
/// is possible, and wide enough where it is periodic; there are particles, all in the grid, of materials that are there, with
/// finite numbers, positive mass and density and, for GIMP, widths up to a cell; rigid bodies have points; and the body force on
/// every particle at `time` is finite.
void check(const Scene& scene, const Particles& particles, std::span<const RigidBody> rigid_bodies = {}, double time = 0.0);

} // namespace ductile::mpm
