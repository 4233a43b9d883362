// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/scene/walls.hpp>
#include <ductile/space/space.hpp>

#include <string_view>

namespace ductile::quasistatic {

struct Scene;

/// Of the upper wall; the lower wall moves with the opposite velocity. u shears, v opens (positive) or closes the gap.
using WallVelocity = Velocity;
using WallHistory = History<WallVelocity>;
using WallKnot = WallHistory::Knot;

/// Reads "t:u" or "t:u:v" knots separated by commas (s, m/s), e.g. "0:5e-4,0.7:5e-4,0.7:-5e-4".
/// Throws InputError quoting the part that is wrong.
[[nodiscard]] WallHistory parse_wall_history(std::string_view text);
/// Reads one traction for all times, or "t:traction" knots without jumps (s, Pa); `option` is named in messages. Throws
/// InputError quoting the part that is wrong.
[[nodiscard]] History<double> parse_traction_history(std::string_view option, std::string_view text);

/// Force control. The walls add the uniform rate C : D_w to that of the stress, and the rest of C : D(v), of a velocity that
/// vanishes on them, has no mean in tau and sigma_yy: the sums of its differences over the cells of a column, or a row, cancel.
/// So the mean stress, which is the traction in equilibrium, obeys
///   `d<tau>/dt = <f_tau> + mu U/(H/2),   d<sigma_yy>/dt = <f_yy> + (K + 4 mu/3) V/(H/2)`,
/// for f all else that changes it, and what the traction is to do says how the walls move; their motion is known to be affine
/// without another elliptic solution, because the moduli are the same everywhere.

/// The velocity that changes the tractions that are controlled from `mean` to `wanted` in the time dt; zero of other components.
[[nodiscard]] WallVelocity wall_velocity_between(const Scene& scene, const MeanTraction& mean, const MeanTraction& wanted,
                                                 double dt);
/// The velocity of both components that `told` asks for where everything else changes the mean stress at the rate `open_rate`.
[[nodiscard]] WallVelocity wall_velocity(const Scene& scene, const WallRates& told, const MeanTraction& open_rate);
/// The tractions that are controlled, at a time.
[[nodiscard]] MeanTraction wanted_traction(const Scene& scene, double time);

/// Moves the walls at once, and hence elastically: the stress changes by a uniform one. Nobody counts the work.
void move_walls(const Scene& scene, const Velocity& motion, CellState& cells);
/// To where the tractions that are controlled are those of a time; counts the work.
void bring_to_load(const Scene& scene, Space& space, double time, CellState& cells);

/// The largest of the norms (59) of a combination, to which the motion of walls under force control belongs, as the stress that
/// it would make: the error of a traction that is held is zero, and the walls have it.
[[nodiscard]] double largest_norm(const Scene& scene, Space& space, std::span<const Space::Term> terms);

} // namespace ductile::quasistatic
