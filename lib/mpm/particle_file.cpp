// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/hdf5.hpp>
#include <ductile/io/history.hpp>
#include <ductile/io/nearest_name.hpp>
#include <ductile/mpm/particle_file.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <map>

namespace ductile::mpm {

namespace {

std::map<std::string, std::vector<double>> read_columns(const std::filesystem::path& path) {
    std::map<std::string, std::vector<double>> columns;
    if (path.extension() == ".h5" || path.extension() == ".hdf5") {
        const io::Hdf5File file = io::Hdf5File::open(path);
        for (const std::string& name : file.members("/"))
            columns[name] = file.read_doubles(name);
    } else {
        const io::HistoryTable table = io::read_table(path);
        for (const std::string& name : table.columns)
            columns[name] = table.column(name);
    }
    return columns;
}

} // namespace

void add_particles(Particles& particles, const Body& body, const std::filesystem::path& path, const Scene& scene) {
    const std::map<std::string, std::vector<double>> columns = read_columns(path);
    const auto refuse = [&](const std::string& what) { throw InputError(fmt::format("{}: {}", path.string(), what)); };
    const std::vector<std::string> known = {"x",         "y",         "volume",    "velocity_x", "velocity_y",
                                            "stress_xx", "stress_yy", "stress_zz", "stress_xy",  "internal"};
    for (const char* name : {"x", "y", "volume"})
        if (!columns.contains(name))
            refuse(fmt::format("it lacks the column '{}': particles have x, y and volume", name));
    const std::size_t count = columns.at("x").size(), first = particles.size();
    for (const auto& [name, values] : columns) {
        if (std::ranges::find(known, name) == known.end())
            refuse(fmt::format("there is no quantity '{}'{}; there are {}", name, io::did_you_mean(name, known),
                               fmt::join(known, ", ")));
        if (values.size() != count)
            refuse(fmt::format("it has {} values of x, and {} of {}", count, values.size(), name));
    }
    if (count == 0)
        refuse("it has no particle");
    const std::int64_t number = first == 0 ? 0 : *std::max_element(particles.body.begin(), particles.body.end()) + 1;
    const std::vector<double> internal = starts_of(body, scene);
    const auto variables = scene.materials[static_cast<std::size_t>(body.material)].law->variables();
    if (scene.materials[static_cast<std::size_t>(body.material)].law->finite_strain())
        for (const auto& [name, values] : columns)
            if (name.starts_with("stress_") && std::ranges::any_of(values, [](double stress) { return stress != 0.0; }))
                refuse(
                    fmt::format("it has the stress '{}', and the law of its material, one at finite strain, begins undeformed: "
                                "leave stresses out, or take a law in rate form",
                                name));
    if (columns.contains("internal")) {
        if (internal.empty())
            refuse("it has internal variables, and the law of its material has none");
        for (const double value : columns.at("internal"))
            if (!variables.front().can_start_at(value))
                refuse(fmt::format("the {} is {}: it must be {}", spoken_name(variables.front()), value,
                                   describe_range(variables.front())));
    }
    particles.provide_internal(internal.size());
    if (scene.affine)
        particles.provide_affine();
    particles.resize(first + count);
    const auto fill = [&](aligned_vector<double>& array, const char* name, double standard) {
        const auto found = columns.find(name);
        for (std::size_t k = 0; k < count; ++k)
            array[first + k] = found == columns.end() ? standard : found->second[k];
    };
    fill(particles.x, "x", 0.0);
    fill(particles.y, "y", 0.0);
    fill(particles.velocity_x, "velocity_x", body.velocity_x);
    fill(particles.velocity_y, "velocity_y", body.velocity_y);
    fill(particles.stress_xx, "stress_xx", 0.0);
    fill(particles.stress_yy, "stress_yy", 0.0);
    fill(particles.stress_zz, "stress_zz", 0.0);
    fill(particles.stress_xy, "stress_xy", 0.0);
    for (std::size_t k = 0; k < internal.size(); ++k)
        fill(particles.internal[k], k == 0 ? "internal" : "", internal[k]);
    for (std::size_t k = 0, p = first; k < count; ++k, ++p) {
        const double volume = columns.at("volume")[k];
        if (!(volume > 0.0 && std::isfinite(volume)))
            refuse(fmt::format("particle {} has the volume {} m^3: it must be positive and finite", k, volume));
        const double half = 0.5 * std::sqrt(scene.geometry == Geometry::axisymmetric ? volume / particles.x[p] : volume);
        particles.density[p] = body.density;
        particles.mass[p] = body.density * volume;
        particles.half_width[p] = particles.half_height[p] = half;
        particles.material[p] = body.material;
        particles.body[p] = number;
        particles.id[p] = static_cast<std::int64_t>(p);
    }
}

} // namespace ductile::mpm
