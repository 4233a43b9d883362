// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: how points that particles carry see the nodes.
#include <ductile/mpm/discretisation.hpp>
#include <ductile/mpm/plane_vector.hpp>

#include <cmath>

namespace ductile::mpm {

/// Over the nodes of a stencil.
using NodalWeights = std::array<double, 9>;

/// r . g_i with g_i = N_i D^-1 (x_i - x_p), r from the particle.
[[nodiscard]] inline NodalWeights slopes(const Stencil& s, const PlaneVector& r) {
    NodalWeights weights{};
    for (std::size_t k = 0; k < s.count; ++k)
        weights[k] = r[0] * s.slope_x[k] + r[1] * s.slope_y[k];
    return weights;
}

/// The particle's stencil with the values B_i of a point at r from it (SurfaceContact).
[[nodiscard]] inline Stencil carried(Stencil s, const PlaneVector& r) {
    for (std::size_t k = 0; k < s.count; ++k) {
        const double along_x = r[0] * s.slope_x[k], along_y = r[1] * s.slope_y[k];
        s.value[k] += along_x + along_y + (s.value[k] != 0.0 ? along_x * along_y / s.value[k] : 0.0);
    }
    return s;
}

/// sum weights_i v_i
[[nodiscard]] inline PlaneVector sum(const Stencil& s, const NodalWeights& weights, std::span<const double> nodal) {
    PlaneVector result{};
    for (std::size_t k = 0; k < s.count; ++k)
        result = result + weights[k] * PlaneVector{nodal[2 * s.node[k]], nodal[2 * s.node[k] + 1]};
    return result;
}

/// nodal_i += values_i f; magnitudes, unless empty, likewise.
inline void scatter(const Stencil& s, const PlaneVector& force, std::span<double> nodal, std::span<double> magnitudes) {
    for (std::size_t k = 0; k < s.count; ++k)
        for (std::size_t a = 0; a < 2; ++a) {
            nodal[2 * s.node[k] + a] += s.value[k] * force[a];
            if (!magnitudes.empty())
                magnitudes[2 * s.node[k] + a] += std::abs(s.value[k] * force[a]);
        }
}

/// Offsets turn and stretch with the field around the particle.
inline void move(CarriedPoints& points, const Discretisation& discretisation, const NodalMotion& motion) {
    for (std::size_t c = 0; c < points.size(); ++c) {
        const Stencil s = discretisation.stencil(points.carrier(c));
        const Stencil b = carried(s, {points.x[c], points.y[c]});
        const PlaneVector change = motion.dt * (sum(b, b.value, motion.straining) - sum(s, s.value, motion.straining));
        points.x[c] += change[0];
        points.y[c] += change[1];
    }
}

[[nodiscard]] inline PlaneVector place_of(const Particles& particles, const CarriedPoints& points, std::size_t c) {
    const std::size_t p = points.carrier(c);
    return {particles.x[p] + points.x[c], particles.y[p] + points.y[c]};
}

} // namespace ductile::mpm
