// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/aligned.hpp>
#include <ductile/material/symmetric_tensor.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <fmt/format.h>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ductile::mpm {

/// Points that go with the velocity field around the particles that carry them.
struct CarriedPoints {
    aligned_vector<std::int64_t> particle; ///< its place in the arrays
    aligned_vector<double> x, y;           ///< from the particle [m]

    [[nodiscard]] std::size_t size() const { return particle.size(); }
    [[nodiscard]] std::size_t carrier(std::size_t c) const { return static_cast<std::size_t>(particle[c]); }
};

/// Points on the edges of bodies, which touch the surfaces of rigid ones (SurfaceContact) and of each other (BodyContact).
struct SurfacePoints : CarriedPoints {
    aligned_vector<std::int64_t> next;        ///< the point at the other end of the side that begins here, with what is outside
                                              ///< on its right; -1 if none does
    aligned_vector<double> stiffness;         ///< of the contact [N/m, a metre of thickness or a radian]
    std::vector<aligned_vector<double>> held; ///< [b]: tangential force by the rigid body b [N, likewise], along its surface
                                              ///< with what is outside on the right
    std::vector<aligned_vector<double>> held_by_bodies; ///< likewise, by bodies

    /// Room for the forces of this rigid body, which rubs; they are zero.
    void provide_friction(std::size_t body) {
        if (held.size() <= body)
            held.resize(body + 1);
        held[body].assign(size(), 0.0);
    }
    /// The same for so many bodies.
    void provide_friction_of_bodies(std::size_t count) { held_by_bodies.assign(count, aligned_vector<double>(size(), 0.0)); }
};

/// The middles of sides of bodies' edges that loads act on (SurfaceLoads), and the sides.
struct LoadedSides : CarriedPoints {
    aligned_vector<double> along_x, along_y; ///< from end to end, with what is outside on the right [m]
    aligned_vector<double> area;             ///< at the start [m^2, a metre of thickness or a radian]
    aligned_vector<std::int64_t> load;       ///< its number in the scene
};

/// All deformable material points of a scene, one array a quantity, in SI. In an axisymmetric scene x is the radius, y the axis,
/// stress_zz the hoop stress, and mass the mass of one radian.
struct Particles {
    aligned_vector<double> x, y, velocity_x, velocity_y;
    aligned_vector<double> mass, density;
    aligned_vector<double> stress_xx, stress_yy, stress_zz, stress_xy; ///< Cauchy stress
    std::vector<aligned_vector<double>> internal;                      ///< [k]: the k-th internal variable of the point's law
    /// C_xx, C_xy, C_yx, C_yy of the velocity v + C (x - x_p) around the point [1/s] where transfers are affine, else none.
    std::vector<aligned_vector<double>> affine;
    aligned_vector<double> energy;                  ///< internal energy per mass, (2.2.16) [J/kg]
    aligned_vector<double> temperature;             ///< above the initial one, by plastic work, (2.3.5) [K]
    aligned_vector<double> half_width, half_height; ///< of the point's initial cell, for GIMP
    aligned_vector<std::int64_t> material;          ///< number of its law in the scene
    aligned_vector<std::int64_t> body;              ///< number of the body it was added with
    aligned_vector<std::int64_t> id;                ///< number at the start: sorting keeps it
    SurfacePoints surface;                          ///< where some rigid bodies have surfaces, else none
    LoadedSides loaded;                             ///< where loads act, else none

    [[nodiscard]] std::size_t size() const { return x.size(); }
    void resize(std::size_t count);
    /// Room for as many internal variables as a law has, if there is less; new ones are zero.
    void provide_internal(std::size_t variables);
    /// Room for C, if there is none; it is zero.
    void provide_affine();
    /// Room to permute in, kept from call to call.
    struct PermutationBuffers {
        aligned_vector<double> numbers;
        aligned_vector<std::int64_t> integers;
    };
    /// New place n holds what was at place order[n]; carried points stay with their particles.
    void permute(std::span<const std::int32_t> order, PermutationBuffers& buffers);
    [[nodiscard]] std::size_t memory_bytes() const;
};

/// Of one particle [Pa].
[[nodiscard]] inline SymmetricTensor stress_of(const Particles& particles, std::size_t p) {
    return {particles.stress_xx[p], particles.stress_yy[p], particles.stress_zz[p], particles.stress_xy[p]};
}

/// The arrays of numbers that all particles have, by their names in checkpoints; `P` is Particles, const or not.
template <class P> [[nodiscard]] auto common_arrays(P& p) {
    using Entry = std::pair<std::string_view, decltype(&p.x)>;
    return std::array{Entry{"x", &p.x},
                      Entry{"y", &p.y},
                      Entry{"velocity_x", &p.velocity_x},
                      Entry{"velocity_y", &p.velocity_y},
                      Entry{"mass", &p.mass},
                      Entry{"density", &p.density},
                      Entry{"stress_xx", &p.stress_xx},
                      Entry{"stress_yy", &p.stress_yy},
                      Entry{"stress_zz", &p.stress_zz},
                      Entry{"stress_xy", &p.stress_xy},
                      Entry{"energy", &p.energy},
                      Entry{"temperature", &p.temperature},
                      Entry{"half_width", &p.half_width},
                      Entry{"half_height", &p.half_height}};
}
/// The same, the internal variables, and C.
template <class P> [[nodiscard]] auto named_arrays(P& p) {
    std::vector<std::pair<std::string, decltype(&p.x)>> arrays;
    for (const auto& [name, array] : common_arrays(p))
        arrays.emplace_back(name, array);
    for (std::size_t k = 0; k < p.internal.size(); ++k)
        arrays.emplace_back(fmt::format("internal_{}", k + 1), &p.internal[k]);
    for (std::size_t k = 0; k < p.affine.size(); ++k)
        arrays.emplace_back(fmt::format("affine_{}", k + 1), &p.affine[k]);
    return arrays;
}
template <class P> [[nodiscard]] auto named_integer_arrays(P& p) {
    using Entry = std::pair<std::string_view, decltype(&p.id)>;
    return std::array{Entry{"material", &p.material}, Entry{"body", &p.body}, Entry{"id", &p.id}};
}

} // namespace ductile::mpm
