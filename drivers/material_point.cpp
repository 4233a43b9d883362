// SPDX-License-Identifier: GPL-3.0-or-later
// material_point: one point of a material under a prescribed velocity gradient, integrated by every method.
//
// The stress and the internal variable of a point obey a system of ordinary differential equations. The RK2(1) pair that the
// cells of a quasi-static run use (Lu & Rycroft, App. B) is compared with ARKODE and CVODE of SUNDIALS: steps, evaluations of the
// rates, error and time, for a list of tolerances. By default a metallic glass is sheared through yield; this takes less than a
// second:
//
//   ./ductile material_point --path simple-shear --tolerance 1e-4,1e-6,1e-8 --output out/point
#include <ductile/base/timer.hpp>
#include <ductile/io/atomic_file.hpp>
#include <ductile/io/interrupt.hpp>
#include <ductile/io/program.hpp>
#include <ductile/material/make_law.hpp>
#include <ductile/point/comparison.hpp>
#include <ductile/point/options.hpp>

#include <fmt/format.h>

using namespace ductile;
using namespace ductile::point;

int main(int argc, char** argv) {
    return io::run_main([&] {
        // 1. options; a run is too short to be worth checkpoints
        io::Program program("material_point", "One point under a prescribed velocity gradient: RK2(1) beside ARKODE and CVODE.",
                            io::Program::Checkpoints::none);
        Options options;
        declare(program, options);
        if (!program.parse(argc, argv))
            return 0;

        // 2. the problem in natural units: all input is checked before anything is written
        check(options);
        const Units units = natural_units(options.material, Units{}.length);
        const Law law = make_law(options.material, units);
        const GradientHistory history = make_history(options, units);
        const State start = make_start(options, law);
        program.say(describe(options, history, units));

        // 3. run every method with every tolerance, and report
        const auto body = [&](const io::OutputFolder& folder, io::RunSummary& summary) {
            std::vector<Run> runs;
            auto status = io::RunStatus::completed;
            Timer timer;
            program.say(fmt::format("\n{}", table_heading()));
            for (const double tolerance : options.tolerances)
                for (const Method method : all_methods) {
                    if (io::interrupted()) {
                        status = io::RunStatus::interrupted;
                        continue;
                    }
                    runs.push_back(measure(law, history, start, method, tolerance));
                    program.say(table_line(runs.back()));
                    summary.steps += runs.back().trajectory.counts.steps;
                    summary.rejected_steps += runs.back().trajectory.counts.rejected;
                }
            summary.phase_seconds.emplace_back("integration", timer.lap());
            io::write_text_atomically(folder.work_precision(), work_precision_csv(runs));
            io::write_text_atomically(folder.history(), trajectories_csv(law, history, units, runs));
            summary.phase_seconds.emplace_back("output", timer.lap());
            if (!runs.empty())
                summary.drawing = stress_strain_curve(history, units, runs);
            return status;
        };
        return program.run(body, doubts(numbers_of(options.material)));
    });
}
