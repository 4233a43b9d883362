// SPDX-License-Identifier: GPL-3.0-or-later
// scene: runs any scene that a file describes, on a grid that stays or of material points; a scene of the grid, on either.
//
// drivers/scenes has those of both papers and variants of them, each headed by what to look at and how long it takes;
// --print-config of every other program prints one. Options on the command line go before the file:
//
//   ./ductile scene drivers/scenes/upsetting.toml --dt 5e-5 --output out/finer
#include <ductile/io/scene_file.hpp>
#include <ductile/mpm/setup.hpp>
#include <ductile/quasistatic/points.hpp>
#include <ductile/quasistatic/program.hpp>

using namespace ductile;

int main(int argc, char** argv) {
    return io::run_main([&] {
        const io::SceneCall call = io::scene_call(argc, argv);
        const auto parse = [&](io::Program& program, io::Program::Visit visit) {
            program.reads_scene(call.carrier, std::move(visit), call.file);
            return program.parse(static_cast<int>(call.arguments.size()), call.arguments.data());
        };
        if (call.carrier == "grid") {
            io::Program program("scene", "A scene on a grid that stays (quasi-static).");
            quasistatic::Options options;
            declare(program, options);
            return parse(program, {}) ? run_program(program, options) : 0;
        }
        if (!call.has_tables) {
            io::Program program("scene", "A scene of the carrier grid, on material points.");
            quasistatic::PointsOptions options;
            declare(program, options);
            return parse(program, {}) ? run_program(program, options.points, make_problem(options)) : 0;
        }
        io::Program program(
            "scene", "A scene of material points: scene FILE [options]. With a file of the carrier grid --help has others.");
        mpm::Options options;
        mpm::Setup setup;
        declare(program, options);
        const bool run = parse(program, [&](io::Tables& tables) { visit(tables, setup); });
        return run ? run_program(program, options, make_problem(setup, options)) : 0;
    });
}
