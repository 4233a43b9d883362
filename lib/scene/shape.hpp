// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/config_file.hpp>

#include <array>
#include <concepts>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace ductile {

/// A rectangle of the plane, by its edges; that of nothing is empty.
struct Box {
    double left, bottom, right, top;
};
/// All of the plane.
inline constexpr Box everywhere{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
                                std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};

/// A closed line: a polygon's corners one after another, either way around, or, without corners, a circle.
struct Outline {
    std::vector<std::array<double, 2>> corners = {};
    std::array<double, 2> centre = {};
    double radius = 0.0;
};

/// A region of the plane, open: says whether a point (x, y) in metres belongs to it, and how a scene file writes it.
class Shape {
public:
    /// Nothing.
    Shape() = default;
    /// Where a function says so, within `box`; `toml` is empty for a shape that no file can hold. The shape's edge is on
    /// `outlines`.
    template <std::predicate<double, double> Inside>
    Shape(Inside inside, std::string toml = {}, const Box& box = everywhere,
          std::vector<Outline> outlines = {}) // NOLINT: implicit
        : inside_(std::move(inside)), toml_(std::move(toml)), box_(box), outlines_(std::move(outlines)) {}

    [[nodiscard]] bool operator()(double x, double y) const { return inside_ && inside_(x, y); }
    /// "{rectangle = [0, 0, 1, 2]}"
    [[nodiscard]] const std::string& toml() const { return toml_; }
    /// Nothing of it lies beyond.
    [[nodiscard]] const Box& box() const { return box_; }
    /// Lines that together hold its edge, and, of a union or difference, more than that. None of a function's shape.
    [[nodiscard]] const std::vector<Outline>& outlines() const { return outlines_; }

private:
    std::function<bool(double, double)> inside_;
    std::string toml_;
    Box box_ = {};
    std::vector<Outline> outlines_;
};

[[nodiscard]] Shape rectangle(double left, double bottom, double right, double top);
[[nodiscard]] Shape disk(double centre_x, double centre_y, double radius);
/// Whether the sides from corner to corner, and from the last to the first, go around a point an odd number of times.
[[nodiscard]] bool encloses(const std::vector<std::array<double, 2>>& corners, double x, double y);
/// What they so enclose.
[[nodiscard]] Shape polygon(std::vector<std::array<double, 2>> corners);
[[nodiscard]] Shape operator|(Shape first, Shape second); ///< union
[[nodiscard]] Shape operator-(Shape first, Shape second); ///< what is in the first and not in the second

/// The shape that a file writes as a table: {rectangle = [left, bottom, right, top]}, {disk = [x, y, radius]},
/// {polygon = [[x, y], ...]}, {union = [shape, ...]} or {difference = [shape, ...]}, the first without the others. Throws
/// InputError that says what is wrong and allowed.
[[nodiscard]] Shape read_shape(const io::ConfigNode& table);

/// What a key of a file would have with this text as its value.
[[nodiscard]] io::ConfigNode value_of(const std::string& toml);
/// Rows of numbers, each as long as one of `widths` says, e.g. [[0, 1], [2, 3]] for {2}. Throws InputError for anything else, and
/// for numbers that are not finite.
[[nodiscard]] std::vector<std::vector<double>> read_rows(const io::ConfigNode& array, const std::vector<std::size_t>& widths);
/// So many numbers. Throws InputError for anything else.
[[nodiscard]] std::vector<double> read_numbers(const io::ConfigNode& array, std::size_t count);

} // namespace ductile
