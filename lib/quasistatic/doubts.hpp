#pragma once
#include <ductile/quasistatic/options.hpp>

#include <string>
#include <vector>

namespace ductile::quasistatic {

/// Throws InputError where the scene has no meaning: numbers that overflow, cells a million times as long as high, or walls
/// faster than shear waves. The density that decides on waves is not among the options: that of the metallic glass, 6134 kg/m^3,
/// which its t_s stands for.
void check_meaning(const Options& options, const Scene& scene);

/// Warnings, each a sentence with a figure, known before the first step: what the material has that no solid has; cells more than
/// ten times as long as high, or the other way round; an effective temperature that starts below that of the bath, or a bath
/// above the steady one; walls that load to yield in less than ten passages of shear waves from wall to wall.
[[nodiscard]] std::vector<std::string> doubts(const Options& options, const Scene& scene, const CellState& start);

} // namespace ductile::quasistatic
