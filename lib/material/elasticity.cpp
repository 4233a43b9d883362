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

} // namespace ductile
