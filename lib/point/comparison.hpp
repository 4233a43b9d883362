// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/material/units.hpp>
#include <ductile/point/integrate.hpp>

#include <span>
#include <string>

namespace ductile::point {

/// One integration: what was asked for, and what came of it.
struct Run {
    Method method = Method::rk21;
    double tolerance = 0.0;
    Trajectory trajectory = {};
    double largest_error = 0.0; ///< see largest_error()
    double wall_seconds = 0.0;  ///< the fastest of three
};

[[nodiscard]] Run measure(const Law& law, const GradientHistory& history, const State& start, Method method, double tolerance);

/// The work-precision table for the terminal: one line a run, below the heading.
[[nodiscard]] std::string table_heading();
[[nodiscard]] std::string table_line(const Run& run);

/// The same table for a file.
[[nodiscard]] std::string work_precision_csv(std::span<const Run> runs);

/// A row a step of every run, in SI.
[[nodiscard]] std::string trajectories_csv(const Law& law, const GradientHistory& history, const Units& units,
                                           std::span<const Run> runs);

/// sbar over the accumulated shear strain, drawn for the terminal: the run with the most steps. There must be a run.
[[nodiscard]] std::string stress_strain_curve(const GradientHistory& history, const Units& units, std::span<const Run> runs);

} // namespace ductile::point
