// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: vectors in the plane.
#include <array>
#include <cmath>

namespace ductile::mpm {

using PlaneVector = std::array<double, 2>;

[[nodiscard]] inline PlaneVector operator+(const PlaneVector& a, const PlaneVector& b) { return {a[0] + b[0], a[1] + b[1]}; }
[[nodiscard]] inline PlaneVector operator-(const PlaneVector& a, const PlaneVector& b) { return {a[0] - b[0], a[1] - b[1]}; }
[[nodiscard]] inline PlaneVector operator*(double factor, const PlaneVector& a) { return {factor * a[0], factor * a[1]}; }
[[nodiscard]] inline double dot(const PlaneVector& a, const PlaneVector& b) { return a[0] * b[0] + a[1] * b[1]; }
[[nodiscard]] inline double length(const PlaneVector& a) { return std::hypot(a[0], a[1]); }

} // namespace ductile::mpm
