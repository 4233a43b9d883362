// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/tables.hpp>
#include <ductile/mpm/options.hpp>
#include <ductile/scene/history.hpp>
#include <ductile/scene/materials.hpp>
#include <ductile/scene/shape.hpp>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace ductile::mpm {

/// A scene of material points as plain data, in SI: what a program sets up, and what the tables of a scene file say.
struct Setup {
    /// [grid]: the rectangle of the background grid, whole cells of --cell-size.
    struct Box {
        Geometry geometry = Geometry::plane_strain;
        bool finite_rotation = true; ///< see Scene
        double left = 0.0, bottom = 0.0, width = 0.0, height = 0.0;
    };
    /// [[bodies]]: filled with particles, or with those of a file.
    enum class Contact { nodes, surface };
    struct Deformable {
        std::string name = "body";
        std::string material = {}; ///< name of one of the materials
        Shape shape = {};
        std::filesystem::path particles = {}; ///< see add_particles(); empty: those of the shape
        Velocity velocity = {};
        std::vector<double> spin = {};       ///< empty, or angular velocity and centre: a velocity besides
        std::vector<double> axial_mode = {}; ///< empty, or speed and length: u = speed sin(pi x/(2 length)) besides
        int particles_per_side = 0;          ///< of a cell; 0: --particles-per-side
        std::string internal = "auto";       ///< internal variable at the start; auto: that of the law
        Contact contact = Contact::nodes;
        double friction = 0.0; ///< on other bodies, of a surface
    };
    /// [[rigid-bodies]]
    struct Rigid {
        std::string name = "rigid";
        Shape shape = {};
        History<Velocity> velocity = {};
        bool holds_x = true, holds_y = true;
        int particles_per_side = 0;
        Contact contact = Contact::nodes;
        double friction = 0.0;           ///< on a surface
        History<double> spin = {};       ///< of a surface
        std::vector<double> centre = {}; ///< that it turns about; empty: the middle of its points
    };
    enum class Take { mean, smallest, largest, sum };
    /// [[observables]]: a column of history.csv, and final_<name> in the summary: factor * quantity + offset.
    struct Measure {
        std::string name;
        std::string quantity; ///< see quantities()
        std::string of = {};  ///< a rigid body, or a body; empty: the first rigid body, or all particles
        Take take = Take::mean;
        double factor = 1.0, offset = 0.0;
    };
    /// [curve]: two columns of history.csv for the terminal.
    struct Curve {
        std::string x = {}, y = {}, x_label = {}, y_label = {};
    };

    Box grid = {};
    Grid::Sides sides = {};
    std::vector<MaterialData> materials = {};
    std::vector<Deformable> bodies = {};
    std::vector<Rigid> rigid_bodies = {};
    /// [[loads]]: on the edges of bodies within a region.
    struct EdgeLoad {
        std::string name = "load";
        std::string body = {}; ///< one of the bodies; empty: all
        Shape region = {};
        History<double> pressure = {};
        History<Velocity> traction = {}; ///< on the area at the start [Pa]
        History<Velocity> force = {};    ///< the whole of it, shared out by area [N, a metre of thickness or a radian]
    };
    std::vector<EdgeLoad> loads = {};
    History<Velocity> acceleration = {}; ///< [body-force], specific [m/s^2]
    std::vector<Measure> observables = {};
    Curve curve = {};
};

/// What a Measure can be of: "time"; of a rigid body "force-x", "displacement-x" and the like; of particles "position-x",
/// "velocity-x", "stress-xx", "density", "internal", "temperature-rise" and the like.
[[nodiscard]] std::vector<std::string> quantities();

/// Reads or writes the tables of a scene file.
void visit(io::Tables& tables, Setup& setup);

/// The scene, its particles, and what is to be seen of it. Throws InputError for what cannot be: names that nothing has, a cell
/// size that does not divide the grid, bodies without particles, and so on.
[[nodiscard]] Problem make_problem(const Setup& setup, const Options& options);

/// --print-config of a program whose own options, declared from here on, decide on `setup`: a scene file.
void writes_scene(io::Program& program, const std::function<Setup()>& setup);

} // namespace ductile::mpm
