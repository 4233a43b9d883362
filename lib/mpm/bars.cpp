#include <ductile/mpm/bars.hpp>

#include <algorithm>
#include <numeric>

namespace ductile::mpm {

void declare(io::Program& program, BarOptions& bar) {
    const auto help = [](std::string meaning, std::string units = {}, io::Limits allowed = io::positive) {
        return io::OptionHelp{"Bar", std::move(meaning), std::move(units), allowed};
    };
    program.option("--young-modulus", bar.young_modulus, help("Young's modulus E", "Pa"));
    program.option("--poisson-ratio", bar.poisson_ratio, help("Poisson's ratio nu", "", io::strictly_between(-1.0, 0.5)));
    program.option("--density", bar.density, help("density", "kg/m^3"));
    program.option("--speed", bar.speed, help("speed of the rigid body", "m/s"));
    program.choice("--direction", bar.direction, {{"tension", BarDirection::tension}, {"compression", BarDirection::compression}},
                   help("whether the rigid body pulls or pushes"));
    program.choice("--geometry", bar.geometry,
                   {{"plane-strain", Geometry::plane_strain}, {"plane-stress", Geometry::plane_stress}},
                   help("what holds across the plane"));
}

Problem make_bar(const BarOptions& bar, const Options& options, const Material& material) {
    const int n = cells_along(0.1, options, "a third of the bar");
    Problem problem;
    problem.scene = {
        .geometry = bar.geometry,
        .grid = {.cells_x = 7 * n, .cells_y = 5 * n, .width = 0.7, .height = 0.5, .sides = {.right = SideCondition::fixed}},
        .shape = options.shape,
        .materials = {material}};
    add_body(problem.start.particles,
             {.shape = rectangle(0.4, 0.1, 0.7, 0.4), .density = bar.density, .particles_per_side = options.particles_per_side},
             problem.scene);
    RigidBody grip = make_rigid_body("grip", rectangle(0.3, 0.1, 0.4, 0.4), options.particles_per_side, problem.scene.grid);
    grip.velocity = Velocity{bar.direction == BarDirection::tension ? -bar.speed : bar.speed, 0.0};
    problem.start.rigid_bodies.push_back(std::move(grip));

    constexpr double length = 0.3;
    const double rate = (bar.direction == BarDirection::tension ? bar.speed : -bar.speed) / length;
    const auto axial = [](const Observation& seen) -> const aligned_vector<double>& { return seen.state.particles.stress_xx; };
    problem.observables = {
        {"nominal_strain", [rate](const Observation& seen) { return rate * seen.state.time; }},
        {"mean_stress_xx_Pa",
         [axial](const Observation& seen) {
             const auto& stress = axial(seen);
             return std::accumulate(stress.begin(), stress.end(), 0.0) / static_cast<double>(stress.size());
         }},
        {"smallest_stress_xx_Pa", [axial](const Observation& seen) { return *std::ranges::min_element(axial(seen)); }},
        {"largest_stress_xx_Pa", [axial](const Observation& seen) { return *std::ranges::max_element(axial(seen)); }}};
    problem.curve_x = "nominal_strain";
    problem.curve_y = "mean_stress_xx_Pa";
    problem.label_x = "nominal strain";
    problem.label_y = "mean axial stress [Pa]";
    problem.conclusions.conclude = [all = problem.observables](const Observation& seen, const Tally&,
                                                               nlohmann::ordered_json& extra) {
        for (const Observable& observable : all)
            extra["final_" + observable.name] = observable.value(seen);
    };
    return problem;
}

} // namespace ductile::mpm
