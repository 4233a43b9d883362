// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/material/elasticity.hpp>

#include <cmath>
#include <fmt/format.h>

namespace ductile {

void check(const IsotropicElasticity& elasticity) {
    const auto positive = [](double x) { return x > 0.0 && std::isfinite(x); };
    if (!positive(elasticity.bulk_modulus))
        throw InputError(fmt::format("bulk modulus K = {}: it must be positive and finite", elasticity.bulk_modulus));
    if (!positive(elasticity.shear_modulus))
        throw InputError(fmt::format("shear modulus mu = {}: it must be positive and finite", elasticity.shear_modulus));
}

IsotropicElasticity elasticity_from_young(double young, double poisson) {
    if (!(young > 0.0 && std::isfinite(young)))
        throw InputError(fmt::format("Young's modulus E = {}: it must be positive and finite", young));
    if (!(poisson > -1.0 && poisson < 0.5))
        throw InputError(fmt::format("Poisson's ratio nu = {}: it must lie between -1 and 0.5, both excluded", poisson));
    return {.bulk_modulus = young / (3.0 * (1.0 - 2.0 * poisson)), .shear_modulus = young / (2.0 * (1.0 + poisson))};
}

double poisson_ratio(const IsotropicElasticity& e) { return 0.5 * e.beta() / (e.beta() + e.shear_modulus); }

double young_modulus(const IsotropicElasticity& e) {
    return 9.0 * e.bulk_modulus * e.shear_modulus / (3.0 * e.bulk_modulus + e.shear_modulus);
}

} // namespace ductile
