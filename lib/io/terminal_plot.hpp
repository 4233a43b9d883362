// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <span>
#include <string>

namespace ductile::io {

struct PlotOptions {
    std::string title = {};
    std::string x_label = {}; ///< with units: "strain", "time [s]"
    std::string y_label = {};
    int width = 70;  ///< characters of the drawing area
    int height = 16; ///< lines of the drawing area
};

/// Draws the curve y(x) with braille dots, axes and labelled ticks. Points that are not finite leave a gap.
/// Returns lines of text (UTF-8), also for empty or constant curves. Throws InputError when x and y differ in length.
[[nodiscard]] std::string terminal_plot(std::span<const double> x, std::span<const double> y, const PlotOptions& options);

} // namespace ductile::io
