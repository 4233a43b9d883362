// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/material/elasticity.hpp>
#include <ductile/material/law.hpp>
#include <ductile/material/step_form.hpp>

#include <limits>

namespace ductile {

/// Linear isotropic elasticity, (2.1.8) of Sulsky & Kaul; no internal variables.
class LinearElastic {
public:
    static constexpr bool linear = true, isochoric = true;
    explicit LinearElastic(const IsotropicElasticity& elasticity) : elasticity_(elasticity) { check(elasticity); }

    [[nodiscard]] const IsotropicElasticity& elasticity() const { return elasticity_; }
    [[nodiscard]] static std::array<InternalVariable, 0> variables() { return {}; }
    [[nodiscard]] double yield_stress(const std::array<double, 0>&) const { return std::numeric_limits<double>::infinity(); }
    [[nodiscard]] StressReturn<0> correct(const SymmetricTensor& trial, const std::array<double, 0>&, double) const {
        return {trial, {}};
    }
    [[nodiscard]] Tangent tangent(const SymmetricTensor&, const std::array<double, 0>&, double) const {
        return isotropic_tangent(elasticity_.bulk_modulus, elasticity_.shear_modulus);
    }

private:
    IsotropicElasticity elasticity_;
};

/// As both carriers use it.
[[nodiscard]] Law linear_elastic_law(const IsotropicElasticity& elasticity);

} // namespace ductile
