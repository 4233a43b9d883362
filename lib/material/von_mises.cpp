// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/material/make_law.hpp>
#include <ductile/material/von_mises.hpp>

#include <fmt/format.h>
#include <limits>

namespace ductile {

VonMises::VonMises(const IsotropicElasticity& elasticity, const Hardening& h) : elasticity_(elasticity), pieces_() {
    check(elasticity);
    const auto fail = [](const char* name, double value, const char* rule) {
        throw InputError(fmt::format("von Mises plasticity: {} = {}: it must be {}", name, value, rule));
    };
    if (!(h.yield_stress > 0.0 && std::isfinite(h.yield_stress)))
        fail("yield stress", h.yield_stress, "positive and finite");
    if (!(h.modulus >= 0.0 && std::isfinite(h.modulus)))
        fail("hardening modulus", h.modulus, "zero or positive, and finite");
    if (!(h.limit_strain >= 0.0))
        fail("limit strain", h.limit_strain, "zero or positive");
    if (!(h.softening >= 0.0 && h.softening < 3.0 * elasticity.shear_modulus))
        fail("softening modulus", h.softening, "zero or positive, and below three times the shear modulus");
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const double strength = h.yield_stress + h.modulus * h.limit_strain;
    const double exhausted = h.softening > 0.0 ? h.limit_strain + strength / h.softening : infinity;
    pieces_ = {Piece{h.limit_strain, h.yield_stress, h.modulus},
               Piece{exhausted, strength + h.softening * h.limit_strain, -h.softening}, Piece{infinity, 0.0, 0.0}};
}

Law von_mises_law(const IsotropicElasticity& elasticity, const Hardening& hardening, double relaxation_time) {
    return make_law(VonMises(elasticity, hardening), relaxation_time);
}

} // namespace ductile
