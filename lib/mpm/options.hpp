// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/program.hpp>
#include <ductile/mpm/run.hpp>
#include <ductile/mpm/scene.hpp>
#include <ductile/mpm/step_control.hpp>
#include <ductile/mpm/time_stepper.hpp>

#include <memory>
#include <string>
#include <vector>

namespace ductile::mpm {

enum class Method { explicit_steps, implicit, midpoint, quasi_static };
enum class FormChoice { velocity, momentum, automatic };
/// By which wave an explicit step is measured.
enum class StableStep {
    dilatation, ///< the fastest: stability_limit()
    bar         ///< sqrt(E/rho) over the smaller side of a cell, the paper's
};
enum class PreconditionerChoice { none, diagonal, tangent, automatic };

/// The options that all material point programs share, in SI. Programs set their own defaults before declare().
struct Options {
    double cell_size = 0.0;
    ShapeFunction shape = ShapeFunction::linear;
    bool affine = false; ///< transfers
    int particles_per_side = 2;

    Method method = Method::implicit;
    FormChoice form = FormChoice::automatic;
    double mu = 1.0;
    std::string dt = "auto", dt_start = "auto"; ///< seconds, or "auto"
    std::string implicit_dt = "auto"; ///< seconds, what auto means for implicit methods; auto: a hundred of the paper's steps
    StableStep stable_step = StableStep::dilatation;
    double safety = 0.48;
    double step_growth = 1.2;
    int many_newton = 30;

    SolverKind solver = SolverKind::newton_gmres;
    PreconditionerChoice preconditioner = PreconditionerChoice::automatic;
    JacobianProduct product = JacobianProduct::analytic;
    double difference_increment = 1e-5;
    LineSearch line_search = LineSearch::energy;
    double newton_tolerance = 1e-6;
    std::string linear_tolerance = "auto"; ///< relative, or "auto" for Eisenstat and Walker's forcing
    int krylov_vectors = 50;
    int newton_iterations = 50;
    ResidualScale residual_scale = ResidualScale::forces;
    bool always_newton = false;

    double duration = 0.0;
    std::vector<double> snapshots = {};
    double snapshots_every = 0.0;
    std::string history_every = "auto"; ///< a whole number, or as help says
    double rows_every = 0.0;
};

/// Declares them all, grouped by topic.
void declare(io::Program& program, Options& options);
/// All but the cell size, where the scene has it.
void declare_on_given_cells(io::Program& program, Options& options);

/// How many cells of --cell-size a length [m] of the scene takes. Throws InputError, naming `what` has that length, unless they
/// are whole, and at least so many.
[[nodiscard]] int cells_along(double length, const Options& options, const std::string& what, int at_least = 1);

/// Where the tolerance of an implicit step, relative to the forces that act in it, is above 1e-3: a bar's plastic strain has been
/// wrong by 18 % with 1e-2, and by 270 % with 1e-1.
[[nodiscard]] std::vector<std::string> solver_warnings(const Options& options);
/// What is doubtful about steps of dt seconds in this state: beyond what keeps the method stable, with the largest frequency
/// w = 2/stability_limit() of the lumped mass M. A mode moves, with g = f dt/M, z = (w dt)^2 and a = 1/(1 + mu z), by
///   v^L = a (v + g),  g <- g - z v^L,  v <- v + m (v^L - v),
/// where m in (0, 1] is the share of consistent to lumped mass, since particles take the nodes' change and hand it back. Its
/// matrix has trace 2 - z a - m + m a and determinant 1 - m + m a - z a (1 - m), and |trace| <= 1 + determinant asks for
/// z <= 4/((2 - m)(1 - 2 mu)): in the worst case, m -> 0 with one particle a cell, for w dt <= sqrt(2/(1 - 2 mu)). In the
/// momentum form strain follows from the v handed back, which makes it z <= 4/(m (1 - 2 mu)): w dt <= 2/sqrt(1 - 2 mu) always
/// suffices. Explicit steps are mu = 0.
[[nodiscard]] std::vector<std::string> step_warnings(const Options& options, const Scene& scene, const State& state, double dt);
/// Sentences where shape functions and particles do not suit each other (figures: verification/README.md):
/// - B-splines with fewer than two particles a cell on the mean: there are motions of nodes that no particle feels, and a sheared
///   block of glass has been wrong by a quarter of its traction;
/// - B-splines and rigid bodies, which hold nodes beyond their surface;
/// - hat functions or GIMP with more than one particle a cell and a Poisson's ratio above 0.48 where the plane keeps its
/// thickness:
///   from there on the pressure locks, before it oscillates so much that the end of the run tells.
[[nodiscard]] std::vector<std::string> resolution_warnings(const Scene& scene, const Particles& particles,
                                                           std::span<const RigidBody> rigid_bodies);

/// The integrator that the options ask for. Throws InputError for combinations that cannot work.
[[nodiscard]] std::unique_ptr<TimeStepper> make_time_stepper(const Options& options, const Scene& scene, const State& start);
[[nodiscard]] StepControl make_step_control(const Options& options, const Scene& scene, const State& start);
/// Throws InputError when this state, that of a checkpoint or the start, is later than the end.
[[nodiscard]] run::Outputs make_outputs(const Options& options, const State& start);

/// The lines before a run: grid, particles, materials, method, step, memory.
[[nodiscard]] std::string describe(const Options& options, const Scene& scene, const State& start, const StepControl& control,
                                   const TimeStepper& stepper);

/// The rest of a program once its options are parsed and its problem is set up: restores the state of --restart, checks all
/// input, runs and reports. Returns the exit status.
[[nodiscard]] int run_program(const io::Program& program, const Options& options, const Problem& problem);

} // namespace ductile::mpm
