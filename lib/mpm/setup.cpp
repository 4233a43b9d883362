// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/nearest_name.hpp>
#include <ductile/mpm/measure.hpp>
#include <ductile/mpm/output.hpp>
#include <ductile/mpm/particle_file.hpp>
#include <ductile/mpm/setup.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <numbers>
#include <numeric>

namespace ductile::mpm {

namespace {

io::OptionHelp needed(std::string meaning, std::string units = {}, io::Limits allowed = io::any_number) {
    return {.group = {}, .meaning = std::move(meaning), .units = std::move(units), .allowed = allowed, .required = true};
}
io::OptionHelp optional(std::string meaning, std::string units = {}, io::Limits allowed = io::any_number) {
    return {.group = {}, .meaning = std::move(meaning), .units = std::move(units), .allowed = allowed};
}

void declare_shape(io::Keys& keys, const char* key, Shape& shape, const io::OptionHelp& help) {
    keys.toml(
        key, help,
        "a table {rectangle = [left, bottom, right, top]}, {disk = [x, y, radius]}, {polygon = [[x, y], ...]}, "
        "{union = [shape, ...]} or {difference = [shape, ...]}",
        [&shape] { return shape.toml(); }, [&shape](const std::string& toml) { shape = read_shape(value_of(toml)); });
}

/// So many numbers, or none.
void declare_numbers(io::Keys& keys, const char* key, std::vector<double>& numbers, std::size_t count,
                     const io::OptionHelp& help) {
    keys.toml(
        key, help, count == 2 ? "two numbers" : "three numbers",
        [&numbers] { return numbers.empty() ? "" : io::toml_array(numbers); },
        [&numbers, count](const std::string& toml) { numbers = read_numbers(value_of(toml), count); });
}

Velocity velocity_of(const std::string& toml) {
    const std::vector<double> v = read_numbers(value_of(toml), 2);
    return {v[0], v[1]};
}

void declare_constant(io::Keys& keys, const char* key, History<Velocity>& history, const io::OptionHelp& help) {
    keys.toml(
        key, help, "two numbers",
        [&history] {
            const Velocity v = history.after(0.0);
            return history.is_constant() ? io::toml_array({v.u, v.v}) : "";
        },
        [&history](const std::string& toml) { history = velocity_of(toml); });
}

template <class Value> constexpr std::size_t components = std::is_same_v<Value, Velocity> ? 2 : 1;
std::string knot_of(double time, const Velocity& value) { return io::toml_array({time, value.u, value.v}); }
std::string knot_of(double time, double value) { return io::toml_array({time, value}); }
void take(const std::vector<double>& row, Velocity& value) { value = {row[1], row[2]}; }
void take(const std::vector<double>& row, double& value) { value = row[1]; }

/// In the course of time: rows of a time and what it is then. Nothing is written for what is constant, if something else writes
/// that, or for nothing.
template <class Value>
void declare_history(io::Keys& keys, const char* key, History<Value>& history, const io::OptionHelp& help,
                     bool writes_constants = true) {
    keys.toml(
        key, help,
        components<Value> == 2 ? "[[time, x, y], ...]; two knots at one time are a jump"
                               : "[[time, value], ...]; two knots at one time are a jump",
        [&history, writes_constants] {
            if (history == History<Value>() || (history.is_constant() && !writes_constants))
                return std::string();
            std::string rows;
            for (const auto& [time, value] : history.knots())
                rows += (rows.empty() ? "" : ", ") + knot_of(time, value);
            return fmt::format("[{}]", rows);
        },
        [&history](const std::string& toml) {
            std::vector<typename History<Value>::Knot> knots;
            for (const std::vector<double>& row : read_rows(value_of(toml), {1 + components<Value>})) {
                knots.push_back({row[0], {}});
                take(row, knots.back().value);
            }
            history = History<Value>(std::move(knots));
        });
}

void declare(io::Keys& keys, Setup::Box& box) {
    keys.choice("geometry", box.geometry,
                {{"plane-strain", Geometry::plane_strain},
                 {"plane-stress", Geometry::plane_stress},
                 {"axisymmetric", Geometry::axisymmetric}},
                optional("what the third direction is; axisymmetric: x is the radius, y the axis"));
    keys.option("finite-rotation", box.finite_rotation,
                optional("whether the stress turns with the material; without it strains and rotations must be small"));
    keys.option("left", box.left, optional("edge of the background grid", "m"));
    keys.option("bottom", box.bottom, optional("edge of the background grid", "m"));
    keys.option("width", box.width, needed("a multiple of cell-size", "m", io::positive));
    keys.option("height", box.height, needed("a multiple of cell-size", "m", io::positive));
}

void declare(io::Keys& keys, Grid::Sides& sides) {
    for (const auto& [name, side] :
         {std::pair{"left", &sides.left}, {"right", &sides.right}, {"bottom", &sides.bottom}, {"top", &sides.top}}) {
        std::vector<io::Choice<SideCondition>> conditions{
            {"free", SideCondition::free, "nothing holds"},
            {"slip", SideCondition::slip, "no velocity across, also a plane of symmetry or the axis"},
            {"fixed", SideCondition::fixed, "no velocity"}};
        if (side == &sides.left || side == &sides.right)
            conditions.push_back(
                {"periodic", SideCondition::periodic, "left and right are one, what crosses it comes in at the other"});
        keys.choice(name, *side, conditions, optional("what holds there"));
    }
}

void declare(io::Keys& keys, Setup::Deformable& body, const std::vector<std::string>& materials) {
    keys.option("name", body.name, optional("for messages and observables"));
    keys.choice("material", body.material, io::plain_words(materials), needed("one of the materials"));
    declare_shape(keys, "shape", body.shape, optional("the region that it fills"));
    keys.input_file(
        "particles", body.particles,
        optional("a file with its particles instead: columns of CSV with a head, or datasets of HDF5, x, y, volume, and, "
                 "if you like, velocity_x, velocity_y, stress_xx, stress_yy, stress_zz, stress_xy, internal"));
    keys.toml(
        "velocity", optional("at the start", "m/s"), "two numbers",
        [&body] {
            return io::toml_array({body.velocity.u, body.velocity.v});
        },
        [&body](const std::string& toml) { body.velocity = velocity_of(toml); });
    declare_numbers(keys, "spin", body.spin, 3, optional("angular velocity, and x and y of its centre", "1/s, m, m"));
    declare_numbers(keys, "axial-mode", body.axial_mode, 2,
                    optional("speed and length: a velocity speed sin(pi x/(2 length)) in x besides", "m/s, m"));
    keys.option("particles-per-side", body.particles_per_side,
                optional("along a cell's side; 0: as the option of this name", "", io::between(0, 100)));
    keys.number_or_auto(
        "internal", body.internal,
        optional("internal variable at the start: plastic strain, or effective temperature (STZ); auto: the law's", "1, or K"));
    keys.choice("contact", body.contact,
                {{"nodes", Setup::Contact::nodes, "it shares the nodes' velocity with the others of the kind: they stick"},
                 {"surface", Setup::Contact::surface, "others touch its surface and slide on it"}},
                optional("how it meets other bodies"));
    keys.option(
        "friction", body.friction,
        optional("Coulomb's coefficient on other bodies, of one with a surface; of two the larger one", "1", io::not_negative));
}

void declare(io::Keys& keys, Setup::Rigid& body) {
    keys.option("name", body.name, optional("for messages and the columns of its force"));
    declare_shape(keys, "shape", body.shape, needed("where its points are at the start"));
    declare_constant(keys, "velocity", body.velocity, optional("constant velocity", "m/s"));
    declare_history(keys, "history", body.velocity,
                    optional("velocity in the course of time, instead: linear from knot to knot", "s, m/s"), false);
    keys.choice(
        "contact", body.contact,
        {{"nodes", Setup::Contact::nodes, "it holds the nodes that its points touch, from up to two cells away, and pulls"},
         {"surface", Setup::Contact::surface,
          "bodies touch its surface and slide on it; its shape is a rectangle, a disk or a polygon"}},
        optional("how it acts on bodies"));
    keys.option("friction", body.friction, optional("Coulomb's coefficient on its surface", "1", io::not_negative));
    declare_history(
        keys, "spin", body.spin,
        optional("angular velocity in the course of time, of one with a surface: linear from knot to knot", "s, 1/s"));
    declare_numbers(keys, "centre", body.centre, 2, optional("that it turns about; default: the middle of its points", "m"));
    keys.toml(
        "holds", optional("components of the velocity of nodes that it prescribes; [\"x\", \"y\"] sticks"),
        "a list of \"x\" and \"y\"",
        [&body] {
            return fmt::format("[{}{}{}]", body.holds_x ? "\"x\"" : "", body.holds_x && body.holds_y ? ", " : "",
                               body.holds_y ? "\"y\"" : "");
        },
        [&body](const std::string& toml) {
            body.holds_x = body.holds_y = false;
            for (const io::ConfigNode& component : value_of(toml).children) {
                if (component.text != "x" && component.text != "y")
                    throw InputError("it must be a list of \"x\" and \"y\"");
                (component.text == "x" ? body.holds_x : body.holds_y) = true;
            }
            if (!body.holds_x && !body.holds_y)
                throw InputError("it must hold one component at least");
        });
    keys.option("particles-per-side", body.particles_per_side,
                optional("along a cell's side; 0: as the option of this name", "", io::between(0, 100)));
}

void declare(io::Keys& keys, Setup::EdgeLoad& load) {
    keys.option("name", load.name, optional("for messages"));
    keys.option("body", load.body, optional("which body it acts on; default: all"));
    declare_shape(keys, "region", load.region,
                  needed("where: on the sides of the body's edge whose middles, a particle's width apart, lie there"));
    declare_history(keys, "pressure", load.pressure,
                    optional("on the deformed edge, against its normal: linear from knot to knot", "s, Pa"));
    declare_history(keys, "traction", load.traction, optional("in a fixed direction, on the area at the start", "s, Pa"));
    declare_history(keys, "force", load.force,
                    optional("the same, all of it together, of a metre of thickness or a radian", "s, N"));
}

void declare(io::Keys& keys, Setup::Measure& measure) {
    keys.option("name", measure.name, needed("of the column, with its unit"));
    keys.choice("quantity", measure.quantity, io::plain_words(quantities()),
                needed("of the scene, of a rigid body, or of particles"));
    keys.option("of", measure.of, optional("which rigid body, by default the first; or which body, by default all particles"));
    keys.choice("take", measure.take,
                {{"mean", Setup::Take::mean},
                 {"smallest", Setup::Take::smallest},
                 {"largest", Setup::Take::largest},
                 {"sum", Setup::Take::sum}},
                optional("of the particles' values"));
    keys.option("factor", measure.factor, optional("times the quantity"));
    keys.option("offset", measure.offset, optional("added to that"));
}

void declare(io::Keys& keys, Setup::Curve& curve) {
    keys.option("x", curve.x, optional("column of history.csv"));
    keys.option("y", curve.y, optional("column of history.csv"));
    keys.option("x-label", curve.x_label, optional("below the curve"));
    keys.option("y-label", curve.y_label, optional("above it"));
}

template <class T> std::vector<std::string> names_of(const std::vector<T>& values) {
    std::vector<std::string> names;
    for (const T& value : values)
        names.push_back(value.name);
    return names;
}

/// Whether a file can name them: distinct and not empty, and without what separates the columns of history.csv.
void check_names(const std::vector<std::string>& names, const char* what) {
    for (std::size_t k = 0; k < names.size(); ++k) {
        if (names[k].find(',') != std::string::npos)
            throw InputError(
                fmt::format("{} are called '{}': no name may have a comma, which separates columns", what, names[k]));
        if (names[k].empty() || std::find(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(k), names[k]) !=
                                    names.begin() + static_cast<std::ptrdiff_t>(k))
            throw InputError(fmt::format("{} are called '{}': each needs a name of its own", what, names[k]));
    }
}

/// Throws InputError unless every column of history.csv has a name of its own, and the curve, if there is one, two of them.
void check_columns(const Problem& problem) {
    const std::vector<std::string> columns = history_columns(problem);
    for (const Observable& observable : problem.observables)
        if (std::ranges::count(columns, observable.name) > 1)
            throw InputError(fmt::format("the observable '{}' has the name of another column of history.csv: call it otherwise",
                                         observable.name));
    for (const std::string* name : {&problem.curve_x, &problem.curve_y})
        if (!(problem.curve_x.empty() && problem.curve_y.empty()) && std::ranges::find(columns, *name) == columns.end())
            throw InputError(fmt::format("[curve]: there is no column '{}' in history.csv{}; it has {}", *name,
                                         io::did_you_mean(*name, columns), fmt::join(columns, ", ")));
}

void add(Problem& problem, const Setup& setup, const Setup::Deformable& body, const Options& options) {
    const std::vector<std::string> names = names_of(setup.materials);
    const auto found = std::ranges::find(names, body.material);
    if (found == names.end())
        throw InputError(fmt::format("the body '{}' is of the material '{}', which the scene does not have{}", body.name,
                                     body.material, io::did_you_mean(body.material, names)));
    const auto material = static_cast<std::size_t>(found - names.begin());
    std::vector<double> internal;
    if (body.internal != "auto") {
        for (const InternalVariable& variable : problem.scene.materials[material].law->variables())
            internal.push_back(internal.empty() ? io::parse_number(body.internal) : variable.start / variable.natural_unit);
        if (internal.empty())
            throw InputError(fmt::format("the body '{}' starts with the internal variable {}, and its law has none", body.name,
                                         body.internal));
    }
    const Body added{.shape = body.shape,
                     .material = static_cast<int>(material),
                     .density = setup.materials[material].density,
                     .velocity_x = body.velocity.u,
                     .velocity_y = body.velocity.v,
                     .particles_per_side = body.particles_per_side > 0 ? body.particles_per_side : options.particles_per_side,
                     .internal = std::move(internal),
                     .name = body.name};
    Particles& particles = problem.start.particles;
    const std::size_t first = particles.size();
    if (body.particles.empty() == body.shape.toml().empty())
        throw InputError(fmt::format("the body '{}' must have either a shape or a file of particles", body.name));
    if (body.particles.empty())
        add_body(particles, added, problem.scene);
    else
        add_particles(particles, added, body.particles, problem.scene);
    if (!body.spin.empty()) {
        if (problem.scene.geometry == Geometry::axisymmetric)
            throw InputError(
                fmt::format("the body '{}' spins in the plane of an axisymmetric scene, which it cannot", body.name));
        for (std::size_t p = first; p < particles.size(); ++p) {
            particles.velocity_x[p] -= body.spin[0] * (particles.y[p] - body.spin[2]);
            particles.velocity_y[p] += body.spin[0] * (particles.x[p] - body.spin[1]);
            if (problem.scene.affine) {
                particles.affine[1][p] = -body.spin[0];
                particles.affine[2][p] = body.spin[0];
            }
        }
    }
    if (!body.axial_mode.empty())
        for (std::size_t p = first; p < particles.size(); ++p)
            particles.velocity_x[p] +=
                body.axial_mode[0] * std::sin(0.5 * std::numbers::pi * particles.x[p] / body.axial_mode[1]);
}

void give_surface(RigidBody& body, const Setup::Rigid& rigid) {
    const std::vector<Outline>& outlines = rigid.shape.outlines();
    if (outlines.size() != 1)
        throw InputError(fmt::format("the rigid body '{}' has a surface, and its shape is made of several: take a rectangle, a "
                                     "disk or a polygon, and a rigid body for each",
                                     rigid.name));
    if (!rigid.holds_x || !rigid.holds_y)
        throw InputError(
            fmt::format("the rigid body '{}' has a surface, and says what it holds, which is of one that holds nodes: leave "
                        "'holds' out, friction = 0 lets bodies slide",
                        rigid.name));
    body.surface = outlines.front();
    body.friction = rigid.friction;
    body.spin = rigid.spin;
    const auto middle = [](const std::vector<double>& places) {
        return std::accumulate(places.begin(), places.end(), 0.0) / static_cast<double>(places.size());
    };
    body.centre =
        rigid.centre.empty() ? std::array{middle(body.x), middle(body.y)} : std::array{rigid.centre[0], rigid.centre[1]};
}

/// Calls `visit(body, first, last)` for the bodies, by number, and their particles, which are one after another.
void for_each_body(const Particles& particles, const auto& visit) {
    for (std::size_t first = 0, last = 0; first < particles.size(); first = last) {
        while (last < particles.size() && particles.body[last] == particles.body[first])
            ++last;
        visit(static_cast<std::size_t>(particles.body[first]), first, last);
    }
}

/// The velocity fields of the bodies: one for all that share the nodes, and one for each that does not.
void separate(Problem& problem, const Setup& setup) {
    const auto by_surface = [](const Setup::Deformable& body) { return body.contact == Setup::Contact::surface; };
    for (const Setup::Deformable& body : setup.bodies)
        if (body.friction != 0.0 && !by_surface(body))
            throw InputError(fmt::format("the body '{}' shares the nodes with others, and has a friction, which is of one with "
                                         "contact = \"surface\"",
                                         body.name));
    const auto found = std::ranges::find_if(setup.bodies, by_surface);
    if (found == setup.bodies.end())
        return;
    if (setup.bodies.size() == 1)
        throw InputError(
            fmt::format("the body '{}' has contact = \"surface\", which is of bodies that meet others, and there is no "
                        "other: leave it out (rigid bodies have a contact of their own)",
                        found->name));
    Scene& scene = problem.scene;
    scene.surface_contact = true;
    int fields = std::ranges::all_of(setup.bodies, by_surface) ? 0 : 1;
    for (const Setup::Deformable& body : setup.bodies)
        scene.field_of_body.push_back(by_surface(body) ? fields++ : 0);
    if (std::ranges::any_of(setup.bodies, [](const Setup::Deformable& body) { return body.friction > 0.0; }))
        for (const Setup::Deformable& body : setup.bodies)
            scene.friction_of_body.push_back(body.friction);
}

/// To all bodies, once they have their particles.
void add_surfaces(Problem& problem, const Setup& setup, Method method) {
    // of a layer as thick as a particle: ten times the material leaves Newton's iterations as many, a hundred doubles them; two
    // bodies' layers lie one on the other;
    // explicit steps bear the material in a layer as thick as half of a cell
    const double half_cell = 0.5 * problem.scene.grid.smallest_spacing();
    Particles& particles = problem.start.particles;
    for_each_body(particles, [&](std::size_t body, std::size_t first, std::size_t last) {
        const auto& law = problem.scene.materials[static_cast<std::size_t>(particles.material[first])].law;
        const std::size_t before = particles.surface.size();
        const double layer = 2.0 * std::sqrt(particles.half_width[first] * particles.half_height[first]);
        const double stiffness = method == Method::explicit_steps ? layer / half_cell : has_fields(problem.scene) ? 20.0 : 10.0;
        add_surface(particles, first, last, setup.bodies[body].shape, stiffness * law->elasticity().alpha(), problem.scene);
        if (particles.surface.size() == before)
            throw InputError(fmt::format("the body '{}' has no point of its surface near a particle, and would pass through the "
                                         "bodies that have one: use smaller cells or more particles a cell",
                                         setup.bodies[body].name));
    });
    for (std::size_t b = 0; b < problem.start.rigid_bodies.size(); ++b)
        if (problem.start.rigid_bodies[b].friction > 0.0)
            particles.surface.provide_friction(b);
    if (!problem.scene.friction_of_body.empty())
        particles.surface.provide_friction_of_bodies(problem.scene.friction_of_body.size());
}

void add_load(Problem& problem, const Setup& setup, const Setup::EdgeLoad& load) {
    const std::vector<std::string> bodies = names_of(setup.bodies);
    if (!load.body.empty() && std::ranges::find(bodies, load.body) == bodies.end())
        throw InputError(fmt::format("the load '{}' acts on the body '{}', which the scene does not have{}", load.name, load.body,
                                     io::did_you_mean(load.body, bodies)));
    const auto number = static_cast<std::int64_t>(problem.scene.loads.size());
    problem.scene.loads.push_back({load.name, load.pressure, load.traction});
    LoadedSides& loaded = problem.start.particles.loaded;
    const std::size_t before = loaded.size();
    for_each_body(problem.start.particles, [&](std::size_t body, std::size_t first, std::size_t last) {
        if (load.body.empty() || load.body == bodies[body])
            add_loaded_sides(problem.start.particles, first, last, setup.bodies[body].shape, load.region, number, problem.scene);
    });
    if (load.force == History<Velocity>())
        return;
    if (load.traction != History<Velocity>())
        throw InputError(fmt::format("the load '{}' has both a traction and a force: give one of them", load.name));
    const double area = std::accumulate(loaded.area.begin() + static_cast<std::ptrdiff_t>(before), loaded.area.end(), 0.0);
    if (!(area > 0.0)) // check() says so
        return;
    std::vector<History<Velocity>::Knot> knots = load.force.knots();
    for (auto& knot : knots)
        knot.value = knot.value / area;
    problem.scene.loads.back().traction = History<Velocity>(std::move(knots));
}

} // namespace

void visit(io::Tables& tables, Setup& setup) {
    tables.table("grid", "The background grid", [&](io::Keys& keys) { declare(keys, setup.grid); });
    tables.table("sides", "What holds at its sides", [&](io::Keys& keys) { declare(keys, setup.sides); });
    tables.named("materials", "Materials, each with a name of its own", setup.materials,
                 [](io::Keys& keys, MaterialData& material) { ductile::declare(keys, material); });
    const std::vector<std::string> materials = names_of(setup.materials);
    tables.list("bodies", "Bodies that deform", setup.bodies,
                [&](io::Keys& keys, Setup::Deformable& body) { declare(keys, body, materials); });
    tables.list("rigid-bodies", "Rigid bodies, which move as prescribed", setup.rigid_bodies,
                [](io::Keys& keys, Setup::Rigid& body) { declare(keys, body); });
    tables.list("loads", "Loads on the edges of bodies", setup.loads,
                [](io::Keys& keys, Setup::EdgeLoad& load) { declare(keys, load); });
    tables.table("body-force", "Gravity and the like", [&](io::Keys& keys) {
        declare_constant(keys, "acceleration", setup.acceleration, optional("of every particle", "m/s^2"));
        declare_history(keys, "history", setup.acceleration,
                        optional("the same in the course of time, instead: linear from knot to knot", "s, m/s^2"), false);
    });
    tables.list("observables", "Columns of history.csv besides those that every scene has: factor * quantity + offset",
                setup.observables, [](io::Keys& keys, Setup::Measure& measure) { declare(keys, measure); });
    tables.table("curve", "The curve in the terminal", [&](io::Keys& keys) { declare(keys, setup.curve); });
}

void writes_scene(io::Program& program, const std::function<Setup()>& setup) {
    program.writes_scene("points", [setup](io::Tables& tables) {
        Setup made = setup();
        visit(tables, made);
    });
}

Problem make_problem(const Setup& setup, const Options& options) {
    const Setup::Box& box = setup.grid;
    Problem problem;
    problem.scene = {.geometry = box.geometry,
                     .grid = {.cells_x = cells_along(box.width, options, "the width of the grid"),
                              .cells_y = cells_along(box.height, options, "the height of the grid"),
                              .width = box.width,
                              .height = box.height,
                              .left = box.left,
                              .bottom = box.bottom,
                              .sides = setup.sides},
                     .shape = options.shape,
                     .finite_rotation = box.finite_rotation,
                     .affine = options.affine};
    check_names(names_of(setup.bodies), "bodies");
    check_names(names_of(setup.rigid_bodies), "rigid bodies");
    check_names(names_of(setup.observables), "observables");
    check_names(names_of(setup.loads), "loads");
    for (const MaterialData& material : setup.materials) {
        try {
            problem.scene.materials.push_back({make_law(material), effective_heat_capacity(material)});
        } catch (const InputError& error) {
            throw InputError(fmt::format("the material '{}': {}", material.name, error.what()));
        }
    }
    for (const Setup::Deformable& body : setup.bodies)
        add(problem, setup, body, options);
    for (const Setup::Rigid& rigid : setup.rigid_bodies) {
        if (rigid.name.find('/') != std::string::npos)
            throw InputError(fmt::format("a rigid body is called '{}': its name must not have a slash, which separates groups of "
                                         "fields.h5",
                                         rigid.name));
        RigidBody body = make_rigid_body(rigid.name, rigid.shape,
                                         rigid.particles_per_side > 0 ? rigid.particles_per_side : options.particles_per_side,
                                         problem.scene.grid);
        body.velocity = rigid.velocity;
        body.holds_x = rigid.holds_x;
        body.holds_y = rigid.holds_y;
        if (rigid.contact == Setup::Contact::surface)
            give_surface(body, rigid);
        else if (rigid.friction != 0.0 || !rigid.centre.empty() || rigid.spin != History<double>())
            throw InputError(fmt::format("the rigid body '{}' holds nodes, and has a friction, a spin or a centre: these are of "
                                         "one with contact = \"surface\"",
                                         rigid.name));
        problem.scene.surface_contact = problem.scene.surface_contact || body.surface.has_value();
        problem.start.rigid_bodies.push_back(std::move(body));
    }
    separate(problem, setup);
    if (problem.scene.surface_contact)
        add_surfaces(problem, setup, options.method);
    for (const Setup::EdgeLoad& load : setup.loads)
        add_load(problem, setup, load);
    if (setup.acceleration != History<Velocity>())
        problem.scene.body_force = [history = setup.acceleration](std::int64_t, double, double, double time) {
            const Velocity b = history.after(time);
            return std::array{b.u, b.v};
        };
    for (const Setup::Measure& measure : setup.observables)
        problem.observables.push_back(make_observable(measure, setup));
    problem.curve_x = setup.curve.x;
    problem.curve_y = setup.curve.y;
    problem.label_x = setup.curve.x_label.empty() ? setup.curve.x : setup.curve.x_label;
    problem.label_y = setup.curve.y_label.empty() ? setup.curve.y : setup.curve.y_label;
    problem.conclusions.conclude = [all = problem.observables](const Observation& seen, const Tally&,
                                                               nlohmann::ordered_json& extra) {
        for (const Observable& observable : all)
            extra["final_" + observable.name] = observable.value(seen);
    };
    check_columns(problem);
    return problem;
}

} // namespace ductile::mpm
