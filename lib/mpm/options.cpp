// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/output_times.hpp>
#include <ductile/mpm/checkpoint.hpp>
#include <ductile/mpm/options.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <iterator>
#include <set>
#include <utility>

namespace ductile::mpm {

namespace {

void declare_domain(io::Program& program, Options& o) {
    const auto help = [](std::string meaning, std::string units = {}, io::Limits allowed = io::positive) {
        return io::OptionHelp{"Space", std::move(meaning), std::move(units), allowed};
    };
    program.choice("--shape", o.shape,
                   {{"linear", ShapeFunction::linear, "hats, the paper's; their gradients jump at the edges of cells"},
                    {"gimp", ShapeFunction::gimp, "hats averaged over a particle's box (generalised interpolation)"},
                    {"bspline", ShapeFunction::bspline, "quadratic B-splines"}},
                   help("shape functions"));
    program.choice("--transfer", o.affine,
                   {{"increments", false, "particles get the nodes' change of velocity, the paper's"},
                    {"affine", true, "they take the nodes' velocity and its gradient: turns, and is quiet; loses what is finer"}},
                   help("between particles and nodes"));
    program.option("--particles-per-side", o.particles_per_side, help("particles along a cell's side", "", io::between(1, 100)));
}

void declare_time(io::Program& program, Options& o) {
    const auto help = [](std::string meaning, std::string units = {}, io::Limits allowed = io::positive) {
        return io::OptionHelp{"Time integration", std::move(meaning), std::move(units), allowed, io::Restart::may_change};
    };
    program.choice("--method", o.method,
                   {{"explicit", Method::explicit_steps, "forces at the beginning of a step; short steps"},
                    {"implicit", Method::implicit, "forces at its end, or with the weight --mu; damps what oscillates"},
                    {"midpoint", Method::midpoint, "in its middle; keeps energy"},
                    {"quasi-static", Method::quasi_static, "without inertia"}},
                   help("how a step is made"));
    program.choice(
        "--form", o.form,
        {{"velocity", FormChoice::velocity},
         {"momentum", FormChoice::momentum, "bears particles that have just entered a cell in explicit steps"},
         {"auto", FormChoice::automatic, "momentum for --method explicit, but velocity for others and for --transfer affine"}},
        help("the nodal unknown of the equations"));
    program.option("--mu", o.mu,
                   help("weight of the force at the end of the step, --method implicit", "", io::between(0.0, 1.0)));
    program.number_or_auto("--dt", o.dt,
                           help("step, auto: a stable one for --method explicit, otherwise --implicit-dt", "s", io::positive));
    program.number_or_auto(
        "--implicit-dt", o.implicit_dt,
        help("what auto means for other methods, auto: a hundred times --safety times the cell size over sqrt(E/rho)", "s",
             io::positive));
    program.number_or_auto("--dt-start", o.dt_start, help("first step, auto: --dt", "s", io::positive));
    program.option("--step-growth", o.step_growth, help("largest growth from step to step", "", io::at_least(1.0)));
    program.option("--many-newton", o.many_newton,
                   help("Newton iterations of a step above which the next one is 0.7 times as long", "", io::at_least(1)));
    program.choice("--stable-step", o.stable_step,
                   {{"dilatation", StableStep::dilatation, "1/(c sqrt(1/dx^2 + 1/dy^2)) with the speed c of the fastest wave"},
                    {"bar", StableStep::bar, "the paper's, the cell size over sqrt(E/rho)"}},
                   help("measure of --dt auto for --method explicit"));
    program.option("--safety", o.safety, help("an explicit step is this times its measure"));
}

void declare_solver(io::Program& program, Options& o) {
    const auto help = [](std::string meaning, std::string units = {}, io::Limits allowed = io::positive) {
        return io::OptionHelp{"Solver of implicit steps", std::move(meaning), std::move(units), allowed, io::Restart::may_change};
    };
    program.choice("--solver", o.solver,
                   {{"newton-cg", SolverKind::newton_cg, "of this library; for symmetric tangents"},
                    {"newton-gmres", SolverKind::newton_gmres, "of this library"},
                    {"kinsol-gmres", SolverKind::kinsol_gmres, "of SUNDIALS, and so are the next"},
                    {"kinsol-fgmres", SolverKind::kinsol_fgmres},
                    {"kinsol-bicgstab", SolverKind::kinsol_bicgstab},
                    {"kinsol-cg", SolverKind::kinsol_cg}},
                   help("Newton's method with a Krylov solver"));
    program.choice(
        "--preconditioner", o.preconditioner,
        {{"none", PreconditionerChoice::none},
         {"diagonal", PreconditionerChoice::diagonal, "of the Jacobian"},
         {"tangent", PreconditionerChoice::tangent, "factorised"},
         {"auto", PreconditionerChoice::automatic,
          "tangent for long steps, the sooner the fewer unknowns and the nearer Poisson's ratio to 0.5, diagonal below"}},
        help("of the linear solver"));
    program.choice("--jacobian", o.product,
                   {{"analytic", JacobianProduct::analytic, "with the consistent tangent"},
                    {"difference", JacobianProduct::difference, "difference quotients (2.4.18)"}},
                   help("products with the Jacobian"));
    program.option("--difference-increment", o.difference_increment, help("h of the difference quotients"));
    program.choice("--line-search", o.line_search,
                   {{"none", LineSearch::none},
                    {"residual", LineSearch::residual, "on its norm"},
                    {"energy", LineSearch::energy, "on the energy"}},
                   help("of the newton solvers"));
    program.option("--newton-tolerance", o.newton_tolerance, help("on the residual's 2-norm over its scale"));
    program.number_or_auto("--linear-tolerance", o.linear_tolerance,
                           help("relative to the Newton residual, auto: Eisenstat and Walker's forcing", "", io::positive));
    program.option("--krylov-vectors", o.krylov_vectors,
                   help("linear iterations of a Newton step at most", "", io::between(1, 10'000)));
    program.option("--newton-iterations", o.newton_iterations, help("of a step at most", "", io::between(1, 100'000)));
    program.choice("--residual-scale", o.residual_scale,
                   {{"forces", ResidualScale::forces, "the impulses of the forces that act in the step"},
                    {"stiffness", ResidualScale::stiffness, "E dx dy dt, whatever the load, as in the paper"},
                    {"stiffness-rms", ResidualScale::stiffness_rms, "that times the root of the number of unknowns"},
                    {"none", ResidualScale::none, "nothing"}},
                   help("what the residual's 2-norm is divided by"));
    program.option("--always-newton", o.always_newton, help("Newton's loop for linear scenes, too, which need one linear solve"));
}

void declare_run(io::Program& program, Options& o) {
    const auto help = [](std::string meaning, std::string units = {}, io::Limits allowed = io::positive) {
        return io::OptionHelp{"Run", std::move(meaning), std::move(units), allowed, io::Restart::may_change};
    };
    program.option("--duration", o.duration, help("the end of the run; a step ends there", "s"));
    program.option(
        "--snapshots", o.snapshots,
        help("times of the snapshots in fields.h5: t1,t2,...; where none are given, the end is one", "s", io::not_negative));
    program.option("--snapshots-every", o.snapshots_every,
                   help("snapshots at the times 0, T, 2 T, ... besides; 0: none", "s", io::not_negative));
    program.number_or_auto(
        "--history-every", o.history_every,
        help("rows of history.csv: the start, every n-th step, and the end; auto: every step, or with --method "
             "explicit, whose steps are cheaper than rows, every 20th",
             "", io::at_least(1)));
    program.option(
        "--rows-every", o.rows_every,
        help("rows of history.csv at the times 0, T, 2 T, ... instead, wherever steps end; 0: at steps", "s", io::not_negative));
}

double number_or_auto(const std::string& text, const char* option, double automatic) {
    if (text == "auto")
        return automatic;
    try {
        return io::parse_number(text, io::positive);
    } catch (const InputError& error) {
        throw InputError(fmt::format("{} {}: {}; or auto", option, text, error.what()));
    }
}

Form form_of(const Options& o) {
    if (o.form == FormChoice::automatic)
        return o.method == Method::explicit_steps && !o.affine ? Form::momentum : Form::velocity;
    return o.form == FormChoice::velocity ? Form::velocity : Form::momentum;
}

double target_step(const Options& o, const Scene& scene, const State& start) {
    const double bar = explicit_step_size(scene, start.particles, o.safety);
    double automatic = number_or_auto(o.implicit_dt, "--implicit-dt", 100.0 * bar);
    if (o.method == Method::explicit_steps)
        automatic = o.stable_step == StableStep::bar ? bar : o.safety * stability_limit(scene, start.particles);
    return number_or_auto(o.dt, "--dt", automatic);
}

/// Of the materials that a nearly incompressible one makes stiff: none in plane stress.
double largest_poisson_ratio(const Scene& scene) {
    double largest = 0.0;
    for (const Material& material : scene.materials) {
        const IsotropicElasticity& e = material.law->elasticity();
        largest = std::max(largest, 0.5 * e.beta() / (e.beta() + e.shear_modulus));
    }
    return scene.geometry == Geometry::plane_stress ? 0.0 : largest;
}

/// One factorisation a step costs less than the iterations it saves from about sqrt(n)/9 stable explicit steps on for n unknowns,
/// sooner near incompressibility, where iterations become many, and later in the momentum form, which has twice the unknowns to
/// factorise. Measured with von Mises plasticity, n from 32 to 18,800.
PreconditionerKind preconditioner_kind(const Options& o, const Scene& scene, const State& start, double dt, double stable) {
    switch (o.preconditioner) {
    case PreconditionerChoice::none:
        return PreconditionerKind::none;
    case PreconditionerChoice::diagonal:
        return PreconditionerKind::diagonal;
    case PreconditionerChoice::tangent:
        return PreconditionerKind::tangent;
    case PreconditionerChoice::automatic:
        break;
    }
    const double cells = static_cast<double>(start.particles.size()) / (o.particles_per_side * o.particles_per_side);
    const double compressibility = std::sqrt((1.0 - 2.0 * largest_poisson_ratio(scene)) / 0.4); // 1 for 0.3
    const double worth = std::sqrt(2.0 * cells) / 9.0 * compressibility * (form_of(o) == Form::momentum ? 4.0 : 1.0);
    return dt >= worth * stable ? PreconditionerKind::tangent : PreconditionerKind::diagonal;
}

/// Throws InputError for a rigid body that would take more steps than a machine can make.
void check_rigid_travel(const Scene& scene, const State& state, double end) {
    for (const RigidBody& body : state.rigid_bodies) {
        const double speed = body.velocity.largest(
            [](const Velocity& velocity) { return std::max(std::abs(velocity.u), std::abs(velocity.v)); }, state.time);
        const double spin = body.spin.largest([](double value) { return std::abs(value); }, state.time);
        const double cells = (speed + reach_of(body) * spin) * (end - state.time) / scene.grid.smallest_spacing();
        if (cells > 1e9)
            throw InputError(
                fmt::format("the rigid body '{}' would cross {:.3g} cells of the grid in the run, one or less a step: its "
                            "speed of {:.3g} m/s or the duration of {:.3g} s is out of all proportion",
                            body.name, cells, speed, end));
    }
}

const char* name_of(Method method) {
    const char* names[] = {"explicit", "implicit", "implicit midpoint", "quasi-static"};
    return names[static_cast<int>(method)];
}

} // namespace

void declare(io::Program& program, Options& options) {
    program.option("--cell-size", options.cell_size,
                   {"Space", "side of the square cells of the background grid", "m", io::positive});
    declare_on_given_cells(program, options);
}

void declare_on_given_cells(io::Program& program, Options& options) {
    declare_domain(program, options);
    declare_time(program, options);
    declare_solver(program, options);
    declare_run(program, options);
}

int cells_along(double length, const Options& options, const std::string& what, int at_least) {
    const double cells = length / options.cell_size;
    if (!(std::abs(cells - std::round(cells)) <= 1e-9) || cells < at_least - 0.5)
        throw InputError(
            fmt::format("--cell-size {}: it must divide {}, {:g} m, into {} or more", options.cell_size, what, length, at_least));
    if (cells > most_cells)
        throw InputError(fmt::format("--cell-size {}: it would divide {}, {:g} m, into {:.3g}: {} cells are possible at most",
                                     options.cell_size, what, length, cells, most_cells));
    return static_cast<int>(std::round(cells));
}

std::vector<std::string> step_warnings(const Options& o, const Scene& scene, const State& state, double dt) {
    const bool is_explicit = o.method == Method::explicit_steps;
    if (!is_explicit && !(o.method == Method::implicit && o.mu < 0.5))
        return {};
    const double weight = is_explicit ? 0.0 : o.mu;
    const double form = form_of(o) == Form::velocity ? 0.5 : 1.0;
    const double limit = stability_limit(scene, state.particles) * std::sqrt(form / (1.0 - 2.0 * weight));
    if (!(dt > limit))
        return {};
    return {is_explicit ? fmt::format("--dt is {:.4g} s, {:.3g} times the {:.4g} s up to which --method explicit is stable in "
                                      "cells full of particles: "
                                      "the energy may grow without bound; choose --dt auto or a smaller number",
                                      dt, dt / limit, limit)
                        : fmt::format("--dt is {:.4g} s, {:.3g} times the {:.4g} s up to which --mu {:g} is stable in cells full "
                                      "of particles: the energy "
                                      "may grow without bound; choose a smaller --dt, or --mu 0.5 or more, stable for any step",
                                      dt, dt / limit, limit, o.mu)};
}

std::vector<std::string> solver_warnings(const Options& o) {
    if (o.method == Method::explicit_steps || o.residual_scale != ResidualScale::forces || !(o.newton_tolerance > 1e-3))
        return {};
    return {
        fmt::format("--newton-tolerance is {:g}: a step may end with forces out of balance by that part of those that act, and "
                    "what is left adds up to more in stresses; choose 1e-4 or smaller",
                    o.newton_tolerance)};
}

std::vector<std::string> resolution_warnings(const Scene& scene, const Particles& particles,
                                             std::span<const RigidBody> rigid_bodies) {
    std::set<std::pair<int, int>> cells;
    for (std::size_t p = 0; p < particles.size(); ++p)
        cells.emplace(static_cast<int>((particles.x[p] - scene.grid.left) / scene.grid.dx()),
                      static_cast<int>((particles.y[p] - scene.grid.bottom) / scene.grid.dy()));
    const double mean = static_cast<double>(particles.size()) / static_cast<double>(cells.size());
    std::vector<std::string> found;
    if (scene.shape == ShapeFunction::bspline) {
        if (mean < 2.0)
            found.push_back(
                fmt::format("there are {:.3g} particles a cell: B-splines then have motions of nodes that no particle feels, and "
                            "stresses may mean nothing; take 2 x 2 a cell, or --shape gimp",
                            mean));
        const auto holding = std::ranges::find_if(rigid_bodies, [](const RigidBody& body) { return !body.surface; });
        if (holding != rigid_bodies.end())
            found.push_back(
                fmt::format("with B-splines a rigid body ('{}') holds nodes half a cell beyond its surface: it acts that "
                            "much early, and stresses in the row of cells beside it are off by up to their own size, on "
                            "any mesh; take --shape gimp if they matter",
                            holding->name));
        return found;
    }
    if (scene.geometry == Geometry::plane_stress || mean < 1.5)
        return found;
    double largest = 0.0;
    for (const Material& material : scene.materials)
        largest = std::max(largest, poisson_ratio(material.law->elasticity()));
    if (largest > 0.48)
        found.push_back(
            fmt::format("Poisson's ratio is {:.4g} and there are {:.3g} particles a cell: with --shape linear or gimp the "
                        "particles lock, a block of 8 x 4 cells under its weight gives way by 12 % too little at 0.49 "
                        "and 21 % at 0.499; take B-splines, or one particle a cell while strains are small",
                        largest, mean));
    return found;
}

std::unique_ptr<TimeStepper> make_time_stepper(const Options& o, const Scene& scene, const State& start) {
    if (o.method == Method::explicit_steps)
        return make_explicit_stepper(scene, form_of(o));
    const ImplicitMethod method = o.method == Method::implicit   ? ImplicitMethod::paper
                                  : o.method == Method::midpoint ? ImplicitMethod::midpoint
                                                                 : ImplicitMethod::quasi_static;
    const bool forcing = o.linear_tolerance == "auto";
    const NewtonOptions newton{.product = o.product,
                               .line_search = o.line_search,
                               .tolerance = o.newton_tolerance,
                               .linear_tolerance = number_or_auto(o.linear_tolerance, "--linear-tolerance", 0.1),
                               .eisenstat_walker = forcing,
                               .difference_increment = o.difference_increment,
                               .largest_newton_iterations = o.newton_iterations,
                               .largest_linear_iterations = o.krylov_vectors};
    if (o.solver == SolverKind::newton_cg || o.solver == SolverKind::kinsol_cg) {
        const auto rubs = std::ranges::find_if(start.rigid_bodies, [](const RigidBody& body) { return body.friction > 0.0; });
        const bool bodies_rub = !scene.friction_of_body.empty();
        const auto presses =
            std::ranges::find_if(scene.loads, [](const Load& load) { return load.pressure != History<double>(); });
        if (bodies_rub || rubs != start.rigid_bodies.end() || presses != scene.loads.end())
            throw InputError(
                fmt::format("conjugate gradients need a symmetric Jacobian, and {} makes it unsymmetric: choose --solver "
                            "newton-gmres",
                            bodies_rub                         ? "friction between bodies"
                            : rubs != start.rigid_bodies.end() ? fmt::format("the friction of '{}'", rubs->name)
                                                               : fmt::format("the pressure of the load '{}'", presses->name)));
    }
    const double stable = explicit_step_size(scene, start.particles, o.safety);
    return make_implicit_stepper(scene,
                                 {.scheme = {.method = method, .form = form_of(o), .mu = o.mu},
                                  .solver = o.solver,
                                  .newton = newton,
                                  .preconditioner = preconditioner_kind(o, scene, start, target_step(o, scene, start), stable),
                                  .scale = o.residual_scale,
                                  .always_newton = o.always_newton});
}

StepControl make_step_control(const Options& o, const Scene& scene, const State& start) {
    const double target = target_step(o, scene, start);
    const double first = number_or_auto(o.dt_start, "--dt-start", target);
    if (first > target)
        throw InputError(fmt::format("--dt-start {}: the first step must not be longer than --dt, {} s", o.dt_start, target));
    const double time = o.duration - start.time;
    const double ramp = first < target ? std::min(time / first, std::log(target / first) / std::log(o.step_growth)) : 0.0;
    if (const double steps = std::max(time / target, ramp); !(steps < 1e9))
        throw InputError(
            fmt::format("the run to {:g} s with --dt {:g} s, from --dt-start {:g} s on, would take {:.3g} steps, which no "
                        "machine ends: take longer ones (for --dt auto another --safety or material), or a shorter "
                        "--duration",
                        o.duration, target, first, steps));
    check_rigid_travel(scene, start, o.duration);
    return StepControl({.target = target,
                        .first = first,
                        .growth = o.step_growth,
                        .grid = scene.grid,
                        .ends_at_contact = o.method != Method::explicit_steps,
                        .boxes = scene.shape == ShapeFunction::gimp,
                        // smooth shape functions rise with the square of the way
                        .landing = scene.shape == ShapeFunction::linear ? 1e-9 : 1e-5,
                        .many_newton_iterations = o.many_newton});
}

namespace {

int rows_every_nth_step(const Options& o) {
    const double steps = number_or_auto(o.history_every, "--history-every", o.method == Method::explicit_steps ? 20.0 : 1.0);
    if (steps != std::floor(steps) || steps > 1e9)
        throw InputError(fmt::format("--history-every {}: it must be a whole number, from 1 to 1e9, or auto", o.history_every));
    return static_cast<int>(steps);
}

} // namespace

run::Outputs make_outputs(const Options& o, const State& start) {
    if (!(o.duration >= start.time))
        throw InputError(
            fmt::format("--duration {}: the checkpoint is at t = {:.6g} s already: a longer --duration goes on from there",
                        o.duration, start.time));
    return {.duration_s = o.duration,
            .snapshots_s = io::regular_times("--snapshots-every", o.snapshots, o.snapshots_every, o.duration),
            .rows_s = io::regular_times("--rows-every", {}, o.rows_every, o.duration),
            .history_every = rows_every_nth_step(o)};
}

std::string describe(const Options& o, const Scene& scene, const State& start, const StepControl& control,
                     const TimeStepper& stepper) {
    const char* geometries[] = {"plane strain", "plane stress", "axisymmetric"};
    const char* shapes[] = {"linear", "GIMP", "quadratic B-spline"};
    const double stable = stability_limit(scene, start.particles);
    std::size_t rigid = 0;
    for (const RigidBody& body : start.rigid_bodies)
        rigid += body.x.size();
    std::string materials;
    for (const MaterialNumbers& numbers : material_numbers(scene, start.particles, start.rigid_bodies))
        materials += fmt::format("material  {}\n", describe(numbers));
    return fmt::format("grid      {} x {} cells of {:g} m, {}, {} shape functions\n"
                       "particles {} deformable, {} rigid; {}{}\n"
                       "{}"
                       "method    {}, {} form; dt = {:.6g} s ({:.3g} times what explicit steps bear), {:.6g} s to go\n"
                       "memory    about {:.0f} MB\n",
                       scene.grid.cells_x, scene.grid.cells_y, scene.grid.dx(), geometries[static_cast<int>(scene.geometry)],
                       shapes[static_cast<int>(scene.shape)], start.particles.size(), rigid,
                       scene.finite_rotation ? "finite rotation" : "small rotation", scene.affine ? ", affine transfers" : "",
                       materials, name_of(o.method), form_of(o) == Form::velocity ? "velocity" : "momentum",
                       control.options().target, control.options().target / stable, o.duration - start.time,
                       static_cast<double>(start.particles.memory_bytes() + stepper.memory_bytes()) * 1e-6 + 20.0);
}

int run_program(const io::Program& program, const Options& options, const Problem& problem) {
    check(problem.scene, problem.start.particles, problem.start.rigid_bodies, problem.start.time);
    const auto checkpoint = program.open_restart(checkpoint_format);
    State state = checkpoint ? read_state(*checkpoint, problem.scene, problem.start) : problem.start;
    StepControl control = make_step_control(options, problem.scene, problem.start);
    const auto stepper = make_time_stepper(options, problem.scene, problem.start);
    Options shown = options;
    if (program.has_default("--snapshots"))
        shown.snapshots = io::snapshots_of_run(options.duration, options.snapshots);
    const run::Outputs outputs = make_outputs(shown, state);
    const Monitor::Options monitor{.every = options.method == Method::explicit_steps ? 32 : 1,
                                   .inertia = options.method != Method::quasi_static,
                                   .forces_at_end = (options.method == Method::implicit && options.mu == 1.0) ||
                                                    options.method == Method::quasi_static};
    const std::vector<std::string> known = step_warnings(options, problem.scene, state, control.options().target);
    program.say(describe(options, problem.scene, state, control, *stepper));
    std::vector<std::string> warnings = known;
    std::ranges::move(solver_warnings(options), std::back_inserter(warnings));
    std::ranges::move(resolution_warnings(problem.scene, problem.start.particles, problem.start.rigid_bodies),
                      std::back_inserter(warnings));
    std::ranges::move(io::missing_snapshots(options.duration, shown.snapshots), std::back_inserter(warnings));
    for (MaterialNumbers numbers : material_numbers(problem.scene, problem.start.particles, problem.start.rigid_bodies)) {
        if (options.method == Method::quasi_static)
            numbers.speed = 0.0; // nothing has inertia
        for (const std::string& doubt : doubts(numbers))
            warnings.push_back(doubt);
    }
    const auto body = [&](const io::OutputFolder& folder, io::RunSummary& summary) {
        const io::RunStatus status = run(problem, state, *stepper, control, outputs, monitor,
                                         {program, folder, checkpoint ? &*checkpoint : nullptr}, summary);
        if (known.empty()) // what has been pressed together, and so become denser in cells, may have outgrown the limit since
            for (const std::string& warning : step_warnings(options, problem.scene, state, control.options().target))
                summary.warnings.push_back("at the end of the run " + warning);
        return status;
    };
    return program.run(body, warnings);
}

} // namespace ductile::mpm
