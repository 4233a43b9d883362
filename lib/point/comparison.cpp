// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/timer.hpp>
#include <ductile/io/terminal_plot.hpp>
#include <ductile/point/comparison.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <iterator>
#include <limits>
#include <vector>

namespace ductile::point {

namespace {

/// The accumulated shear strain at every time of a trajectory.
std::vector<double> strains(const GradientHistory& history, const Trajectory& trajectory) {
    std::vector<double> strain{0.0};
    for (std::size_t k = 0; k < history.size(); ++k)
        for (std::size_t i = strain.size(); i <= trajectory.segment_end[k]; ++i)
            strain.push_back(strain.back() + shear_rate(history[k].gradient) * (trajectory.time[i] - trajectory.time[i - 1]));
    return strain;
}

double deviatoric_magnitude(const State& y) { return std::hypot(y[1], y[2], std::sqrt(3.0) * y[3]); }

} // namespace

Run measure(const Law& law, const GradientHistory& history, const State& start, Method method, double tolerance) {
    Run run{.method = method, .tolerance = tolerance, .wall_seconds = std::numeric_limits<double>::infinity()};
    for (int repeat = 0; repeat < 3; ++repeat) {
        Timer timer;
        run.trajectory = integrate(law, history, start, method, tolerance);
        run.wall_seconds = std::min(run.wall_seconds, timer.lap());
    }
    run.largest_error = largest_error(law, history, run.trajectory);
    return run;
}

std::string table_heading() {
    return fmt::format("{:<26}{:>10}{:>9}{:>10}{:>13}{:>12}{:>12}\n", "method", "tolerance", "steps", "rejected", "evaluations",
                       "error", "time [ms]");
}

std::string table_line(const Run& run) {
    const sundials::Counts& counts = run.trajectory.counts;
    return fmt::format("{:<26}{:>10.0e}{:>9}{:>10}{:>13}{:>12.1e}{:>12.3f}\n", name(run.method), run.tolerance, counts.steps,
                       counts.rejected, counts.evaluations, run.largest_error, 1e3 * run.wall_seconds);
}

std::string work_precision_csv(std::span<const Run> runs) {
    std::string text = "method,tolerance,steps,rejected,evaluations,largest_error,wall_s\n";
    for (const Run& run : runs) {
        const sundials::Counts& counts = run.trajectory.counts;
        fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{}\n", name(run.method), run.tolerance, counts.steps,
                       counts.rejected, counts.evaluations, run.largest_error, run.wall_seconds);
    }
    return text;
}

std::string trajectories_csv(const Law& law, const GradientHistory& history, const Units& units, std::span<const Run> runs) {
    std::string text = "method,tolerance,time_s,accumulated_shear_strain,pressure_Pa,s_Pa,tau_Pa,q_Pa,deviatoric_magnitude_Pa";
    for (const InternalVariable& variable : law->variables())
        text += fmt::format(",{}", column_name(variable));
    text += "\n";
    for (const Run& run : runs) {
        const Trajectory& trajectory = run.trajectory;
        const std::vector<double> strain = strains(history, trajectory);
        for (std::size_t i = 0; i < trajectory.time.size(); ++i) {
            const State& y = trajectory.state[i];
            fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{},{}", name(run.method), run.tolerance,
                           trajectory.time[i] * units.time, strain[i], y[0] * units.stress, y[1] * units.stress,
                           y[2] * units.stress, y[3] * units.stress, deviatoric_magnitude(y) * units.stress);
            for (std::size_t k = 4; k < y.size(); ++k)
                fmt::format_to(std::back_inserter(text), ",{}", y[k] * law->variables()[k - 4].natural_unit);
            text += "\n";
        }
    }
    return text;
}

std::string stress_strain_curve(const GradientHistory& history, const Units& units, std::span<const Run> runs) {
    const Run& run = *std::ranges::max_element(runs, {}, [](const Run& r) { return r.trajectory.time.size(); });
    std::vector<double> stress;
    for (const State& y : run.trajectory.state)
        stress.push_back(deviatoric_magnitude(y) * units.stress * 1e-6);
    return io::terminal_plot(strains(history, run.trajectory), stress,
                             {.title = fmt::format("deviatoric stress sbar [MPa], by {}", name(run.method)),
                              .x_label = "accumulated shear strain",
                              .y_label = "sbar"});
}

} // namespace ductile::point
