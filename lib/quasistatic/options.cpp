// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/base/memory.hpp>
#include <ductile/io/output_times.hpp>
#include <ductile/quasistatic/options.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace ductile::quasistatic {

namespace {

/// Half the height: the L of the paper, whose domain is [-L, L]^2.
double length_unit(const Options& o) { return 0.5 * o.height; }

/// What a run holds besides the stepper: the fields that a snapshot derives, what accumulates for it, and the program with its
/// libraries.
double overhead_bytes(const Options& o) {
    const bool snapshots = !o.snapshots.empty() || o.snapshots_every > 0.0;
    const double fields = !snapshots ? 0.0 : o.model == Model::full ? 34.0 : 25.0;
    return 8.0 * fields * o.cells.x * o.cells.y + 20e6;
}

void check_memory(const Options& o) {
    require_memory(scheme_named(o.scheme).fields * 8.0 * o.cells.x * o.cells.y + overhead_bytes(o),
                   fmt::format("--cells {}x{}", o.cells.x, o.cells.y), "use fewer cells");
}

void declare_domain(io::Program& program, Options& o) {
    const auto help = [](std::string meaning, std::string units = {}, io::Limits allowed = io::any_number) {
        return io::OptionHelp{"Domain", std::move(meaning), std::move(units), allowed};
    };
    program.option("--cells", o.cells, help("cells in x and y; of elements, points"));
    program.option("--width", o.width, help("extent in x, the periodic direction", "m", io::positive));
    program.option("--height", o.height, help("distance of the walls", "m", io::positive));
    program.option("--wall-velocity", o.wall_velocity, help("velocity of the upper wall; the lower one moves oppositely", "m/s"));
    program.option("--wall-history", o.wall_history,
                   help("piecewise-linear velocity of the upper wall instead: knots time:u or time:u:v, separated by commas; u "
                        "shears, v opens; two knots at one time are a jump",
                        "s, m/s"));
    program.option("--shear-traction", o.shear_traction,
                   help("walls under force control instead: the mean tau on them, one number from the start on, or knots "
                        "time:traction, separated by commas",
                        "s, Pa"));
    program.option("--normal-traction", o.normal_traction,
                   help("the same for the mean sigma_yy, tension positive; the gap opens and closes as it takes", "s, Pa"));
}

void declare_model(io::Program& program, Options& o) {
    program.choice("--model", o.model, {{"full", Model::full, "with advection and spin"}, {"reduced", Model::reduced, "without"}},
                   {"Material", "what moves with the material"});
}

void declare_initial(io::Program& program, Options& o) {
    const auto help = [](std::string meaning, std::string units = {}, io::Limits allowed = io::any_number) {
        return io::OptionHelp{"Start: effective temperature (STZ) or plastic strain (Perzyna)", std::move(meaning),
                              std::move(units), allowed};
    };
    program.choice("--initial", o.initial,
                   {{"paper", InitialChoice::paper, "Lu & Rycroft's App. C"},
                    {"uniform", InitialChoice::uniform, "a constant"},
                    {"gaussian", InitialChoice::gaussian, "a Gaussian inclusion"},
                    {"disc", InitialChoice::disc, "a disc with a soft edge"},
                    {"random", InitialChoice::random, "a smooth random field"},
                    {"blocks", InitialChoice::blocks, "random blocks, which jump: for no grid fine enough"},
                    {"file", InitialChoice::file, "--initial-file"}},
                   help("the field at the start"));
    program.number_or_auto("--initial-base", o.initial_base,
                           help("T_base, constant, background or mean; auto: 640 K for STZ, 0 for Perzyna", "K, or 1"));
    program.number_or_auto(
        "--initial-amplitude", o.initial_amplitude,
        help("Delta T, height of the inclusion or disc, or standard deviation; auto: 180 K for STZ, 0 for Perzyna", "K, or 1"));
    program.option("--initial-x", o.initial_x,
                   help("centre of the inclusion or disc; the origin is the middle of the domain", "m"));
    program.option("--initial-y", o.initial_y, help("centre of the inclusion or disc", "m"));
    program.option("--initial-length", o.initial_length,
                   help("radius of the inclusion or disc, correlation length, or side of the blocks", "m", io::positive));
    program.option("--initial-transition", o.initial_transition, help("half the width of the disc's edge", "m", io::positive));
    program.option("--initial-stress", o.initial_stress,
                   help("standard deviation of a smooth random eigenstress of correlation length --initial-length, brought into "
                        "equilibrium; not with a file",
                        "Pa", io::not_negative));
    program.input_file(
        "--initial-file", o.initial_file,
        help("fields on the cells of any grid of this domain: effective_temperature or plastic_strain, and, if you like, "
             "pressure, s, tau, q, which are then brought into equilibrium; HDF5 (the last snapshot of a fields.h5, or datasets "
             "of rows and columns), or CSV with these columns after x, y (m, the origin in the middle), row after row from the "
             "lower left",
             "K, 1, Pa"));
    program.option("--initial-seed", o.initial_seed, help("seed of random fields", "", io::not_negative));
}

void declare_time(io::Program& program, Options& o) {
    const auto help = [](std::string meaning, std::string units = {}, io::Limits allowed = io::positive) {
        return io::OptionHelp{"Time integration", std::move(meaning), std::move(units), allowed, io::Restart::may_change};
    };
    std::vector<io::Choice<std::string>> known;
    for (const Scheme& scheme : schemes())
        known.push_back({scheme.name, scheme.name, scheme.meaning});
    program.choice("--scheme", o.scheme, known, help("the time integrator"));
    program.choice(
        "--step", o.step,
        {{"fixed", StepChoice::fixed, "all of the length --dt"},
         {"adaptive", StepChoice::adaptive, "by the error of a step, or, in projection schemes, the size of the projection"}},
        help("how long steps are"));
    program.number_or_auto("--dt", o.dt, help("fixed step, auto: the paper's 0.5e4 t_s h/L", "s", io::positive));
    program.number_or_auto(
        "--tolerance", o.tolerance,
        help("adaptive: projection schemes hold Q* near this times (h/L)^2 (auto: 0.001); index-reduced schemes bound the "
             "error of a step in sigma/s_Y and chi/chi_inf (auto: 1e-4, on fine grids 1e-4 (252 h/L)^3, on elements 1e-5)",
             "", io::positive));
    program.option("--dt-start", o.projection_steps.first_step, help("adaptive projection: first step", "s"));
    program.option("--dt-min", o.projection_steps.smallest_step, help("adaptive projection: smallest step", "s"));
    program.option("--dt-max", o.projection_steps.largest_step, help("adaptive projection: largest step", "s"));
    program.option("--step-growth", o.projection_steps.largest_growth, help("adaptive projection: F_max", "", io::at_least(1.0)));
    program.option("--step-safety", o.projection_steps.safety, help("adaptive projection: F_s", "", io::between(0.01, 1.0)));
    program.option(
        "--step-reject", o.step_reject,
        help("adaptive projection: repeat a step whose Q* exceeds this many times the tolerance; 0: never, as in the paper", "",
             io::not_negative));
    program.option("--pointwise-fixed", o.pointwise_fixed,
                   help("projection schemes, fixed steps: tolerance of the pointwise integration divided by (dt/t_s)^2"));
    program.option("--pointwise-adaptive", o.pointwise_adaptive,
                   help("projection schemes, adaptive steps: tolerance of the pointwise integration divided by (h/L)^2"));
    program.option("--velocity-passes", o.velocity_passes,
                   help("index-reduced schemes: elliptic solves a right-hand side at most; fewer are taken where they suffice",
                        "", io::between(1, 20)));
}

void declare_space(io::Program& program, Options& o) {
    const auto help = [](std::string meaning, std::string units = {}, io::Limits allowed = io::any_number,
                         io::Restart restart = io::Restart::keeps) {
        return io::OptionHelp{"Space", std::move(meaning), std::move(units), allowed, restart};
    };
    program.choice("--space", o.space.kind,
                   {{"staggered", SpaceKind::staggered, "the paper's grid, second order: for fields rough from cell to cell"},
                    {"elements", SpaceKind::elements, "Fourier series in x, spectral elements in y: for smooth fields"}},
                   help("the discretisation"));
    program.option(
        "--accuracy", o.accuracy,
        help("error of sigma/s_Y, chi/chi_inf, velocity and traction at the end: how many elements and which --tolerance that "
             "takes is found by coarser runs, whatever a scene's file has, and the error is estimated; 0: they are given",
             "", io::between(0.0, 0.1)));
    program.option("--degree", o.space.elements.degree,
                   help("elements: degree in y; that many rows of --cells make an element", "", io::between(1, 16)));
    program.option(
        "--element-edges", o.element_edges,
        help("elements: where they meet, y1,y2,... between the walls, the origin in the middle; none: equal heights", "m"));
    program.option(
        "--adapt-elements", o.space.elements.adapt,
        help("elements: halve them where the fields are fine, and join as many where they are smooth, at the start and "
             "as the run goes on; snapshots are then on equal cells"));
    const auto staggered = [&](std::string meaning) {
        return help("staggered: " + std::move(meaning), "", io::any_number, io::Restart::may_change);
    };
    program.choice("--equilibrium", o.space.solver,
                   {{"fastest", SolverKind::fastest, "of the two"},
                    {"fourier", SolverKind::fourier, "Fourier series in x, tridiagonal systems in y"},
                    {"cholesky", SolverKind::cholesky, "sparse factorisation, kept"}},
                   staggered("solver of the elliptic problem"));
    program.choice("--operator", o.space.stiffness,
                   {{"exact", Stiffness::exact, "at one point of a cell, which makes the projection exact"},
                    {"full", Stiffness::full, "fully integrated, the paper's (S.20); projection schemes only"}},
                   staggered("the stiffness"));
    program.choice("--advection", o.space.advection,
                   {{"weno3", Advection::weno3, "smooth, of third order"},
                    {"eno2", Advection::eno2, "the paper's, of second order, which jump from stencil to stencil"}},
                   staggered("differences of the advection"));
}

void declare_output(io::Program& program, Options& o) {
    const auto help = [](std::string meaning, std::string units = {}, io::Limits allowed = io::positive) {
        return io::OptionHelp{"Run", std::move(meaning), std::move(units), allowed, io::Restart::may_change};
    };
    program.option("--duration", o.duration, help("simulated time at the end", "s"));
    program.option(
        "--snapshots", o.snapshots,
        help("times of the snapshots in fields.h5: t1,t2,...; where none are given, the end is one", "s", io::not_negative));
    program.option("--snapshots-every", o.snapshots_every,
                   help("snapshots at the times 0, T, 2 T, ... besides; 0: none", "s", io::not_negative));
    program.option("--snapshot-cells", o.snapshot_cells,
                   help("equal cells that snapshots are interpolated to, N or MxN; auto: the space's own cells or points"));
    program.option("--history-every", o.history_every, help("rows of history.csv: every n-th step", "", io::at_least(1)));
    program.option(
        "--rows-every", o.rows_every,
        help("rows of history.csv at the times 0, T, 2 T, ... instead, wherever steps end; 0: at steps", "s", io::not_negative));
}

} // namespace

void declare_scene(io::Program& program, Options& options) {
    declare_domain(program, options);
    declare(program, options.material);
    declare_model(program, options);
    declare_initial(program, options);
}

void declare(io::Program& program, Options& options) {
    declare_scene(program, options);
    declare_space(program, options);
    declare_time(program, options);
    declare_output(program, options);
}

namespace {

Walls make_walls(const Options& o, const Units& units) {
    const bool shear_moves = o.shear_traction.empty();
    std::vector<WallKnot> knots =
        (o.wall_history.empty() ? WallHistory({shear_moves ? o.wall_velocity : 0.0, 0.0}) : parse_wall_history(o.wall_history))
            .knots();
    for (WallKnot& knot : knots) {
        if ((!shear_moves && knot.value.u != 0.0) || (!o.normal_traction.empty() && knot.value.v != 0.0))
            throw InputError(fmt::format("--wall-history {}: {} is under force control ({}), and cannot have a velocity besides",
                                         o.wall_history, shear_moves ? "opening" : "shear",
                                         shear_moves ? "--normal-traction" : "--shear-traction"));
        knot = {knot.time / units.time, knot.value / units.velocity()};
    }
    Walls walls = moving(WallHistory(std::move(knots)));
    const auto force_control = [&](const char* option, const std::string& text, WallControl& control) {
        if (text.empty())
            return;
        std::vector<History<double>::Knot> tractions = parse_traction_history(option, text).knots();
        for (auto& knot : tractions)
            knot = {knot.time / units.time, knot.value / units.stress};
        control = {WallControl::By::traction, History<double>(std::move(tractions))};
    };
    force_control("--shear-traction", o.shear_traction, walls.shear);
    force_control("--normal-traction", o.normal_traction, walls.opening);
    return walls;
}

} // namespace

Scene make_scene(const Options& o) {
    const Units units = natural_units(o.material, length_unit(o));
    Scene scene{
        .units = units,
        .grid = {.cells_x = o.cells.x, .cells_y = o.cells.y, .width = o.width / units.length, .height = o.height / units.length},
        .law = make_law(o.material, units),
        .model = o.model,
        .walls = make_walls(o, units)};
    check(scene.grid);
    check_memory(o);
    return scene;
}

namespace {

double number_or_auto(const std::string& text, const char* option, double standard, const char* meaning,
                      const io::Limits& limits = io::positive) {
    if (text == "auto")
        return standard;
    try {
        return io::parse_number(text, limits);
    } catch (const InputError& error) {
        throw InputError(fmt::format("{} {}: {}; or auto for {}", option, text, error.what(), meaning));
    }
}

} // namespace

Field make_initial_internal(const Options& o, const Scene& scene, const RowSpacing& rows) {
    const InternalVariable variable = scene.law->variables().front();
    const double value = variable.natural_unit, length = scene.units.length;
    const double standard_amplitude = o.material.plasticity == PlasticityChoice::stz ? PaperPattern{}.amplitude : 0.0;
    const double base =
        number_or_auto(o.initial_base, "--initial-base", variable.start, "the start of the law", io::any_number) / value;
    const double amplitude = number_or_auto(o.initial_amplitude, "--initial-amplitude", standard_amplitude,
                                            "180 K or no plastic strain", io::any_number) /
                             value;
    const auto initial = [&]() -> InitialInternal {
        switch (o.initial) {
        case InitialChoice::paper:
            return PaperPattern{base, amplitude};
        case InitialChoice::uniform:
            return Uniform{base};
        case InitialChoice::gaussian:
            return GaussianInclusion{base, amplitude, o.initial_x / length, o.initial_y / length, o.initial_length / length};
        case InitialChoice::disc:
            return SoftDisc{base,
                            amplitude,
                            o.initial_x / length,
                            o.initial_y / length,
                            o.initial_length / length,
                            o.initial_transition / length};
        case InitialChoice::blocks:
            return RandomBlocks{base, amplitude, o.initial_length / length, static_cast<std::uint64_t>(o.initial_seed)};
        case InitialChoice::file:
            throw InputError("--initial file: this start is no pattern");
        case InitialChoice::random:
            return RandomField{base, amplitude, o.initial_length / length, static_cast<std::uint64_t>(o.initial_seed)};
        }
        __builtin_unreachable();
    };
    try {
        return initial_internal(scene.grid, rows, initial(), variable);
    } catch (const InputError& error) {
        throw InputError(fmt::format("{}; change --initial-base, --initial-amplitude or --initial-length", error.what()));
    }
}

void add_eigenstress(const Options& o, const Scene& scene, const RowSpacing& rows, StressField& stress) {
    RandomField random{0.0, o.initial_stress / scene.units.stress, o.initial_length / scene.units.length,
                       static_cast<std::uint64_t>(o.initial_seed)};
    for (Field* field : {&stress.s, &stress.tau}) {
        ++random.seed; // chi has the first
        const Field values = random_field(scene.grid, rows, random);
        for (int j = 0; j < field->rows(); ++j)
            for (int i = 0; i < field->columns(); ++i)
                (*field)(i, j) += values(i, j);
        field->wrap();
    }
}

/// With error control the error in time should stay below a tenth of that in space, which falls with h^2; the one falls about
/// with the 2/3 power of the tolerance (verification/results/work_precision.md). Elements are there to do better.
double tolerance(const Options& o) {
    if (scheme_named(o.scheme).kind == SchemeKind::projection)
        return number_or_auto(o.tolerance, "--tolerance", 1e-3, "0.001");
    if (o.space.kind == SpaceKind::elements)
        return number_or_auto(o.tolerance, "--tolerance", 1e-5, "1e-5");
    const double h = std::sqrt(o.width * o.height / (static_cast<double>(o.cells.x) * o.cells.y)) / length_unit(o);
    return number_or_auto(o.tolerance, "--tolerance", 1e-4 * std::min(1.0, std::pow(252.0 * h, 3.0)),
                          "1e-4, on fine grids 1e-4 (252 h/L)^3");
}

StepControl make_step_control(const Options& o, const Scene& scene) {
    const double unit = scene.units.time;
    const double standard_dt = 0.5e4 * unit * std::sqrt(scene.grid.cell_area());
    if (o.step == StepChoice::fixed) {
        const double dt = number_or_auto(o.dt, "--dt", standard_dt, "the paper's 0.5e4 t_s h/L");
        if (!(o.duration / dt < 1e9))
            throw InputError(
                fmt::format("--dt {:g}: the run to {:g} s would take {:.3g} steps, which no machine ends: take a longer "
                            "--dt or a shorter --duration",
                            dt, o.duration, o.duration / dt));
        return {scene.grid, FixedSteps{dt / unit}};
    }
    if (o.dt != "auto")
        throw InputError(fmt::format("--dt {}: adaptive steps have no fixed length: add --step fixed, or leave --dt out", o.dt));
    if (scheme_named(o.scheme).kind == SchemeKind::sundials)
        return {scene.grid, OwnSteps{}};
    if (const Scheme& scheme = scheme_named(o.scheme); scheme.kind == SchemeKind::index_reduced)
        return {scene.grid, ErrorSteps{.tolerance = step_tolerance(scheme, tolerance(o)), .order = scheme.estimate_order}};
    ProjectionSteps steps = o.projection_steps;
    steps.tolerance = tolerance(o);
    if (o.step_reject > 0.0)
        steps.largest_excess = o.step_reject;
    for (double* step : {&steps.first_step, &steps.smallest_step, &steps.largest_step})
        *step /= unit;
    if (!(steps.smallest_step <= steps.largest_step))
        throw InputError(
            fmt::format("--dt-min {} exceeds --dt-max {}", o.projection_steps.smallest_step, o.projection_steps.largest_step));
    return {scene.grid, steps};
}

std::unique_ptr<Space> make_space(const Options& o, const Scene& scene) {
    SpaceOptions space = o.space;
    if (space.kind == SpaceKind::elements &&
        (space.solver == SolverKind::cholesky || space.stiffness == Stiffness::full || space.advection == Advection::eno2))
        throw InputError(
            "--space elements: --equilibrium cholesky, --operator full and --advection eno2 are of the staggered grid: "
            "leave them out, or take --space staggered");
    if (space.kind == SpaceKind::staggered && !o.element_edges.empty())
        throw InputError("--element-edges: the staggered grid has no elements: add --space elements");
    if (space.kind == SpaceKind::staggered && space.elements.adapt)
        throw InputError("--adapt-elements: the staggered grid has no elements: add --space elements");
    for (const double y : o.element_edges)
        space.elements.edges.push_back(y / scene.units.length);
    try {
        return make_space(scene, space);
    } catch (const InputError& error) {
        throw InputError(fmt::format("{} (--space, --cells, --degree, --element-edges, --adapt-elements)", error.what()));
    }
}

std::unique_ptr<TimeStepper> make_time_stepper(const Options& o, const Scene& scene, std::unique_ptr<Space> space) {
    if (o.space.stiffness == Stiffness::full && o.scheme == "extrapolated")
        throw InputError(
            "--operator full: with this stiffness the scheme extrapolated is unstable at every step length: use --operator "
            "exact, or --scheme incremental");
    if (o.space.stiffness == Stiffness::full && scheme_named(o.scheme).kind != SchemeKind::projection)
        throw InputError(
            fmt::format("--operator full: with this stiffness the scheme {} drifts out of equilibrium, and nothing brings "
                        "it back: use --operator exact, or a projection scheme (--scheme incremental)",
                        scheme_named(o.scheme).name));
    using Scale = PointwiseTolerance::Scale;
    const bool fixed = o.step == StepChoice::fixed;
    return make_stepper(o.scheme, scene, std::move(space),
                        {.passes = {.largest = o.velocity_passes, .tolerance = 0.1 * tolerance(o)},
                         .tolerance = tolerance(o),
                         .fixed_steps = fixed,
                         .pointwise = fixed ? PointwiseTolerance{Scale::step, o.pointwise_fixed}
                                            : PointwiseTolerance{Scale::cell, o.pointwise_adaptive}});
}

run::Outputs make_outputs(const Options& o, const Scene& scene, double start) {
    if (!(o.duration / scene.units.time >= start))
        throw InputError(
            fmt::format("--duration {}: the checkpoint is at t = {:.6g} s already: a longer --duration goes on from there",
                        o.duration, start * scene.units.time));
    io::CellCount cells = o.space.elements.adapt ? o.cells : io::CellCount{}; // of points that move there would be no one grid
    if (o.snapshot_cells != "auto")
        try {
            cells = io::parse_cell_count(o.snapshot_cells);
        } catch (const InputError& error) {
            throw InputError(fmt::format("--snapshot-cells {}: {}; or auto", o.snapshot_cells, error.what()));
        }
    return {.duration_s = o.duration,
            .snapshots_s = io::regular_times("--snapshots-every", o.snapshots, o.snapshots_every, o.duration),
            .snapshot_cells_x = cells.x,
            .snapshot_cells_y = cells.y,
            .rows_s = io::regular_times("--rows-every", {}, o.rows_every, o.duration),
            .history_every = o.history_every};
}

std::string describe(const Options& o, const Scene& scene, const TimeStepper& stepper, int threads) {
    const Grid& g = scene.grid;
    const auto driven = [&](const WallControl& control, const std::string& traction) {
        return control.by == WallControl::By::traction
                   ? fmt::format("under {} Pa", traction)
                   : fmt::format("at {:.3g} 1/s", control.history.after(0.0) / (0.5 * g.height) / scene.units.time);
    };
    const std::string unknowns = fmt::format("{} velocities, {} cell values", 2LL * g.cells_x * (g.cells_y - 1),
                                             (4LL + std::ssize(scene.law->variables())) * g.cells_x * g.cells_y);
    const bool staggered = o.space.kind == SpaceKind::staggered;
    const std::string cells = staggered ? fmt::format("{} x {} cells", g.cells_x, g.cells_y)
                                        : fmt::format("{} points in x by {} elements of degree {} in y", g.cells_x,
                                                      g.cells_y / o.space.elements.degree, o.space.elements.degree);
    return fmt::format(
        "grid      {} on {} x {} m; {}\n"
        "material  {}\n"
        "walls     shear {}, open {}\n"
        "model     {}; {}, {} steps; {}\n"
        "memory    about {:.0f} MB; {} thread{}\n",
        cells, o.width, o.height, unknowns, describe(o.material), driven(scene.walls.shear, o.shear_traction),
        driven(scene.walls.opening, o.normal_traction), scene.model == Model::full ? "full" : "reduced",
        scheme_named(o.scheme).meaning, o.step == StepChoice::fixed ? "fixed" : "adaptive",
        staggered ? fmt::format("{} solver, {} operator", o.space.solver == SolverKind::cholesky ? "cholesky" : "fourier",
                                o.space.stiffness == Stiffness::exact ? "exact" : "fully integrated")
                  : "exact operator",
        (static_cast<double>(stepper.memory_bytes()) + overhead_bytes(o)) * 1e-6, threads, threads == 1 ? "" : "s");
}

} // namespace ductile::quasistatic
