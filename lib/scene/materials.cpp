// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/material/finite_strain.hpp>
#include <ductile/material/linear_elastic.hpp>
#include <ductile/material/units.hpp>
#include <ductile/scene/materials.hpp>
#include <ductile/scene/shape.hpp>

#include <fmt/format.h>

namespace ductile {

namespace {

io::OptionHelp help(const std::string& group, std::string_view whose, const char* meaning, std::string units = {},
                    io::Limits allowed = io::positive) {
    return {.group = group, .meaning = fmt::format("{}{}", whose, meaning), .units = std::move(units), .allowed = allowed};
}

} // namespace

void declare(io::Keys& keys, StzParameters& stz, const std::string& group, std::string_view whose) {
    keys.option("stz-molecular-time", stz.molecular_time, help(group, whose, "tau_0", "s"));
    keys.option("stz-local-strain", stz.local_strain, help(group, whose, "epsilon_0"));
    keys.option("stz-heat-capacity", stz.heat_capacity, help(group, whose, "c_0"));
    keys.option("stz-activation-barrier", stz.activation_barrier, help(group, whose, "Delta/k_B", "K"));
    keys.option("stz-activation-volume", stz.activation_volume, help(group, whose, "zeta", "m^3"));
    keys.option("stz-bath-temperature", stz.bath_temperature, help(group, whose, "T", "K"));
    keys.option("stz-steady-temperature", stz.steady_temperature, help(group, whose, "chi_inf", "K"));
    keys.option("stz-formation-temperature", stz.formation_temperature, help(group, whose, "e_Z/k_B", "K"));
    keys.option(
        "stz-corner", stz.corner_width,
        help(group, whose, "width of a smoothed yield corner, in yield stresses; 0 is the sharp one", "", io::not_negative));
}

void declare(io::Keys& keys, PerzynaParameters& perzyna, const std::string& group, std::string_view whose) {
    keys.option("perzyna-hardening", perzyna.hardening_modulus,
                help(group, whose, "rise of the yield stress with plastic strain", "Pa", io::not_negative));
    keys.option("perzyna-rate", perzyna.reference_rate, help(group, whose, "D_0 in D^pl = D_0 (sbar/Y - 1)^n", "1/s"));
    keys.option("perzyna-exponent", perzyna.overstress_exponent, help(group, whose, "n", "", io::between(1, 100)));
}

void declare(io::Keys& keys, MaterialData& material) {
    keys.choice("law", material.law,
                {{"linear-elastic", LawChoice::linear_elastic},
                 {"neo-hookean", LawChoice::neo_hookean},
                 {"von-mises", LawChoice::von_mises},
                 {"drucker-prager", LawChoice::drucker_prager},
                 {"stz", LawChoice::stz},
                 {"perzyna", LawChoice::perzyna},
                 {"johnson-cook", LawChoice::johnson_cook}},
                {.group = {}, .meaning = "what the stress obeys", .required = true});
    declare_parameters(keys, material, {});
}

void declare_parameters(io::Keys& keys, MaterialData& m, const std::string& group) {
    const auto optional = [&](std::string meaning, std::string units = {}, io::Limits allowed = io::positive) {
        return io::OptionHelp{.group = group, .meaning = std::move(meaning), .units = std::move(units), .allowed = allowed};
    };
    const auto needed = [&](std::string meaning, std::string units = {}, io::Limits allowed = io::positive) {
        io::OptionHelp help = optional(std::move(meaning), std::move(units), allowed);
        help.required = true;
        return help;
    };
    keys.option("young-modulus", m.young_modulus, needed("Young's modulus E", "Pa"));
    keys.option("poisson-ratio", m.poisson_ratio, needed("Poisson's ratio nu", "", io::strictly_between(-1.0, 0.5)));
    keys.option("density", m.density, needed("density", "kg/m^3"));
    keys.option("heat-capacity", m.heat_capacity,
                optional("heat capacity per mass, for the temperature rise; 0: none", "J/(kg K)", io::not_negative));
    if (m.law != LawChoice::linear_elastic && m.law != LawChoice::neo_hookean)
        keys.option("heat-fraction", m.heat_fraction,
                    optional("part of the plastic work that becomes heat (Taylor and Quinney)", "", io::between(0.0, 1.0)));
    if (m.law == LawChoice::linear_elastic || m.law == LawChoice::von_mises)
        keys.choice("elasticity", m.elasticity,
                    {{"rate", ElasticityChoice::rate, "Jaumann's rate of the stress, the paper's: for small elastic strain"},
                     {"hencky", ElasticityChoice::hencky, "logarithmic strain, with an energy: for strain of any size"}},
                    optional("what elastic stress follows from"));
    switch (m.law) {
    case LawChoice::linear_elastic:
    case LawChoice::neo_hookean:
        break;
    case LawChoice::von_mises:
        keys.option("yield-stress", m.yield_stress, needed("first yield in simple tension", "Pa"));
        keys.option("hardening", m.hardening.modulus, optional("hardening modulus", "Pa", io::not_negative));
        keys.option("limit-strain", m.hardening.limit_strain,
                    optional("plastic strain at which hardening ends", "", io::not_negative));
        keys.option("softening", m.hardening.softening, optional("softening modulus beyond that", "Pa", io::not_negative));
        keys.option("saturation", m.hardening.saturation,
                    optional("what Voce's hardening adds in the end: Q (1 - exp(-p/saturation-strain))", "Pa", io::not_negative));
        keys.option("saturation-strain", m.hardening.saturation_strain, optional("the plastic strain in that"));
        keys.toml(
            "hardening-curve", optional("yield stress by plastic strain, from [0, yield-stress] on, instead of moduli", "1, Pa"),
            "[[plastic strain, stress], ...]",
            [&m] {
                std::string rows;
                for (const auto& [strain, stress] : m.hardening.curve)
                    rows += (rows.empty() ? "" : ", ") + io::toml_array({strain, stress});
                return fmt::format("[{}]", rows);
            },
            [&m](const std::string& toml) {
                m.hardening.curve.clear();
                if (const io::ConfigNode rows = value_of(toml); !rows.is_array() || !rows.children.empty())
                    for (const std::vector<double>& row : read_rows(rows, {2}))
                        m.hardening.curve.push_back({row[0], row[1]});
            });
        break;
    case LawChoice::drucker_prager:
        keys.option("cohesion", m.cone.cohesion, needed("equivalent stress at yield without mean stress", "Pa"));
        keys.option("friction", m.cone.friction, needed("rise of that with pressure"));
        keys.option("dilatancy", m.cone.dilatancy,
                    optional("plastic change of volume, up to the friction", "", io::not_negative));
        keys.option("hardening", m.cone.hardening, optional("hardening modulus", "Pa", io::not_negative));
        break;
    case LawChoice::stz:
        keys.option("yield-stress", m.yield_stress, needed("|sigma_0| = sqrt(J_2) at yield", "Pa"));
        declare(keys, m.stz, group, {});
        break;
    case LawChoice::perzyna:
        keys.option("yield-stress", m.yield_stress, needed("|sigma_0| = sqrt(J_2) at first yield", "Pa"));
        declare(keys, m.perzyna, group, {});
        break;
    case LawChoice::johnson_cook: {
        JohnsonCookParameters& c = m.johnson_cook;
        keys.option("yield-stress", m.yield_stress, needed("A in (A + B p^n) (1 + C ln(rate/reference)) (1 - T*^m)", "Pa"));
        keys.option("hardening", c.hardening, optional("B", "Pa", io::not_negative));
        keys.option("hardening-exponent", c.hardening_exponent, optional("n"));
        keys.option("rate-coefficient", c.rate_coefficient, optional("C", "", io::not_negative));
        keys.option("reference-rate", c.reference_rate,
                    optional("of plastic strain, below which the rate does not matter", "1/s"));
        keys.option("thermal-exponent", c.thermal_exponent, optional("m"));
        keys.option("reference-temperature", c.reference_temperature, optional("T* = 0, where the material begins", "K"));
        keys.option("melting-temperature", c.melting_temperature, optional("T* = 1", "K"));
        break;
    }
    }
}

double effective_heat_capacity(const MaterialData& m) { return m.heat_fraction > 0.0 ? m.heat_capacity / m.heat_fraction : 0.0; }

Law make_law(const MaterialData& m) {
    const IsotropicElasticity elasticity = elasticity_from_young(m.young_modulus, m.poisson_ratio);
    const auto with_yield = [&](auto parameters) {
        parameters.yield_stress = m.yield_stress;
        return parameters;
    };
    switch (m.law) {
    case LawChoice::johnson_cook: {
        JohnsonCookParameters parameters = with_yield(m.johnson_cook);
        if (const double heat_capacity = effective_heat_capacity(m); heat_capacity > 0.0)
            parameters.temperature_by_plastic_work = 1.0 / (m.density * heat_capacity);
        return johnson_cook_law(elasticity, parameters);
    }
    case LawChoice::linear_elastic:
        return m.elasticity == ElasticityChoice::hencky ? make_finite_law(Hencky(LinearElastic(elasticity)))
                                                        : linear_elastic_law(elasticity);
    case LawChoice::neo_hookean:
        return make_finite_law(NeoHookean(elasticity));
    case LawChoice::von_mises:
        if (m.elasticity == ElasticityChoice::hencky)
            return hencky_von_mises_law(elasticity, with_yield(m.hardening));
        return von_mises_law(elasticity, with_yield(m.hardening));
    case LawChoice::drucker_prager:
        return drucker_prager_law(elasticity, m.cone);
    case LawChoice::stz:
        return stz_law(elasticity, with_yield(m.stz), si_units);
    case LawChoice::perzyna:
        return perzyna_law(elasticity, with_yield(m.perzyna), si_units);
    }
    __builtin_unreachable();
}

} // namespace ductile
