// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/mpm/scene.hpp>
#include <ductile/mpm/state.hpp>
#include <ductile/mpm/time_stepper.hpp>

#include <array>
#include <cmath>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <functional>
#include <string>
#include <utility>
#include <vector>

/// Problems of the material point method with known solutions; each writes the tables of its case into a folder.
namespace solutions {

using namespace ductile;
using namespace ductile::mpm;

/// manufactured.csv: the axis-aligned manufactured solution; manufactured_steps.csv: how much half the steps change it.
void manufactured(const std::filesystem::path& folder);
/// vortex.csv: the generalised vortex; vortex_check.csv: its body force beside a numerical one.
void vortex(const std::filesystem::path& folder);
/// cylinder.csv: pressure over wall displacement; cylinder_profile.csv: the stress at the end.
void cylinder(const std::filesystem::path& folder);
/// column.csv: the column under its own weight.
void column(const std::filesystem::path& folder);
/// elastica.csv: the tip of the cantilever; elastica_line.csv: its centre line; elastica_stiffness.csv: the stiffness where the
/// quasi-static method stops.
void elastica(const std::filesystem::path& folder);
/// cook.csv: the tip of Cook's membrane.
void cook(const std::filesystem::path& folder);

/// Shape functions by the names they have in tables.
inline constexpr std::array<std::pair<const char*, ShapeFunction>, 3> all_shapes{
    {{"linear", ShapeFunction::linear}, {"gimp", ShapeFunction::gimp}, {"bspline", ShapeFunction::bspline}}};

/// A file of comma-separated values.
class Table {
public:
    Table(const std::filesystem::path& file, const std::string& header);
    /// Throws RunError where the file cannot be written.
    template <class... Values> void row(const Values&... values) {
        std::string line;
        ((line += fmt::format("{}{}", line.empty() ? "" : ",", values)), ...);
        write(line);
    }

private:
    void write(const std::string& line);
    std::filesystem::path file_;
    std::ofstream stream_;
};

/// Steps of equal length until `end` seconds, `after` each of them whatever the case has to see to. Throws RunError for a step
/// that is not accepted.
void advance(TimeStepper& stepper, State& state, double end, int steps, const std::function<void()>& after = {});

/// The quasi-static method with Newton iterations that end at a residual of `tolerance` Y dx dy dt.
[[nodiscard]] std::unique_ptr<TimeStepper> quasi_static_stepper(const Scene& scene, double tolerance);

/// Root mean square over terms that are added one by one.
class RootMeanSquare {
public:
    void add(double x) {
        sum_ += x * x;
        ++count_;
    }
    [[nodiscard]] double value() const { return std::sqrt(sum_ / count_); }

private:
    double sum_ = 0.0;
    int count_ = 0;
};

/// Places of the particles at the start, by their numbers.
struct Places {
    std::vector<double> x, y;
    explicit Places(const Particles& p) : x(p.x.begin(), p.x.end()), y(p.y.begin(), p.y.end()) {}
};

/// The number of particles that are no longer in their first cell.
[[nodiscard]] int crossed(const Grid& grid, const Particles& particles, const Places& start);

} // namespace solutions
