// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/quasistatic/doubts.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numeric>

namespace ductile::quasistatic {

namespace {

/// The longer side of a cell over the shorter one.
double aspect_of(const Grid& grid) { return std::max(grid.dx() / grid.dy(), grid.dy() / grid.dx()); }

} // namespace

double largest_wall_speed(const Options& o, const Scene& scene) {
    const IsotropicElasticity& c = scene.law->elasticity();
    const auto largest = [&](const WallControl& control, double modulus) {
        double speed = 0.0;
        for (const auto& knot : control.history.knots())
            if (knot.time * scene.units.time <= o.duration)
                speed = std::max(speed, std::abs(control.by == WallControl::By::velocity
                                                     ? knot.value
                                                     : control.history.slope(knot.time) * 0.5 * scene.grid.height / modulus));
        return speed;
    };
    return std::hypot(largest(scene.walls.shear, c.shear_modulus), largest(scene.walls.opening, c.alpha())) *
           scene.units.velocity();
}

double assumed_density() {
    const Units paper;
    const double slowness = paper.time / paper.length;
    return MaterialOptions{}.elasticity.shear_modulus * slowness * slowness;
}

double shear_wave_speed(const Scene& scene) {
    return std::sqrt(scene.law->elasticity().shear_modulus * scene.units.stress / assumed_density());
}

double inertial_wall_speed(const Scene& scene) { return 0.05 * shear_wave_speed(scene) / scene.law->elasticity().shear_modulus; }

void check_meaning(const Options& o, const Scene& scene) {
    const double wall = largest_wall_speed(o, scene), waves = shear_wave_speed(scene);
    if (!(wall < waves))
        throw InputError(
            fmt::format("the walls move at {:.4g} m/s, and shear waves at {:.4g} m/s (at {:.4g} kg/m^3): equilibrium "
                        "has no meaning there; lower --wall-velocity or --wall-history, or load more slowly",
                        wall, waves, assumed_density()));
    if (!(aspect_of(scene.grid) < 1e6))
        throw InputError(
            fmt::format("cells are {:.4g} x {:.4g} m, {:.3g} times as long one way as the other: check --width, --height "
                        "and --cells",
                        o.width / o.cells.x, o.height / o.cells.y, aspect_of(scene.grid)));
    std::vector<double> start;
    for (const InternalVariable& variable : scene.law->variables())
        start.push_back(variable.start / variable.natural_unit);
    const FlowAt flow = scene.law->flow_at(1.01, start); // in units of the yield stress
    const IsotropicElasticity& elasticity = scene.law->elasticity();
    const double sum = std::accumulate(flow.internal_rates.begin(), flow.internal_rates.end(),
                                       flow.fluidity + flow.slope + elasticity.bulk_modulus + elasticity.shear_modulus);
    if (!std::isfinite(sum) || !std::isfinite(scene.grid.cell_area()) || !(scene.grid.cell_area() > 0.0))
        throw InputError(
            fmt::format("the scene's numbers overflow (rates of the material 1 % above yield, moduli in units of the "
                        "yield stress, cells in units of the height): check the units of the material ({}) and the "
                        "domain ({:g} x {:g} m)",
                        describe(o.material), o.width, o.height));
}

std::vector<std::string> doubts(const Options& o, const Scene& scene, const Observables& start) {
    std::vector<std::string> found = ductile::doubts(numbers_of(o.material));
    if (aspect_of(scene.grid) > 10.0)
        found.push_back(
            fmt::format("cells are {:.4g} x {:.4g} m, {:.3g} times as long one way as the other: bands are resolved by "
                        "the longer side only; choose --cells MxN in the ratio of --width and --height",
                        o.width / o.cells.x, o.height / o.cells.y, aspect_of(scene.grid)));
    if (o.material.plasticity == PlasticityChoice::stz) {
        const double lowest = start.smallest_internal[0] * scene.units.temperature;
        if (lowest < o.material.stz.bath_temperature)
            found.push_back(fmt::format("the effective temperature starts at {:.4g} K, below the bath's {:.4g} K, and a glass "
                                        "freezes in above it: check the initial field and --stz-bath-temperature",
                                        lowest, o.material.stz.bath_temperature));
        if (o.material.stz.bath_temperature >= o.material.stz.steady_temperature)
            found.push_back(
                fmt::format("the bath has {:.4g} K, and the steady effective temperature is {:.4g} K: this is a melt, "
                            "which the law does not describe; check --stz-bath-temperature",
                            o.material.stz.bath_temperature, o.material.stz.steady_temperature));
    }
    if (const Scheme& scheme = scheme_named(o.scheme); scheme.kind != SchemeKind::projection && o.step == StepChoice::adaptive) {
        constexpr double round_off = 1.0 - 1e-9, jumping = 1e-5;
        if (o.space.advection == Advection::eno2 && scene.model == Model::full && tolerance(o) < jumping * round_off)
            found.push_back(
                fmt::format("a tolerance of {:.3g} is not kept with --advection eno2, whose differences jump from stencil "
                            "to stencil (errors of up to 20 times 1e-6 and 70 times 1e-7 were measured): take --advection "
                            "weno3, or a tolerance of {:g} at least",
                            tolerance(o), jumping));
        else if (tolerance(o) < scheme.kept_tolerance * round_off)
            found.push_back(
                fmt::format("a tolerance of {:.3g} may not be kept by {}, which was measured to miss tolerances below {:g} "
                            "by 12 to 44 times: take --scheme auto",
                            tolerance(o), scheme.name, scheme.kept_tolerance));
    }
    const double wall = largest_wall_speed(o, scene);
    const double to_yield = 0.5 * o.height / wall * o.material.yield_stress / o.material.elasticity.shear_modulus;
    const double passage = o.height / shear_wave_speed(scene);
    if (wall > inertial_wall_speed(scene))
        found.push_back(
            fmt::format("walls at {:.4g} m/s load to yield in {:.3g} s, {:.3g} times the {:.3g} s that shear waves take "
                        "from wall to wall (at {:.4g} kg/m^3): inertia, which is left out here, counts; lower the "
                        "velocity of the walls",
                        wall, to_yield, to_yield / passage, passage, assumed_density()));
    return found;
}

} // namespace ductile::quasistatic
