// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/mpm/bars.hpp>

namespace ductile::mpm {

void declare(io::Program& program, BarOptions& bar) {
    declare_parameters(program, bar.material, "Bar");
    program.option("--speed", bar.speed, {"Bar", "speed of the rigid body", "m/s", io::positive});
    program.choice("--direction", bar.direction, {{"tension", BarDirection::tension}, {"compression", BarDirection::compression}},
                   {"Bar", "whether the rigid body pulls or pushes"});
    program.choice("--geometry", bar.geometry,
                   {{"plane-strain", Geometry::plane_strain}, {"plane-stress", Geometry::plane_stress}},
                   {"Bar", "what holds across the plane"});
}

Setup make_bar(const BarOptions& bar, const Options& options) {
    (void)cells_along(0.1, options, "a third of the bar");
    const double speed = bar.direction == BarDirection::tension ? bar.speed : -bar.speed;
    constexpr double length = 0.3;
    const auto stress = [](const char* name, Setup::Take take) {
        return Setup::Measure{.name = name, .quantity = "stress-xx", .take = take};
    };
    return {.grid = {.geometry = bar.geometry, .width = 0.7, .height = 0.5},
            .sides = {.right = SideCondition::fixed},
            .materials = {bar.material},
            .bodies = {{.name = "bar", .material = bar.material.name, .shape = rectangle(0.4, 0.1, 0.7, 0.4)}},
            .rigid_bodies = {{.name = "grip", .shape = rectangle(0.3, 0.1, 0.4, 0.4), .velocity = Velocity{-speed, 0.0}}},
            .observables = {{.name = "nominal_strain", .quantity = "time", .factor = speed / length},
                            stress("mean_stress_xx_Pa", Setup::Take::mean),
                            stress("smallest_stress_xx_Pa", Setup::Take::smallest),
                            stress("largest_stress_xx_Pa", Setup::Take::largest)},
            .curve = {"nominal_strain", "mean_stress_xx_Pa", "nominal strain", "mean axial stress [Pa]"}};
}

} // namespace ductile::mpm
