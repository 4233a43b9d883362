// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <string>
#include <vector>

namespace ductile {

/// What a scene says of one of its materials, in SI; zero stands for what it does not have or does not know.
struct MaterialNumbers {
    std::string name = "the material"; ///< begins each sentence
    double young_modulus = 0.0;        ///< E [Pa]
    double poisson_ratio = 0.0;        ///< nu
    double density = 0.0;              ///< rho [kg/m^3]
    double yield_stress = 0.0;         ///< first yield in simple tension, or |sigma| there by the law's own measure [Pa]
    double hardening = 0.0;            ///< rise of the yield stress with plastic strain at first yield [Pa]
    double heat_capacity = 0.0;        ///< per mass [J/(kg K)]
    double speed = 0.0;                ///< the largest in the scene, where it has inertia [m/s]
};

/// sqrt((lambda + 2 mu)/rho), the speed of longitudinal waves [m/s]; 0 without density.
[[nodiscard]] double wave_speed(const MaterialNumbers& material);

/// "E = 2e+11 Pa, nu = 0.3, rho = 7800 kg/m^3, yield stress 7e+08 Pa, wave speed 5875 m/s", as far as known.
[[nodiscard]] std::string describe(const MaterialNumbers& material);

/// Warnings, each a sentence with a figure, about what no solid has: a slip of units, mostly. Bounds that solids are far from:
/// - E above 2e12 Pa, and below 1e6 Pa at a density above 2000 kg/m^3: foams and gels are soft, metals and minerals are not;
/// - nu below 0 or above 0.495; a density outside 1 to 30000 kg/m^3; waves faster than 30 km/s;
/// - a yield stress above E/10 or below E/10^6; hardening above 100 E; a heat capacity outside 20 to 20000 J/(kg K); a speed
/// above sqrt(E/rho)/10, which yields or breaks what it meets. A model in numbers of its own (E = 1000 Pa, rho = 10 kg/m^3)
/// passes.
[[nodiscard]] std::vector<std::string> doubts(const MaterialNumbers& material);

} // namespace ductile
