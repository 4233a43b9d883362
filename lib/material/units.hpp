// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace ductile {

/// Natural units of a quasi-static scene, in SI. Everything inside the library is divided by them once, on the way in, and
/// multiplied once, on the way out. Defaults: Lu & Rycroft's problem (L = 1 cm, s_Y, e_Z/k_B; t_s = 1.4175 s / 35e4,
/// which is how the paper uses it: L/sqrt(mu/rho) = 4.0469e-6 s differs in the fourth digit).
struct Units {
    double length = 0.01;         ///< L [m]
    double time = 4.05e-6;        ///< t_s [s]
    double stress = 0.85e9;       ///< s_Y [Pa]
    double temperature = 21000.0; ///< e_Z/k_B [K]

    [[nodiscard]] double velocity() const { return length / time; }

    bool operator==(const Units&) const = default;
};

/// SI itself, for laws of material points.
inline constexpr Units si_units{.length = 1.0, .time = 1.0, .stress = 1.0, .temperature = 1.0};

} // namespace ductile
