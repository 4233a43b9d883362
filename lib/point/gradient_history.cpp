// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/option_values.hpp>
#include <ductile/point/gradient_history.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <string>

namespace ductile::point {

void check(const GradientHistory& history) {
    if (history.empty())
        throw InputError("the history of the velocity gradient is empty: give at least one segment");
    for (std::size_t k = 0; k < history.size(); ++k) {
        const auto& [duration, g] = history[k];
        if (!(duration > 0.0 && std::isfinite(duration)))
            throw InputError(fmt::format("history of the velocity gradient, segment {}: its duration is {}; it must be positive "
                                         "and finite",
                                         k + 1, duration));
        for (const double component : {g.ux, g.uy, g.vx, g.vy})
            if (!std::isfinite(component))
                throw InputError(fmt::format(
                    "history of the velocity gradient, segment {}: a component is {}; all must be finite", k + 1, component));
    }
}

GradientHistory load_along(Path path, double rate, double duration) {
    const double half = 0.5 * rate;
    GradientHistory history(1, {.duration = duration});
    switch (path) {
    case Path::simple_shear:
        history[0].gradient = {.ux = 0.0, .uy = rate, .vx = 0.0, .vy = 0.0};
        break;
    case Path::shear_without_spin:
        history[0].gradient = {.ux = 0.0, .uy = half, .vx = half, .vy = 0.0};
        break;
    case Path::pure_shear:
        history[0].gradient = {.ux = half, .uy = 0.0, .vx = 0.0, .vy = -half};
        break;
    case Path::compression:
        history[0].gradient = {.ux = 0.0, .uy = 0.0, .vx = 0.0, .vy = -rate};
        break;
    }
    check(history);
    return history;
}

GradientHistory parse_gradient_history(std::string_view text) {
    GradientHistory history;
    std::string_view rest = text;
    for (bool more = true; more;) { // a segment follows every comma
        const auto comma = rest.find(',');
        const std::string_view part = rest.substr(0, comma);
        more = comma != std::string_view::npos;
        if (more)
            rest.remove_prefix(comma + 1);
        std::string numbers(part);
        std::ranges::replace(numbers, ':', ',');
        try {
            const std::vector<double> v = io::parse_number_list(numbers);
            if (v.size() != 5)
                throw InputError(fmt::format("it has {} numbers", v.size()));
            history.push_back({v[0], {.ux = v[1], .uy = v[2], .vx = v[3], .vy = v[4]}});
        } catch (const InputError& error) {
            throw InputError(fmt::format(
                "--gradient-history: '{}' in '{}': {}; give segments duration:du/dx:du/dy:dv/dx:dv/dy in s and 1/s, separated "
                "by commas, e.g. 0.7:0:0.05:0:0,0.7:0:-0.05:0:0",
                part, text, error.what()));
        }
    }
    check(history);
    return history;
}

double shear_rate(const VelocityGradient<double>& g) {
    // D_0 in the components of Eq. (1): s = (ux - vy)/2, tau = (uy + vx)/2, q = -tr D/6
    return std::hypot(g.ux - g.vy, g.uy + g.vx, (g.ux + g.vy) / std::sqrt(3.0));
}

} // namespace ductile::point
