// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/keys.hpp>
#include <ductile/material/drucker_prager.hpp>
#include <ductile/material/johnson_cook.hpp>
#include <ductile/material/law.hpp>
#include <ductile/material/perzyna.hpp>
#include <ductile/material/stz.hpp>
#include <ductile/material/von_mises.hpp>

#include <string>
#include <string_view>

namespace ductile {

enum class LawChoice { linear_elastic, neo_hookean, von_mises, drucker_prager, stz, perzyna, johnson_cook };
/// What elastic stress follows from: Jaumann's rate, or the logarithmic strain (finite_strain.hpp).
enum class ElasticityChoice { rate, hencky };

/// A material of points as plain data, in SI. Each law has parameters of its own besides what all have.
struct MaterialData {
    std::string name = "material";
    LawChoice law = LawChoice::linear_elastic;
    double young_modulus = 0.0, poisson_ratio = 0.0, density = 0.0;
    double heat_capacity = 0.0;                           ///< per mass; 0: the temperature stays
    double heat_fraction = 1.0;                           ///< of plastic work (Taylor & Quinney)
    ElasticityChoice elasticity = ElasticityChoice::rate; ///< of linear elasticity and von Mises
    double yield_stress = 0.0;                            ///< of all but elastic laws and Drucker-Prager
    Hardening hardening = {};
    DruckerPragerParameters cone = {};
    StzParameters stz = {};
    PerzynaParameters perzyna = {};
    JohnsonCookParameters johnson_cook = {}; ///< its rise of temperature follows from the numbers above
};

/// The parameters of a law besides its yield stress, in a group of --help; `whose` begins their meanings. One declaration for
/// tables of a scene and for the options of programs.
void declare(io::Keys& keys, StzParameters& stz, const std::string& group, std::string_view whose);
void declare(io::Keys& keys, PerzynaParameters& perzyna, const std::string& group, std::string_view whose);

/// The law, and what it asks for.
void declare(io::Keys& keys, MaterialData& material);
/// What a program lets its users choose of a material whose law it knows, in a group of --help.
void declare_parameters(io::Keys& keys, MaterialData& material, const std::string& group);

/// By which the temperature rises as the plastic work has it; 0: it stays.
[[nodiscard]] double effective_heat_capacity(const MaterialData& material);

/// Throws InputError for impossible values.
[[nodiscard]] Law make_law(const MaterialData& material);

} // namespace ductile
