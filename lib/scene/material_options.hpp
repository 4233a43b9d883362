// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/program.hpp>
#include <ductile/material/elasticity.hpp>
#include <ductile/material/law.hpp>
#include <ductile/material/perzyna.hpp>
#include <ductile/material/plausibility.hpp>
#include <ductile/material/stz.hpp>
#include <ductile/material/units.hpp>

#include <string>

namespace ductile {

enum class PlasticityChoice { stz, perzyna };

/// The material of a program, in SI; the defaults are Lu & Rycroft's metallic glass (Tables 1 and A.3).
struct MaterialOptions {
    IsotropicElasticity elasticity{.bulk_modulus = 122e9, .shear_modulus = 37.4e9};
    PlasticityChoice plasticity = PlasticityChoice::stz;
    StzParameters stz;
    PerzynaParameters perzyna;
    double yield_stress = 0.85e9; ///< of either model
};

/// Declares them all.
void declare(io::Program& program, MaterialOptions& options);

/// Stress in units of the yield stress, temperature in units of e_Z/k_B (Perzyna: the internal variable is a strain, unit 1).
[[nodiscard]] Units natural_units(const MaterialOptions& options, double length);
/// In natural units. Throws InputError for impossible values.
[[nodiscard]] Law make_law(const MaterialOptions& options, const Units& units);

/// For doubts(): with the yield stress as the options have it, and no density, which nothing here depends on.
[[nodiscard]] MaterialNumbers numbers_of(const MaterialOptions& options);

/// "K = 122 GPa, mu = 37.4 GPa, E = 101.8 GPa, nu = 0.361, STZ plasticity, yield stress 850 MPa (0.0227 mu)".
[[nodiscard]] std::string describe(const MaterialOptions& options);

} // namespace ductile
