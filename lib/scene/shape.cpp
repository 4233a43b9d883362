// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/nearest_name.hpp>
#include <ductile/io/option_values.hpp>
#include <ductile/scene/shape.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace ductile {

namespace {

Box hull(const Box& a, const Box& b) {
    return {std::min(a.left, b.left), std::min(a.bottom, b.bottom), std::max(a.right, b.right), std::max(a.top, b.top)};
}

} // namespace

Shape rectangle(double left, double bottom, double right, double top) {
    return {[=](double x, double y) { return x > left && x < right && y > bottom && y < top; },
            fmt::format("{{rectangle = {}}}", io::toml_array({left, bottom, right, top})),
            {left, bottom, right, top},
            {{.corners = {{left, bottom}, {right, bottom}, {right, top}, {left, top}}}}};
}

Shape disk(double centre_x, double centre_y, double radius) {
    return {[=](double x, double y) { return std::hypot(x - centre_x, y - centre_y) < radius; },
            fmt::format("{{disk = {}}}", io::toml_array({centre_x, centre_y, radius})),
            {centre_x - radius, centre_y - radius, centre_x + radius, centre_y + radius},
            {{.centre = {centre_x, centre_y}, .radius = radius}}};
}

bool encloses(const std::vector<std::array<double, 2>>& corners, double x, double y) {
    bool odd = false;
    for (std::size_t k = 0; k < corners.size(); ++k) {
        const auto& [ax, ay] = corners[k];
        const auto& [bx, by] = corners[(k + 1) % corners.size()];
        if ((ay > y) != (by > y) && x < ax + (y - ay) / (by - ay) * (bx - ax))
            odd = !odd;
    }
    return odd;
}

Shape polygon(std::vector<std::array<double, 2>> corners) {
    std::string text;
    Box box{everywhere.right, everywhere.top, everywhere.left, everywhere.bottom};
    for (const auto& [x, y] : corners) {
        text += (text.empty() ? "" : ", ") + io::toml_array({x, y});
        box = hull(box, {x, y, x, y});
    }
    const auto inside = [corners](double x, double y) { return encloses(corners, x, y); };
    return {inside, fmt::format("{{polygon = [{}]}}", text), box, {{.corners = std::move(corners)}}};
}

namespace {

/// "{how = [shape, ...]}", or nothing if one of the shapes has no text.
std::string joined(const char* how, const std::vector<Shape>& shapes) {
    std::string text;
    for (const Shape& shape : shapes) {
        if (shape.toml().empty())
            return {};
        text += (text.empty() ? "" : ", ") + shape.toml();
    }
    return fmt::format("{{{} = [{}]}}", how, text);
}

std::vector<Outline> outlines_of(const std::vector<Shape>& shapes) {
    std::vector<Outline> all;
    for (const Shape& shape : shapes)
        all.insert(all.end(), shape.outlines().begin(), shape.outlines().end());
    return all;
}

// of any number of shapes at once: calls within calls would go as deep

Shape union_of(std::vector<Shape> shapes) {
    std::string text = joined("union", shapes);
    std::vector<Outline> outlines = outlines_of(shapes);
    Box box = shapes.front().box();
    for (const Shape& shape : shapes)
        box = hull(box, shape.box());
    return {[shapes = std::move(shapes)](double x, double y) {
                return std::ranges::any_of(shapes, [&](const Shape& shape) { return shape(x, y); });
            },
            std::move(text), box, std::move(outlines)};
}

/// The first without the others.
Shape difference_of(std::vector<Shape> shapes) {
    std::string text = joined("difference", shapes);
    std::vector<Outline> outlines = outlines_of(shapes);
    const Box box = shapes.front().box();
    return {[shapes = std::move(shapes)](double x, double y) {
                return shapes.front()(x, y) &&
                       std::none_of(shapes.begin() + 1, shapes.end(), [&](const Shape& shape) { return shape(x, y); });
            },
            std::move(text), box, std::move(outlines)};
}

} // namespace

Shape operator|(Shape first, Shape second) { return union_of({std::move(first), std::move(second)}); }

Shape operator-(Shape first, Shape second) { return difference_of({std::move(first), std::move(second)}); }

std::vector<double> read_numbers(const io::ConfigNode& array, std::size_t count) {
    std::vector<double> numbers;
    for (const io::ConfigNode& child : array.children)
        if (!child.is_array() && !child.is_table())
            numbers.push_back(io::parse_number(child.text));
    if (!array.is_array() || numbers.size() != count || array.children.size() != count)
        throw InputError(fmt::format("'{}' must be {} numbers in brackets", to_toml(array), count));
    return numbers;
}

io::ConfigNode value_of(const std::string& toml) { return io::read_config("value = " + toml, "value").children.front(); }

std::vector<std::vector<double>> read_rows(const io::ConfigNode& array, const std::vector<std::size_t>& widths) {
    std::vector<std::vector<double>> rows;
    for (const io::ConfigNode& row : array.children) {
        if (!row.is_array() || std::ranges::find(widths, row.children.size()) == widths.end())
            throw InputError(fmt::format("'{}' must be {} numbers in brackets", to_toml(row), fmt::join(widths, " or ")));
        rows.push_back(read_numbers(row, row.children.size()));
    }
    if (rows.empty())
        throw InputError(fmt::format("'{}' must be a list of lists of {} numbers", to_toml(array), fmt::join(widths, " or ")));
    return rows;
}

Shape read_shape(const io::ConfigNode& table) {
    const std::vector<std::string> kinds = {"rectangle", "disk", "polygon", "union", "difference"};
    if (!table.is_table() || table.children.size() != 1)
        throw InputError(fmt::format("'{}' must be a table with one of the keys {}, as {{disk = [x, y, radius]}}", to_toml(table),
                                     fmt::join(kinds, ", ")));
    const io::ConfigNode& value = table.children.front();
    if (value.key == "rectangle") {
        const std::vector<double> v = read_numbers(value, 4);
        if (!(v[0] < v[2] && v[1] < v[3]))
            throw InputError(fmt::format("the rectangle {} must be [left, bottom, right, top]", to_toml(value)));
        return rectangle(v[0], v[1], v[2], v[3]);
    }
    if (value.key == "disk") {
        const std::vector<double> v = read_numbers(value, 3);
        if (!(v[2] > 0.0))
            throw InputError(fmt::format("the disk {} has no positive radius: it must be [x, y, radius]", to_toml(value)));
        return disk(v[0], v[1], v[2]);
    }
    if (value.key == "polygon") {
        std::vector<std::array<double, 2>> corners;
        for (const std::vector<double>& row : read_rows(value, {2}))
            corners.push_back({row[0], row[1]});
        if (corners.size() < 3)
            throw InputError("a polygon has three corners or more");
        return polygon(std::move(corners));
    }
    if (value.key != "union" && value.key != "difference")
        throw InputError(fmt::format("there is no shape '{}'{}; there are {}", value.key, io::did_you_mean(value.key, kinds),
                                     fmt::join(kinds, ", ")));
    if (!value.is_array() || value.children.size() < 2)
        throw InputError(fmt::format("a {} is a list of two shapes or more", value.key));
    std::vector<Shape> shapes;
    for (const io::ConfigNode& child : value.children)
        shapes.push_back(read_shape(child));
    return value.key == "union" ? union_of(std::move(shapes)) : difference_of(std::move(shapes));
}

} // namespace ductile
