// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/point/options.hpp>

#include <fmt/format.h>

namespace ductile::point {

void declare(io::Program& program, Options& o) {
    declare(program, o.material);
    const auto help = [](std::string meaning, std::string units = {}, io::Limits allowed = io::positive) {
        return io::OptionHelp{"Loading", std::move(meaning), std::move(units), allowed};
    };
    program.option("--initial-temperature", o.initial_temperature,
                   help("STZ: effective temperature to begin with", "K", io::at_least(1.0)));
    program.choice("--path", o.path,
                   {{"simple-shear", Path::simple_shear, "du/dy = rate"},
                    {"shear-without-spin", Path::shear_without_spin, "du/dy = dv/dx = rate/2"},
                    {"pure-shear", Path::pure_shear, "du/dx = -dv/dy = rate/2"},
                    {"compression", Path::compression, "dv/dy = -rate, held in x and z"}},
                   help("the velocity gradient"));
    program.option("--rate", o.rate, help("rate of the path", "1/s"));
    program.option("--duration", o.duration, help("time of loading", "s"));
    program.option("--gradient-history", o.gradient_history,
                   help("piecewise-constant velocity gradient instead of path, rate and duration: segments "
                        "duration:du/dx:du/dy:dv/dx:dv/dy separated by commas",
                        "s, 1/s"));
    program.option("--tolerance", o.tolerances,
                   {"Time integration",
                    "tolerances, absolute and relative, of the error of a step in sigma/s_Y and the internal variable in its "
                    "natural unit (e_Z/k_B for STZ): each method runs once with each",
                    "", io::between(1e-11, 0.1)});
}

void check(const Options& o) {
    if (o.tolerances.empty())
        throw InputError("--tolerance: give at least one");
}

GradientHistory make_history(const Options& o, const Units& units) {
    GradientHistory history =
        o.gradient_history.empty() ? load_along(o.path, o.rate, o.duration) : parse_gradient_history(o.gradient_history);
    for (auto& [duration, gradient] : history) {
        duration /= units.time;
        for (double* component : {&gradient.ux, &gradient.uy, &gradient.vx, &gradient.vy})
            *component *= units.time;
    }
    return history;
}

State make_start(const Options& o, const Law& law) {
    State start(4, 0.0);
    for (const InternalVariable& variable : law->variables())
        start.push_back(variable.start / variable.natural_unit);
    if (o.material.plasticity == PlasticityChoice::stz) {
        const InternalVariable& temperature = law->variables().front();
        start[4] = o.initial_temperature / temperature.natural_unit;
        if (!temperature.can_start_at(start[4]))
            throw InputError(
                fmt::format("--initial-temperature {:g}: it must be {}", o.initial_temperature, describe_range(temperature)));
    }
    return start;
}

std::string describe(const Options& o, const GradientHistory& history, const Units& units) {
    double duration = 0.0, strain = 0.0;
    for (const Segment& segment : history) {
        duration += segment.duration;
        strain += segment.duration * shear_rate(segment.gradient);
    }
    return fmt::format("material  {}\n"
                       "loading   {} segment{} in {:.5g} s, accumulated shear strain {:.4g}\n",
                       ductile::describe(o.material), history.size(), history.size() == 1 ? "" : "s", duration * units.time,
                       strain);
}

} // namespace ductile::point
