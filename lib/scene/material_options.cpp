// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/material/elasticity.hpp>
#include <ductile/scene/material_options.hpp>
#include <ductile/scene/materials.hpp>

#include <cmath>
#include <fmt/format.h>
#include <utility>

namespace ductile {

void declare(io::Program& program, MaterialOptions& o) {
    const auto help = [](std::string meaning, std::string units = {}, io::Limits allowed = io::positive) {
        return io::OptionHelp{"Material", std::move(meaning), std::move(units), allowed};
    };
    program.option("bulk-modulus", o.elasticity.bulk_modulus, help("bulk modulus K", "Pa"));
    program.option("shear-modulus", o.elasticity.shear_modulus, help("shear modulus mu", "Pa"));
    program.choice("plasticity", o.plasticity,
                   {{"stz", PlasticityChoice::stz, "shear transformation zones"},
                    {"perzyna", PlasticityChoice::perzyna, "rate-dependent von Mises"}},
                   help("the law of plastic flow"));
    program.option("yield-stress", o.yield_stress, help("yield stress of |sigma_0| = sqrt(s^2 + tau^2 + 3 q^2)", "Pa"));
    declare(program, o.stz, "Material", "STZ: ");
    declare(program, o.perzyna, "Material", "Perzyna: ");
}

Units natural_units(const MaterialOptions& o, double length) {
    Units units;
    units.length = length;
    units.stress = o.yield_stress;
    units.temperature = o.plasticity == PlasticityChoice::stz ? o.stz.formation_temperature : 1.0;
    return units;
}

Law make_law(const MaterialOptions& o, const Units& units) {
    check(o.elasticity);
    const IsotropicElasticity elasticity{o.elasticity.bulk_modulus / units.stress, o.elasticity.shear_modulus / units.stress};
    if (!std::isfinite(elasticity.bulk_modulus) || !std::isfinite(elasticity.shear_modulus))
        throw InputError(
            fmt::format("the moduli in units of the yield stress overflow: check the units of the material ({})", describe(o)));
    if (o.plasticity == PlasticityChoice::perzyna) {
        PerzynaParameters parameters = o.perzyna;
        parameters.yield_stress = o.yield_stress;
        return perzyna_law(elasticity, parameters, units);
    }
    StzParameters parameters = o.stz;
    parameters.yield_stress = o.yield_stress;
    return stz_law(elasticity, parameters, units);
}

MaterialNumbers numbers_of(const MaterialOptions& o) {
    return {.young_modulus = young_modulus(o.elasticity),
            .poisson_ratio = poisson_ratio(o.elasticity),
            .yield_stress = o.yield_stress,
            .hardening = o.plasticity == PlasticityChoice::perzyna ? o.perzyna.hardening_modulus : 0.0};
}

std::string describe(const MaterialOptions& o) {
    const MaterialNumbers numbers = numbers_of(o);
    return fmt::format(
        "K = {:g} GPa, mu = {:g} GPa, E = {:.4g} GPa, nu = {:.3g}, {} plasticity, yield stress {:g} MPa ({:.3g} mu)",
        o.elasticity.bulk_modulus * 1e-9, o.elasticity.shear_modulus * 1e-9, numbers.young_modulus * 1e-9, numbers.poisson_ratio,
        o.plasticity == PlasticityChoice::stz ? "STZ" : "Perzyna", o.yield_stress * 1e-6,
        o.yield_stress / o.elasticity.shear_modulus);
}

} // namespace ductile
