#include <ductile/base/error.hpp>
#include <ductile/material/elasticity.hpp>
#include <ductile/material/options.hpp>

#include <cmath>
#include <fmt/format.h>
#include <utility>

namespace ductile {

void declare(io::Program& program, MaterialOptions& o) {
    const auto help = [](std::string meaning, std::string units = {}, io::Limits allowed = io::positive) {
        return io::OptionHelp{"Material", std::move(meaning), std::move(units), allowed};
    };
    program.option("--bulk-modulus", o.elasticity.bulk_modulus, help("bulk modulus K", "Pa"));
    program.option("--shear-modulus", o.elasticity.shear_modulus, help("shear modulus mu", "Pa"));
    program.choice("--plasticity", o.plasticity, {{"stz", PlasticityChoice::stz}, {"perzyna", PlasticityChoice::perzyna}},
                   help("shear transformation zones, or rate-dependent von Mises (Perzyna)"));
    program.option("--yield-stress", o.yield_stress, help("yield stress of |sigma_0| = sqrt(s^2 + tau^2 + 3 q^2)", "Pa"));
    program.option("--stz-molecular-time", o.stz.molecular_time, help("STZ: tau_0", "s"));
    program.option("--stz-local-strain", o.stz.local_strain, help("STZ: epsilon_0"));
    program.option("--stz-heat-capacity", o.stz.heat_capacity, help("STZ: c_0"));
    program.option("--stz-activation-barrier", o.stz.activation_barrier, help("STZ: Delta/k_B", "K"));
    program.option("--stz-activation-volume", o.stz.activation_volume, help("STZ: zeta", "m^3"));
    program.option("--stz-bath-temperature", o.stz.bath_temperature, help("STZ: T", "K"));
    program.option("--stz-steady-temperature", o.stz.steady_temperature, help("STZ: chi_inf", "K"));
    program.option("--stz-formation-temperature", o.stz.formation_temperature, help("STZ: e_Z/k_B", "K"));
    program.option("--stz-corner", o.stz.corner_width,
                   help("STZ: width of a smoothed yield corner, in yield stresses; 0 is the sharp one", "", io::not_negative));
    program.option("--perzyna-hardening", o.perzyna.hardening_modulus,
                   help("Perzyna: rise of the yield stress with plastic strain", "Pa", io::not_negative));
    program.option("--perzyna-rate", o.perzyna.reference_rate, help("Perzyna: D_0 in D^pl = D_0 (sbar/Y - 1)^n", "1/s"));
    program.option("--perzyna-exponent", o.perzyna.overstress_exponent, help("Perzyna: n", "", io::between(1, 100)));
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
    const double lambda = o.elasticity.beta(), mu = o.elasticity.shear_modulus;
    return {.young_modulus = young_modulus(o.elasticity),
            .poisson_ratio = 0.5 * lambda / (lambda + mu),
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
