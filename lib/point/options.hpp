// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/program.hpp>
#include <ductile/point/integrate.hpp>
#include <ductile/scene/material_options.hpp>

#include <string>
#include <vector>

namespace ductile::point {

/// All options of the program material_point, in SI; the defaults shear Lu & Rycroft's metallic glass at the rate of their Sec. 8
/// by 7 per cent.
struct Options {
    MaterialOptions material;
    double initial_temperature = 640.0; ///< STZ: T_base of Table C.5; plastic strain begins at zero
    Path path = Path::simple_shear;
    double rate = 2e-7 / 4.05e-6; ///< U/L = 2e-7/t_s
    double duration = 1.4175;
    std::string gradient_history; ///< replaces path, rate and duration unless empty
    std::vector<double> tolerances{1e-4, 1e-6, 1e-8};
};

void declare(io::Program& program, Options& options);

/// Throws InputError when there is no tolerance.
void check(const Options& options);

/// The problem in natural units. Throw InputError for impossible values.
[[nodiscard]] GradientHistory make_history(const Options& options, const Units& units);
[[nodiscard]] State make_start(const Options& options, const Law& law);

/// The lines before a run: material and loading.
[[nodiscard]] std::string describe(const Options& options, const GradientHistory& history, const Units& units);

} // namespace ductile::point
