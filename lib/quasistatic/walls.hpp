#pragma once
#include <ductile/scene/history.hpp>

#include <string_view>

namespace ductile::quasistatic {

/// Velocity of the upper wall; the lower wall moves with the opposite velocity. u shears, v opens (positive) or closes the gap.
using WallVelocity = Velocity;
using WallHistory = History<WallVelocity>;
using WallKnot = WallHistory::Knot;

/// Reads "t:u" or "t:u:v" knots separated by commas (s, m/s), e.g. "0:5e-4,0.7:5e-4,0.7:-5e-4".
/// Throws InputError quoting the part that is wrong.
[[nodiscard]] WallHistory parse_wall_history(std::string_view text);

} // namespace ductile::quasistatic
