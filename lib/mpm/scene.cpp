// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/mpm/body_contact.hpp>
#include <ductile/mpm/scene.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <string_view>

namespace ductile::mpm {

bool is_linear(const Scene& scene) {
    const bool follows = std::ranges::any_of(scene.loads, [](const Load& load) { return load.pressure != History<double>(); });
    return !scene.finite_rotation && !scene.surface_contact && !follows &&
           std::all_of(scene.materials.begin(), scene.materials.end(),
                       [](const Material& material) { return material.law->linear(); });
}

bool has_fields(const Scene& scene) {
    return std::ranges::any_of(scene.field_of_body, [](int field) { return field > 0; });
}

bool has_finite_strain(const Scene& scene) {
    return std::ranges::any_of(scene.materials,
                               [](const Material& material) { return material.law->finite_strain() != nullptr; });
}

namespace {

/// The largest sqrt(modulus/density) of any particle.
double fastest(const Scene& scene, const Particles& particles, const auto& modulus_of) {
    double largest = 0.0;
    for (std::size_t m = 0; m < scene.materials.size(); ++m) {
        const double modulus = modulus_of(scene.materials[m].law->elasticity());
        for (std::size_t p = 0; p < particles.size(); ++p)
            if (particles.material[p] == static_cast<std::int64_t>(m))
                largest = std::max(largest, modulus / particles.density[p]);
    }
    return std::sqrt(largest);
}

} // namespace

double fastest_wave(const Scene& scene, const Particles& particles) {
    return fastest(scene, particles, [&](const IsotropicElasticity& e) {
        return scene.geometry == Geometry::plane_stress ? e.alpha() - e.beta() * e.beta() / e.alpha() : e.alpha();
    });
}

double largest_wave_speed(const Scene& scene, const Particles& particles) { return fastest(scene, particles, young_modulus); }

std::vector<MaterialNumbers> material_numbers(const Scene& scene, const Particles& particles,
                                              std::span<const RigidBody> rigid_bodies) {
    double rigid_speed = 0.0;
    for (const RigidBody& body : rigid_bodies)
        rigid_speed = std::max(
            rigid_speed, body.velocity.largest([](const Velocity& velocity) { return std::hypot(velocity.u, velocity.v); }, 0.0));
    std::vector<MaterialNumbers> all;
    for (std::size_t m = 0; m < scene.materials.size(); ++m) {
        MaterialNumbers numbers{.name = scene.materials.size() > 1 ? fmt::format("material {}", m) : "the material",
                                .heat_capacity = scene.materials[m].heat_capacity,
                                .speed = rigid_speed};
        std::vector<double> internal(scene.materials[m].law->variables().size());
        bool used = false;
        for (std::size_t p = 0; p < particles.size(); ++p)
            if (particles.material[p] == static_cast<std::int64_t>(m)) {
                numbers.density = used ? std::min(numbers.density, particles.density[p]) : particles.density[p];
                numbers.speed = std::max(numbers.speed, std::hypot(particles.velocity_x[p], particles.velocity_y[p]));
                for (std::size_t k = 0; k < internal.size(); ++k)
                    internal[k] = particles.internal[k][p];
                used = true;
            }
        if (!used)
            continue;
        const Law& law = scene.materials[m].law;
        const IsotropicElasticity& e = law->elasticity();
        numbers.young_modulus = young_modulus(e);
        numbers.poisson_ratio = poisson_ratio(e);
        if (const double yield = law->equivalent_yield_stress(internal); std::isfinite(yield)) {
            numbers.yield_stress = yield;
            if (!internal.empty()) {
                internal[0] += 1e-3;
                numbers.hardening = (law->equivalent_yield_stress(internal) - yield) / 1e-3;
            }
        }
        all.push_back(numbers);
    }
    return all;
}

namespace {

void check_lengths(const Particles& particles) {
    const auto check_length = [&](std::string_view name, std::size_t length) {
        if (length != particles.size())
            throw InputError(fmt::format("the scene has {} particles, but {} values of {}: use Particles::resize()",
                                         particles.size(), length, name));
    };
    for (const auto& [name, array] : named_arrays(particles))
        check_length(name, array->size());
    for (const auto& [name, array] : named_integer_arrays(particles))
        check_length(name, array->size());
}

void check_numbers(const Scene& scene, const Particles& particles) {
    const auto refuse = [&](std::size_t p, std::string_view what, double value, std::string_view rule) {
        throw InputError(fmt::format("particle {} has the {} {}: it must be {}", particles.id[p], what, value, rule));
    };
    for (const auto& [name, array] : named_arrays(particles)) {
        const bool positive = name == "mass" || name == "density";
        const bool width = name == "half_width" || name == "half_height";
        for (std::size_t p = 0; p < particles.size(); ++p) {
            const double value = (*array)[p];
            if (!std::isfinite(value) || (positive && !(value > 0.0)) || (width && value < 0.0))
                refuse(p, name, value, positive ? "positive and finite" : width ? "finite and not negative" : "finite");
        }
    }
    const Grid& g = scene.grid;
    for (std::size_t p = 0; p < particles.size(); ++p)
        if (!contains(g, particles.x[p], particles.y[p]))
            throw InputError(fmt::format(
                "particle {} lies outside the background grid: it is at ({:.6g}, {:.6g}) m, and the grid "
                "extends from ({:.6g}, {:.6g}) to ({:.6g}, {:.6g}) m",
                particles.id[p], particles.x[p], particles.y[p], g.left, g.bottom, g.left + g.width, g.bottom + g.height));
}

void check_rigid_body(const RigidBody& body, const Grid& g) {
    if (body.x.empty() || body.x.size() != body.y.size())
        throw InputError(
            fmt::format("the rigid body '{}' has {} x and {} y of points: it needs as many of both, and one at least", body.name,
                        body.x.size(), body.y.size()));
    for (std::size_t p = 0; p < body.x.size(); ++p)
        if (!std::isfinite(body.x[p]) || !std::isfinite(body.y[p]))
            throw InputError(fmt::format("point {} of the rigid body '{}' is at ({}, {}) m: that must be finite", p, body.name,
                                         body.x[p], body.y[p]));
        else if (constexpr double far = 1e12; // cells, which are counted
                 std::abs(body.x[p] - g.left) > far * g.dx() || std::abs(body.y[p] - g.bottom) > far * g.dy())
            throw InputError(fmt::format("point {} of the rigid body '{}' is at ({}, {}) m: that is out of all proportion to the "
                                         "cells of the grid",
                                         p, body.name, body.x[p], body.y[p]));
}

void check_surface(const RigidBody& body, const Scene& scene) {
    if (!scene.surface_contact)
        throw InputError(fmt::format("the rigid body '{}' has a surface: set Scene::surface_contact", body.name));
    if (scene.grid.periodic())
        throw InputError(
            fmt::format("the rigid body '{}' has a surface, and the grid is periodic, where surfaces are not followed "
                        "from one side to the other: let it hold nodes, or take other sides",
                        body.name));
    if (!(body.friction >= 0.0 && std::isfinite(body.friction)))
        throw InputError(fmt::format("the rigid body '{}' has the friction {}: it must be zero or positive, and finite",
                                     body.name, body.friction));
    if (scene.geometry == Geometry::axisymmetric && !(body.spin.is_constant() && body.spin.after(0.0) == 0.0))
        throw InputError(
            fmt::format("the rigid body '{}' spins in the plane of an axisymmetric scene, which it cannot", body.name));
}

void check_surface(const SurfacePoints& surface, std::span<const RigidBody> rigid_bodies, std::size_t particles) {
    const std::size_t count = surface.size();
    if (surface.x.size() != count || surface.y.size() != count || surface.next.size() != count ||
        surface.stiffness.size() != count)
        throw InputError("the arrays of surface points differ in length");
    for (std::size_t c = 0; c < count; ++c) {
        if (surface.particle[c] < 0 || surface.particle[c] >= static_cast<std::int64_t>(particles))
            throw InputError(
                fmt::format("surface point {} goes with the particle {}, which is not there", c, surface.particle[c]));
        if (!std::isfinite(surface.x[c]) || !std::isfinite(surface.y[c]) ||
            !(surface.stiffness[c] > 0.0 && std::isfinite(surface.stiffness[c])))
            throw InputError(
                fmt::format("surface point {} has the offset ({}, {}) m and the stiffness {} N/m: they must be finite, "
                            "and the stiffness positive",
                            c, surface.x[c], surface.y[c], surface.stiffness[c]));
        if (surface.next[c] < -1 || surface.next[c] >= static_cast<std::int64_t>(count))
            throw InputError(fmt::format("a side goes from surface point {} to {}, which is not there", c, surface.next[c]));
    }
    for (std::size_t b = 0; b < rigid_bodies.size(); ++b)
        if (rigid_bodies[b].surface && rigid_bodies[b].friction > 0.0 &&
            (b >= surface.held.size() || surface.held[b].size() != count))
            throw InputError(fmt::format("the surface points have no room for the friction of the rigid body '{}': use "
                                         "SurfacePoints::provide_friction()",
                                         rigid_bodies[b].name));
}

void check_fields(const Scene& scene, const Particles& particles) {
    if (scene.grid.periodic())
        throw InputError(
            "bodies touch by their surfaces, and the grid is periodic, where surfaces are not followed from one side "
            "to the other: let the bodies share the nodes, or take other sides");
    if (!scene.surface_contact)
        throw InputError("bodies touch by their surfaces: set Scene::surface_contact");
    for (const int field : scene.field_of_body)
        if (field < 0)
            throw InputError(fmt::format("a body has the velocity field {}: they count from 0", field));
    const std::size_t bodies = scene.field_of_body.size();
    for (const std::int64_t body : particles.body)
        if (body < 0 || body >= static_cast<std::int64_t>(bodies))
            throw InputError(fmt::format("a particle is of the body {}, and the scene has fields for {}", body, bodies));
    for (const double friction : scene.friction_of_body)
        if (!(friction >= 0.0 && std::isfinite(friction)))
            throw InputError(fmt::format("a body has the friction {}: it must be zero or positive, and finite", friction));
    if (scene.friction_of_body.empty())
        return;
    if (scene.friction_of_body.size() != bodies || particles.surface.held_by_bodies.size() != bodies ||
        !std::ranges::all_of(particles.surface.held_by_bodies,
                             [&](const auto& held) { return held.size() == particles.surface.size(); }))
        throw InputError(fmt::format("the {} bodies rub on each other, and the surface points have no room for it: use "
                                     "SurfacePoints::provide_friction_of_bodies()",
                                     bodies));
}

void check_loaded(const LoadedSides& loaded, const Scene& scene, std::size_t particles) {
    const std::size_t count = loaded.size();
    for (const auto* array : {&loaded.x, &loaded.y, &loaded.along_x, &loaded.along_y, &loaded.area})
        if (array->size() != count || !std::ranges::all_of(*array, [](double value) { return std::isfinite(value); }))
            throw InputError("the arrays of loaded sides must be as long as each other, and finite");
    std::vector<bool> used(scene.loads.size());
    for (std::size_t c = 0; c < count; ++c) {
        if (loaded.particle[c] < 0 || loaded.particle[c] >= static_cast<std::int64_t>(particles))
            throw InputError(fmt::format("a loaded side goes with the particle {}, which is not there", loaded.particle[c]));
        if (c >= loaded.load.size() || loaded.load[c] < 0 || loaded.load[c] >= static_cast<std::int64_t>(used.size()))
            throw InputError(fmt::format("loaded side {} has a load that the scene does not have", c));
        used[static_cast<std::size_t>(loaded.load[c])] = true;
    }
    for (std::size_t k = 0; k < used.size(); ++k)
        if (!used[k])
            throw InputError(
                fmt::format("the load '{}' acts on no edge of a body: its region must hold the middles of sides as short "
                            "as particles",
                            scene.loads[k].name));
}

} // namespace

void check_internal(const Scene& scene, const Particles& particles) {
    if (scene.affine && particles.affine.empty())
        throw InputError("the transfers are affine, and the particles have no room for affine velocities: use "
                         "Particles::provide_affine()");
    for (const Material& material : scene.materials)
        if (const std::size_t wanted = material.law->variables().size(); particles.internal.size() < wanted)
            throw InputError(fmt::format("a law of the scene has {} internal variables, the particles have room for {}: use "
                                         "Particles::provide_internal()",
                                         wanted, particles.internal.size()));
}

void check(const Scene& scene, const Particles& particles, std::span<const RigidBody> rigid_bodies, double time) {
    check(scene.grid, scene.geometry);
    // fewer, and two nodes that a particle sees would be one another's neighbours on both sides
    if (const int least = scene.shape == ShapeFunction::linear ? 3 : 5; scene.grid.periodic() && scene.grid.cells_x < least)
        throw InputError(
            fmt::format("the grid is periodic and {} cells wide: with these shape functions it must be {} or more; use "
                        "smaller cells",
                        scene.grid.cells_x, least));
    if (particles.size() == 0)
        throw InputError("the scene has no deformable particle: add a body");
    if (particles.size() > 2'000'000'000)
        throw InputError(fmt::format("the scene has {} particles: at most 2000000000 are possible", particles.size()));
    for (std::size_t m = 0; m < scene.materials.size(); ++m)
        if (!(scene.materials[m].heat_capacity >= 0.0 && std::isfinite(scene.materials[m].heat_capacity)))
            throw InputError(fmt::format("material {} has the heat capacity {} J/(kg K): it must be zero (none) or positive, and "
                                         "finite",
                                         m, scene.materials[m].heat_capacity));
    if (!scene.finite_rotation && has_finite_strain(scene))
        throw InputError(
            "a law of the scene is one at finite strain, and its rotation is to be small: leave finite-rotation true, "
            "or take laws in rate form");
    check_internal(scene, particles);
    check_lengths(particles);
    std::vector<bool> known(particles.size());
    for (const std::int64_t id : particles.id) {
        if (id < 0 || id >= static_cast<std::int64_t>(known.size()) || known[static_cast<std::size_t>(id)])
            throw InputError(fmt::format("a particle has the number {}: the {} numbers must be 0, 1, 2, ..., each once", id,
                                         particles.size()));
        known[static_cast<std::size_t>(id)] = true;
    }
    for (std::size_t p = 0; p < particles.size(); ++p) {
        if (particles.material[p] < 0 || particles.material[p] >= static_cast<std::int64_t>(scene.materials.size()))
            throw InputError(fmt::format("particle {} is of material {}, but the scene has {} materials", particles.id[p],
                                         particles.material[p], scene.materials.size()));
        if (scene.shape == ShapeFunction::gimp &&
            !(particles.half_width[p] > 0.0 && particles.half_width[p] <= 0.5 * scene.grid.dx() &&
              particles.half_height[p] > 0.0 && particles.half_height[p] <= 0.5 * scene.grid.dy()))
            throw InputError(fmt::format("particle {} is {} x {} m wide: GIMP needs particles no wider than a cell",
                                         particles.id[p], 2.0 * particles.half_width[p], 2.0 * particles.half_height[p]));
    }
    check_numbers(scene, particles);
    for (const RigidBody& body : rigid_bodies) {
        check_rigid_body(body, scene.grid);
        if (body.surface)
            check_surface(body, scene);
    }
    check_surface(particles.surface, rigid_bodies, particles.size());
    check_loaded(particles.loaded, scene, particles.size());
    if (has_fields(scene)) {
        check_fields(scene, particles);
        if (const double deepest = deepest_body_contact(particles, scene) / scene.grid.smallest_spacing();
            time == 0.0 && deepest > 1e-6)
            throw InputError(fmt::format("a body lies {:.3g} cells within another at the start: bodies may touch there, and not "
                                         "overlap; of round ones the edges are polygons with corners a particle apart",
                                         deepest));
    }
    if (const double deepest = deepest_contact(particles, rigid_bodies, time) / scene.grid.smallest_spacing();
        time == 0.0 && deepest > 1e-6)
        throw InputError(fmt::format("a body lies {:.3g} cells within the surface of a rigid body at the start: bodies may touch "
                                     "there, and not overlap",
                                     deepest));
    if (scene.body_force)
        for (std::size_t p = 0; p < particles.size(); ++p) {
            const auto b = scene.body_force(particles.id[p], particles.x[p], particles.y[p], time);
            if (!std::isfinite(b[0]) || !std::isfinite(b[1]))
                throw InputError(fmt::format("the body force on particle {} at t = {:.6g} s is ({}, {}) m/s^2: it must be finite",
                                             particles.id[p], time, b[0], b[1]));
        }
}

} // namespace ductile::mpm
