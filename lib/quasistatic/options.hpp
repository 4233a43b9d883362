// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/program.hpp>
#include <ductile/quasistatic/initial.hpp>
#include <ductile/quasistatic/scene.hpp>
#include <ductile/quasistatic/schemes.hpp>
#include <ductile/quasistatic/step_control.hpp>
#include <ductile/run/recorder.hpp>
#include <ductile/scene/material_options.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace ductile::quasistatic {

enum class InitialChoice { paper, uniform, gaussian, disc, random, blocks, file };
enum class StepChoice { fixed, adaptive };

/// All options of a quasi-static program, in SI; the defaults are Lu & Rycroft's problem (Sec. 8) on 128 x 128 cells.
struct Options {
    io::CellCount cells{128, 128};
    double width = 0.02, height = 0.02;
    Model model = Model::full;

    MaterialOptions material;

    InitialChoice initial = InitialChoice::paper;
    std::string initial_base = "auto", initial_amplitude = "auto"; ///< in the unit of the internal variable
    double initial_x = 0.0, initial_y = 0.0, initial_length = 0.002;
    int initial_seed = 1;
    double initial_transition = 0.001;
    double initial_stress = 0.0; ///< [Pa]
    std::filesystem::path initial_file = {};

    double wall_velocity = 2e-7 * 0.01 / 4.05e-6; ///< 2e-7 L/t_s
    std::string wall_history;                     ///< replaces wall_velocity unless empty
    std::string shear_traction, normal_traction;  ///< unless empty, force control of that component

    std::string scheme = "auto";            ///< see schemes()
    double accuracy = 0.0;                  ///< see Resolution; 0: cells and tolerance are given
    SpaceOptions space;                     ///< but for the edges of elements:
    std::vector<double> element_edges = {}; ///< y [m], the origin in the middle
    StepChoice step = StepChoice::adaptive;
    std::string dt = "auto"; ///< seconds, or 0.5e4 t_s h/L (Sec. 8.1)
    std::string tolerance = "auto";
    ProjectionSteps projection_steps{.smallest_step = 1e-6 * 4.05e-6, .largest_step = 1e3 * 4.05e-6, .first_step = 10 * 4.05e-6};
    double step_reject = 0.0;
    double pointwise_fixed = 1e-7, pointwise_adaptive = 0.1; ///< F_RK2(1)
    int velocity_passes = 4;

    double duration = 1.4175;
    std::vector<double> snapshots{0.0, 0.46575, 0.9315, 1.4175}; ///< the times of Fig. 2
    double snapshots_every = 0.0;
    std::string snapshot_cells = "auto"; ///< N, MxN, or the space's own
    int history_every = 1;
    double rows_every = 0.0;
};

/// Declares them all, grouped by topic.
void declare(io::Program& program, Options& options);
/// Of these what a scene is on any carrier: domain, material, model, initial internal variable.
void declare_scene(io::Program& program, Options& options);

/// The scene in natural units. Throws InputError for impossible values.
[[nodiscard]] Scene make_scene(const Options& options);
/// Random stress as if the body had been strained unevenly, not in equilibrium yet: s and tau are smooth random fields.
void add_eigenstress(const Options& options, const Scene& scene, const RowSpacing& rows, StressField& stress);
/// For all choices but InitialChoice::file.
[[nodiscard]] Field make_initial_internal(const Options& options, const Scene& scene, const RowSpacing& rows);
/// Fixed steps, or adaptive ones of the kind that the scheme has, in natural units. Throws InputError when --dt or --tolerance is
/// neither "auto" nor a positive number.
[[nodiscard]] StepControl make_step_control(const Options& options, const Scene& scene);
/// --tolerance, or what auto means.
[[nodiscard]] double tolerance(const Options& options);
/// With the elliptic solver of the options.
[[nodiscard]] std::unique_ptr<Space> make_space(const Options& options, const Scene& scene);
/// The scheme.
[[nodiscard]] std::unique_ptr<TimeStepper> make_time_stepper(const Options& options, const Scene& scene,
                                                             std::unique_ptr<Space> space);
/// Throws InputError when `start` (a checkpoint's time in natural units, or 0) is later than the end.
[[nodiscard]] run::Outputs make_outputs(const Options& options, const Scene& scene, double start);

/// The lines before a run: grid, unknowns, material with the physical strain rate, scheme, memory, threads.
[[nodiscard]] std::string describe(const Options& options, const Scene& scene, const TimeStepper& stepper, int threads);

} // namespace ductile::quasistatic
