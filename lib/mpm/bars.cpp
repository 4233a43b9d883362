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
             problem.scene.grid, bar.geometry);
    RigidBody grip = make_rigid_body("grip", rectangle(0.3, 0.1, 0.4, 0.4), options.particles_per_side, problem.scene.grid);
    grip.velocity_x = bar.direction == BarDirection::tension ? -bar.speed : bar.speed;
    problem.start.rigid_bodies.push_back(std::move(grip));

    constexpr double length = 0.3;
    const double rate = (bar.direction == BarDirection::tension ? bar.speed : -bar.speed) / length;
    const auto axial = [](const State& state) -> const aligned_vector<double>& { return state.particles.stress_xx; };
    problem.observables = {
        {"nominal_strain", [rate](const State& state, const TimeStepper&) { return rate * state.time; }},
        {"mean_stress_xx_Pa",
         [axial](const State& state, const TimeStepper&) {
             const auto& stress = axial(state);
             return std::accumulate(stress.begin(), stress.end(), 0.0) / static_cast<double>(stress.size());
         }},
        {"smallest_stress_xx_Pa",
         [axial](const State& state, const TimeStepper&) { return *std::min_element(axial(state).begin(), axial(state).end()); }},
        {"largest_stress_xx_Pa", [axial](const State& state, const TimeStepper&) {
             return *std::max_element(axial(state).begin(), axial(state).end());
         }}};
    problem.curve_x = "nominal_strain";
    problem.curve_y = "mean_stress_xx_Pa";
    problem.label_x = "nominal strain";
    problem.label_y = "mean axial stress [Pa]";
    problem.conclude = [](const io::HistoryTable& history, nlohmann::ordered_json& extra) {
        for (const char* name : {"nominal_strain", "mean_stress_xx_Pa", "smallest_stress_xx_Pa", "largest_stress_xx_Pa"})
            extra[std::string("final_") + name] = history.column(name).back();
    };
    return problem;
}

} // namespace ductile::mpm
