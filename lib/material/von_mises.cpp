// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/material/finite_strain.hpp>
#include <ductile/material/make_law.hpp>
#include <ductile/material/von_mises.hpp>

#include <fmt/format.h>
#include <limits>

namespace ductile {

VonMises::VonMises(const IsotropicElasticity& elasticity, const Hardening& h)
    : elasticity_(elasticity), saturation_(h.saturation), saturation_strain_(h.saturation_strain) {
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
    if (!(h.saturation >= 0.0 && std::isfinite(h.saturation)))
        fail("saturation", h.saturation, "zero or positive, and finite");
    if (!(h.saturation_strain > 0.0 && std::isfinite(h.saturation_strain)))
        fail("saturation strain", h.saturation_strain, "positive and finite");
    constexpr double infinity = std::numeric_limits<double>::infinity();
    if (!h.curve.empty()) {
        if (h.curve.front()[0] != 0.0 || h.curve.front()[1] != h.yield_stress)
            throw InputError(fmt::format("von Mises plasticity: the hardening curve begins at ({}, {} Pa): it must begin with no "
                                         "plastic strain and the yield stress, {} Pa",
                                         h.curve.front()[0], h.curve.front()[1], h.yield_stress));
        if (h.modulus != 0.0 || h.softening != 0.0)
            throw InputError("von Mises plasticity: there are a hardening curve and moduli of hardening: give one of them");
        for (std::size_t k = 1; k < h.curve.size(); ++k) {
            const auto& [p, stress] = h.curve[k];
            const auto& [before, stress_before] = h.curve[k - 1];
            const double slope = (stress - stress_before) / (p - before);
            if (!(p > before && stress >= 0.0 && std::isfinite(stress) && slope > -3.0 * elasticity.shear_modulus))
                throw InputError(
                    fmt::format("von Mises plasticity: point {} of the hardening curve is ({}, {} Pa): strains must "
                                "grow, stresses must be zero or positive, and fall less steeply than three times the "
                                "shear modulus",
                                k + 1, p, stress));
            pieces_.push_back({p, stress - slope * p, slope});
        }
        pieces_.push_back({infinity, h.curve.back()[1], 0.0});
        return;
    }
    const double strength = h.yield_stress + h.modulus * h.limit_strain;
    const double exhausted = h.softening > 0.0 ? h.limit_strain + strength / h.softening : infinity;
    pieces_ = {Piece{h.limit_strain, h.yield_stress, h.modulus},
               Piece{exhausted, strength + h.softening * h.limit_strain, -h.softening}, Piece{infinity, 0.0, 0.0}};
}

Law hencky_von_mises_law(const IsotropicElasticity& elasticity, const Hardening& hardening) {
    return make_finite_law(Hencky(VonMises(elasticity, hardening)));
}

Law von_mises_law(const IsotropicElasticity& elasticity, const Hardening& hardening, double relaxation_time) {
    return make_law(VonMises(elasticity, hardening), relaxation_time);
}

} // namespace ductile
