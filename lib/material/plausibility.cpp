// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/material/plausibility.hpp>

#include <cmath>
#include <fmt/format.h>

namespace ductile {

double wave_speed(const MaterialNumbers& m) {
    if (!(m.density > 0.0))
        return 0.0;
    const double nu = m.poisson_ratio;
    const double modulus = m.young_modulus * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)); // lambda + 2 mu
    return std::sqrt(modulus / m.density);
}

std::string describe(const MaterialNumbers& m) {
    std::string text = fmt::format("E = {:.4g} Pa, nu = {:.4g}", m.young_modulus, m.poisson_ratio);
    if (m.density > 0.0)
        text += fmt::format(", rho = {:.4g} kg/m^3", m.density);
    if (m.yield_stress > 0.0)
        text += fmt::format(", yield stress {:.4g} Pa", m.yield_stress);
    if (m.density > 0.0)
        text += fmt::format(", wave speed {:.4g} m/s", wave_speed(m));
    return text;
}

std::vector<std::string> doubts(const MaterialNumbers& m) {
    std::vector<std::string> found;
    const auto doubt = [&](bool doubtful, const std::string& sentence) {
        if (doubtful)
            found.push_back(fmt::format("{} has {}", m.name, sentence));
    };
    const double E = m.young_modulus, rho = m.density;
    doubt(E > 2e12, fmt::format("Young's modulus {:.4g} Pa, more than any solid (diamond: 1.1e12 Pa): check its unit", E));
    doubt(rho > 2000.0 && E < 1e6,
          fmt::format("Young's modulus {:.4g} Pa at a density of {:.4g} kg/m^3, where solids have more than 1e6 Pa: check the "
                      "units of both",
                      E, rho));
    doubt(
        m.poisson_ratio < -1e-9 || m.poisson_ratio > 0.495,
        fmt::format("Poisson's ratio {:.4g}, and solids have 0 to 0.495: near 0.5 particles and cells lock and stress comes out "
                    "too large, and a negative one asks for an auxetic foam: check it",
                    m.poisson_ratio));
    doubt(rho > 0.0 && !(rho >= 1.0 && rho <= 30'000.0),
          fmt::format("the density {:.4g} kg/m^3, and solids have 1 to 30000: check its unit", rho));
    const double waves = wave_speed(m);
    doubt(rho >= 1.0 && waves > 30e3 && m.poisson_ratio <= 0.495,
          fmt::format("a wave speed of {:.4g} m/s, and no solid has more than 20000: check the units of Young's modulus, "
                      "{:.4g} Pa, and density, {:.4g} kg/m^3",
                      waves, E, rho));
    const double strain = m.yield_stress / E;
    doubt(m.yield_stress > 0.0 && !(strain >= 1e-6 && strain <= 0.1),
          fmt::format("a yield stress of {:.4g} Pa, {:.3g} times Young's modulus {:.4g} Pa, and solids have 1e-6 to 0.1 times: "
                      "check the units of both",
                      m.yield_stress, strain, E));
    doubt(m.hardening > 100.0 * E,
          fmt::format("a hardening modulus of {:.4g} Pa, {:.3g} times Young's modulus {:.4g} Pa, which is "
                      "not to yield at all: check the units of both",
                      m.hardening, m.hardening / E, E));
    doubt(m.heat_capacity > 0.0 && !(m.heat_capacity >= 20.0 && m.heat_capacity <= 20e3),
          fmt::format("a heat capacity of {:.4g} J/(kg K), and solids have 20 to 20000 above the cold: check its unit",
                      m.heat_capacity));
    const double mach = rho > 0.0 ? m.speed / std::sqrt(E / rho) : 0.0;
    doubt(mach > 0.1,
          fmt::format("to bear a speed of {:.4g} m/s, {:.3g} times its wave speed sqrt(E/rho), and above 0.1 the strain at an "
                      "impact is more than elasticity at small strain covers: check the speed and the units",
                      m.speed, mach));
    return found;
}

} // namespace ductile
