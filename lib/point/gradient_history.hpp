// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/tensor.hpp>

#include <string_view>
#include <vector>

namespace ductile::point {

/// A while of constant velocity gradient. Any consistent unit of time.
struct Segment {
    double duration = 0.0;
    VelocityGradient<double> gradient{};
};

/// One after the other; the gradient jumps between them. Its symmetric part strains the point, its skew part turns it: a
/// symmetric gradient has no spin.
using GradientHistory = std::vector<Segment>;

/// Throws InputError unless there is a segment, and all have a positive duration and finite gradients.
void check(const GradientHistory& history);

/// Ways to load a point at a constant rate.
enum class Path {
    simple_shear,       ///< du/dy = rate: a shear that turns the point, too
    shear_without_spin, ///< du/dy = dv/dx = rate/2: its symmetric part
    pure_shear,         ///< du/dx = -dv/dy = rate/2: stretched in x as it is shortened in y
    compression,        ///< dv/dy = -rate, held in x and z
};

[[nodiscard]] GradientHistory load_along(Path path, double rate, double duration);

/// Reads segments "duration:du/dx:du/dy:dv/dx:dv/dy" separated by commas (s, 1/s), e.g. "0.7:0:0.05:0:0,0.7:0:-0.05:0:0" for a
/// shear and back. Throws InputError quoting the segment that is wrong.
[[nodiscard]] GradientHistory parse_gradient_history(std::string_view text);

/// Rate of the accumulated shear strain: 2 |D_0| with |D_0|^2 = D_0 : D_0/2, which is du/dy in simple shear. As long as a
/// point is elastic and its straining keeps its direction, sbar grows by mu times this.
[[nodiscard]] double shear_rate(const VelocityGradient<double>& gradient);

} // namespace ductile::point
