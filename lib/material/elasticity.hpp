#pragma once

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

} // namespace ductile
