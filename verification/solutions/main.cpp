// SPDX-License-Identifier: GPL-3.0-or-later
// solutions: the material point method on problems with known solutions, for verification/solutions.py.
//
//   build/release/solutions CASE FOLDER
//
// CASE is manufactured, vortex, cylinder, column, elastica or cook; its tables go into FOLDER.
#include "cases.hpp"

#include <ductile/base/error.hpp>
#include <ductile/base/threads.hpp>
#include <ductile/io/program.hpp>

#include <map>

namespace solutions {

Table::Table(const std::filesystem::path& file, const std::string& header) : file_(file), stream_(file) { write(header); }

void Table::write(const std::string& line) {
    stream_ << line << '\n' << std::flush;
    if (!stream_)
        throw RunError(fmt::format("{} cannot be written", file_.string()));
}

void advance(TimeStepper& stepper, State& state, double end, int steps, const std::function<void()>& after) {
    const double dt = (end - state.time) / steps;
    for (int n = 0; n < steps; ++n) {
        const StepOutcome outcome = stepper.attempt(state, dt, state.time + dt);
        if (!outcome.accepted)
            throw RunError(fmt::format("step {} at t = {:.6g} s: {}", state.step + 1, state.time, outcome.reason));
        if (after)
            after();
    }
}

std::unique_ptr<TimeStepper> quasi_static_stepper(const Scene& scene, double tolerance) {
    ImplicitOptions options{.scheme = {.method = ImplicitMethod::quasi_static}, .preconditioner = PreconditionerKind::tangent};
    options.newton.tolerance = tolerance;
    return make_implicit_stepper(scene, options);
}

int crossed(const Grid& grid, const Particles& p, const Places& start) {
    int count = 0;
    const auto differ = [](double a, double b, double cell) { return std::floor(a / cell) != std::floor(b / cell); };
    for (std::size_t i = 0; i < p.size(); ++i) {
        const auto q = static_cast<std::size_t>(p.id[i]);
        count += differ(p.x[i] - grid.left, start.x[q] - grid.left, grid.dx()) ||
                         differ(p.y[i] - grid.bottom, start.y[q] - grid.bottom, grid.dy())
                     ? 1
                     : 0;
    }
    return count;
}

} // namespace solutions

int main(int argc, char** argv) {
    return ductile::io::run_main([&] {
        ductile::set_thread_count(1); // rows of tables are written while sums over particles run
        const std::map<std::string, void (*)(const std::filesystem::path&)> cases{
            {"manufactured", solutions::manufactured}, {"vortex", solutions::vortex},
            {"cylinder", solutions::cylinder},         {"column", solutions::column},
            {"elastica", solutions::elastica},         {"cook", solutions::cook}};
        const auto found = argc == 3 ? cases.find(argv[1]) : cases.end();
        if (found == cases.end())
            throw ductile::InputError("two arguments are needed, a case (manufactured, vortex, cylinder, column, elastica or "
                                      "cook) and a folder for its tables");
        found->second(argv[2]);
        return 0;
    });
}
