#include <ductile/base/error.hpp>
#include <ductile/quasistatic/walls.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace ductile::quasistatic {

namespace {

WallVelocity interpolate(const WallKnot& a, const WallKnot& b, double time) {
    const double w = (time - a.time) / (b.time - a.time);
    return {a.velocity.u + w * (b.velocity.u - a.velocity.u), a.velocity.v + w * (b.velocity.v - a.velocity.v)};
}

void add_trapezoid(WallVelocity& sum, const WallVelocity& a, const WallVelocity& b, double length) {
    sum.u += 0.5 * length * (a.u + b.u);
    sum.v += 0.5 * length * (a.v + b.v);
}

} // namespace

WallHistory::WallHistory(std::vector<WallKnot> knots) : knots_(std::move(knots)) {
    if (knots_.empty())
        throw InputError("the wall history has no knot: give at least one time:velocity pair");
    for (std::size_t k = 0; k < knots_.size(); ++k) {
        const auto& [time, velocity] = knots_[k];
        if (!std::isfinite(time) || !std::isfinite(velocity.u) || !std::isfinite(velocity.v))
            throw InputError(fmt::format("wall history, knot {}: time {} and velocity ({}, {}) must be finite", k + 1, time,
                                         velocity.u, velocity.v));
        if (k > 0 && time < knots_[k - 1].time)
            throw InputError(fmt::format("wall history, knot {}: time {} lies before the previous knot's {}", k + 1, time,
                                         knots_[k - 1].time));
        if (k > 1 && time == knots_[k - 2].time)
            throw InputError(fmt::format("wall history: three knots at time {}; two describe a jump", time));
    }
}

WallVelocity WallHistory::after(double time) const {
    const auto next =
        std::upper_bound(knots_.begin(), knots_.end(), time, [](double t, const WallKnot& k) { return t < k.time; });
    if (next == knots_.begin())
        return knots_.front().velocity;
    if (next == knots_.end())
        return knots_.back().velocity;
    return interpolate(*(next - 1), *next, time);
}

WallVelocity WallHistory::before(double time) const {
    const auto next =
        std::lower_bound(knots_.begin(), knots_.end(), time, [](const WallKnot& k, double t) { return k.time < t; });
    if (next == knots_.begin())
        return knots_.front().velocity;
    if (next == knots_.end())
        return knots_.back().velocity;
    return interpolate(*(next - 1), *next, time);
}

WallVelocity WallHistory::mean(double from, double to) const {
    const WallVelocity first = after(from);
    const auto inside = [&](const WallKnot& k) { return k.time > from && k.time < to; };
    if (std::none_of(knots_.begin(), knots_.end(), inside) && next_knot(from) == std::numeric_limits<double>::infinity())
        return first; // constant: returned to the last bit, so that walls at rest in the frame of the step need no work

    // integral over the pieces between knots; a knot at `to` closes the last piece from its left side
    WallVelocity sum, value = first;
    double time = from;
    for (const WallKnot& knot : knots_) {
        if (knot.time <= from || time >= to)
            continue;
        const double end = std::min(knot.time, to);
        const WallVelocity at_end = knot.time <= to ? knot.velocity : interpolate({time, value}, knot, to);
        add_trapezoid(sum, value, at_end, end - time);
        time = end;
        value = at_end; // at a jump the second knot follows at once
    }
    if (time < to)
        add_trapezoid(sum, value, value, to - time);
    return {sum.u / (to - from), sum.v / (to - from)};
}

WallVelocity WallHistory::displacement(double time) const {
    if (time <= 0.0)
        return {};
    const WallVelocity velocity = mean(0.0, time);
    return {velocity.u * time, velocity.v * time};
}

double WallHistory::next_knot(double time) const {
    const auto next =
        std::upper_bound(knots_.begin(), knots_.end(), time, [](double t, const WallKnot& k) { return t < k.time; });
    return next == knots_.end() ? std::numeric_limits<double>::infinity() : next->time;
}

WallHistory parse_wall_history(std::string_view text) {
    const auto fail = [&](std::string_view part) {
        return InputError(
            fmt::format("--wall-history: cannot read '{}' in '{}': give knots time:u or time:u:v in s and m/s, separated "
                        "by commas, e.g. 0:5e-4,0.7:5e-4,0.7:-5e-4",
                        part, text));
    };
    std::vector<WallKnot> knots;
    std::string_view rest = text;
    for (bool more = !text.empty(); more;) { // a knot follows every comma
        const auto comma = rest.find(',');
        const std::string_view part = rest.substr(0, comma);
        more = comma != std::string_view::npos;
        if (more)
            rest.remove_prefix(comma + 1);
        double values[3] = {0.0, 0.0, 0.0};
        int count = 0;
        const char* cursor = part.data();
        const char* const end = part.data() + part.size();
        while (count < 3) {
            const auto [stop, status] = std::from_chars(cursor, end, values[count]);
            if (status != std::errc{})
                throw fail(part);
            ++count;
            cursor = stop;
            if (cursor == end || *cursor != ':')
                break;
            ++cursor;
        }
        if (cursor != end || count < 2)
            throw fail(part);
        knots.push_back({values[0], {values[1], values[2]}});
    }
    return WallHistory(std::move(knots));
}

} // namespace ductile::quasistatic
