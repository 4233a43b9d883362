// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/material/symmetric_tensor.hpp>

namespace ductile {

/// Linear isotropic elasticity in plane strain. Any consistent unit of stress.
struct IsotropicElasticity {
    double bulk_modulus = 0.0;  ///< K
    double shear_modulus = 0.0; ///< mu

    [[nodiscard]] double alpha() const { return bulk_modulus + 4.0 / 3.0 * shear_modulus; } ///< K + 4 mu/3, Eq. (42)
    [[nodiscard]] double beta() const { return bulk_modulus - 2.0 / 3.0 * shear_modulus; }  ///< K - 2 mu/3 = lambda

    bool operator==(const IsotropicElasticity&) const = default;
};

/// Throws InputError unless both moduli are positive and finite.
void check(const IsotropicElasticity& elasticity);

/// The moduli K = E/(3(1 - 2 nu)), mu = E/(2(1 + nu)). Throws InputError unless E > 0 and -1 < nu < 1/2.
[[nodiscard]] IsotropicElasticity elasticity_from_young(double young_modulus, double poisson_ratio);
/// E = 9 K mu/(3 K + mu)
[[nodiscard]] double young_modulus(const IsotropicElasticity& elasticity);
[[nodiscard]] double poisson_ratio(const IsotropicElasticity& elasticity);

/// sigma = lambda tr(eps) I + 2 mu eps
[[nodiscard]] inline SymmetricTensor elastic_stress(const IsotropicElasticity& e, const SymmetricTensor& strain) {
    const double volumetric = e.beta() * trace(strain);
    const double two_mu = 2.0 * e.shear_modulus;
    return {volumetric + two_mu * strain.xx, volumetric + two_mu * strain.yy, volumetric + two_mu * strain.zz,
            two_mu * strain.xy};
}

/// The inverse of elastic_stress.
[[nodiscard]] inline SymmetricTensor elastic_strain(const IsotropicElasticity& e, const SymmetricTensor& stress) {
    const double mean = trace(stress) / 3.0, volumetric = mean / (3.0 * e.bulk_modulus), shear = 0.5 / e.shear_modulus;
    return {volumetric + shear * (stress.xx - mean), volumetric + shear * (stress.yy - mean),
            volumetric + shear * (stress.zz - mean), shear * stress.xy};
}

/// K I (x) I + 2 mu theta (1 - I (x) I/3): the isotropic part that the tangents of all laws share (theta = 1: elasticity).
[[nodiscard]] inline Tangent isotropic_tangent(double bulk_modulus, double shear_modulus) {
    const double diagonal = bulk_modulus + 4.0 / 3.0 * shear_modulus, off = bulk_modulus - 2.0 / 3.0 * shear_modulus;
    return {{{diagonal, off, off, 0.0}, {off, diagonal, off, 0.0}, {off, off, diagonal, 0.0}, {0.0, 0.0, 0.0, shear_modulus}}};
}

} // namespace ductile
