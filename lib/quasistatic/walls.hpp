#pragma once
#include <string_view>
#include <vector>

namespace ductile::quasistatic {

/// Velocity of the upper wall; the lower wall moves with the opposite velocity. u shears, v opens (positive) or closes the gap.
struct WallVelocity {
    double u = 0.0;
    double v = 0.0;

    bool operator==(const WallVelocity&) const = default;
};

/// A knot of the piecewise-linear history. Two knots at one time are a jump.
struct WallKnot {
    double time = 0.0;
    WallVelocity velocity;

    bool operator==(const WallKnot&) const = default;
};

/// Piecewise-linear velocity of the walls, constant before the first and after the last knot. Any consistent units.
class WallHistory {
public:
    /// Throws InputError when there is no knot, a value is not finite, times decrease, or three knots share one time.
    explicit WallHistory(std::vector<WallKnot> knots);

    /// Mean velocity over [from, to], to > from: the exact integral of the history divided by the length.
    [[nodiscard]] WallVelocity mean(double from, double to) const;
    /// Velocity just after `time`.
    [[nodiscard]] WallVelocity after(double time) const;
    /// Velocity just before `time`: differs from after() at a jump only.
    [[nodiscard]] WallVelocity before(double time) const;
    /// Displacement of the upper wall from time 0 to `time`.
    [[nodiscard]] WallVelocity displacement(double time) const;
    /// Smallest knot time that lies after `time`, infinity if there is none: steps land on it.
    [[nodiscard]] double next_knot(double time) const;

    [[nodiscard]] const std::vector<WallKnot>& knots() const { return knots_; }

private:
    std::vector<WallKnot> knots_;
};

/// Reads "t:u" or "t:u:v" knots separated by commas (s, m/s), e.g. "0:5e-4,0.7:5e-4,0.7:-5e-4".
/// Throws InputError quoting the part that is wrong.
[[nodiscard]] WallHistory parse_wall_history(std::string_view text);

} // namespace ductile::quasistatic
