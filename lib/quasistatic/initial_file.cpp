// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/hdf5.hpp>
#include <ductile/io/history.hpp>
#include <ductile/quasistatic/initial_file.hpp>
#include <ductile/quasistatic/projection.hpp>
#include <ductile/space/staggered.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace ductile::quasistatic {

namespace {

/// Fields of one shape by their names, row after row.
struct Fields {
    int rows = 0, columns = 0;
    std::vector<double> places = {}; ///< of the rows, in units of their mean height from the wall on; empty: of equal height
    std::map<std::string, std::vector<double>> values = {};
};

/// Where the rows of a file of snapshots lie.
std::vector<double> places_of_rows(const std::filesystem::path& path, const io::Hdf5File& file, int rows) {
    const std::vector<double> corners = file.read_doubles("grid/y_corner");
    std::vector<double> places = file.read_doubles("grid/y_centre");
    const bool rising = std::ranges::is_sorted(places) && !corners.empty() && corners.back() > corners.front();
    if (!rising || std::ssize(places) != rows)
        throw InputError(
            fmt::format("{}: grid/y_centre must rise and have a value for each of the {} rows", path.string(), rows));
    const double height = corners.back() - corners.front();
    bool equal = true;
    for (std::size_t j = 0; j < places.size(); ++j) {
        places[j] = (places[j] - corners.front()) / height * rows;
        equal = equal && std::abs(places[j] - (static_cast<double>(j) + 0.5)) < 1e-9 * rows;
    }
    return equal ? std::vector<double>{} : places;
}

Fields read_hdf5(const std::filesystem::path& path, const std::vector<std::string>& names) {
    const io::Hdf5File file = io::Hdf5File::open(path);
    std::string folder;
    if (file.contains("snapshots")) {
        const std::vector<std::string> snapshots = file.members("snapshots");
        if (snapshots.empty())
            throw InputError(fmt::format("{}: it has no snapshot", path.string()));
        folder = "snapshots/" + snapshots.back() + "/";
    }
    Fields fields;
    for (const std::string& name : names) {
        if (!file.contains(folder + name))
            continue;
        const std::vector<std::size_t> shape = file.shape(folder + name);
        const bool same = fields.values.empty() || (shape.size() == 2 && static_cast<int>(shape[0]) == fields.rows &&
                                                    static_cast<int>(shape[1]) == fields.columns);
        if (shape.size() != 2 || shape[0] == 0 || shape[1] == 0 || !std::in_range<int>(shape[0]) ||
            !std::in_range<int>(shape[1]) || !same)
            throw InputError(
                fmt::format("{}: '{}' must have rows and columns, as many as the other fields", path.string(), name));
        fields.rows = static_cast<int>(shape[0]);
        fields.columns = static_cast<int>(shape[1]);
        std::vector<double>& values = fields.values[name];
        values.resize(shape[0] * shape[1]);
        file.read(folder + name, {values.data(), fields.rows, fields.columns, fields.columns});
    }
    if (file.contains("grid/y_corner") && file.contains("grid/y_centre"))
        fields.places = places_of_rows(path, file, fields.rows);
    return fields;
}

Fields read_csv(const Scene& scene, const std::filesystem::path& path, const std::vector<std::string>& names) {
    const io::HistoryTable table = io::read_table(path);
    const auto has = [&](const std::string& name) { return std::ranges::find(table.columns, name) != table.columns.end(); };
    if (!has("x") || !has("y"))
        throw InputError(fmt::format("{}: it lacks the columns x and y of the cell centres", path.string()));
    const std::vector<double> x = table.column("x"), y = table.column("y");
    Fields fields;
    while (fields.columns < static_cast<int>(y.size()) && y[static_cast<std::size_t>(fields.columns)] == y.front())
        ++fields.columns;
    fields.rows = fields.columns > 0 ? static_cast<int>(y.size()) / fields.columns : 0;
    if (y.empty() || y.size() != static_cast<std::size_t>(fields.rows) * static_cast<std::size_t>(fields.columns))
        throw InputError(
            fmt::format("{}: its {} cells are no rows of equal length: give all cells, row after row, those of a row "
                        "with the same y",
                        path.string(), y.size()));
    const double length = scene.units.length;
    for (std::size_t k = 0; k < x.size(); ++k) {
        const int j = static_cast<int>(k) / fields.columns, i = static_cast<int>(k) % fields.columns;
        const double cell_x = scene.grid.width * length / fields.columns, cell_y = scene.grid.height * length / fields.rows;
        const double there_x = (i + 0.5) * cell_x - 0.5 * scene.grid.width * length;
        const double there_y = (j + 0.5) * cell_y - 0.5 * scene.grid.height * length;
        if (!(std::abs(x[k] - there_x) < 1e-3 * cell_x && std::abs(y[k] - there_y) < 1e-3 * cell_y))
            throw InputError(
                fmt::format("{}: row {} lies at ({:g}, {:g}) m; of {} x {} cells of the domain it would be the centre "
                            "at ({:g}, {:g}) m: give all cells, row after row from the lower left, the origin in the "
                            "middle",
                            path.string(), k + 1, x[k], y[k], fields.columns, fields.rows, there_x, there_y));
    }
    for (const std::string& name : names)
        if (has(name))
            fields.values[name] = table.column(name);
    return fields;
}

/// The number of the row at a place, a fraction between two rows.
double row_at(const Fields& fields, double place) {
    if (fields.places.empty())
        return place - 0.5;
    const auto above = std::ranges::upper_bound(fields.places, place);
    if (above == fields.places.begin() || above == fields.places.end())
        return above == fields.places.begin() ? 0.0 : fields.rows - 1.0;
    const auto below = above - 1;
    return static_cast<double>(below - fields.places.begin()) + (place - *below) / (*above - *below);
}

/// Bilinear, times a factor; images included.
void interpolate(const Fields& from, const std::vector<double>& values, double factor, const RowSpacing& rows, Field& to) {
    const auto value = [&](int i, int j) {
        const int row = std::clamp(j, 0, from.rows - 1), column = (i + from.columns) % from.columns;
        return values[static_cast<std::size_t>(row) * static_cast<std::size_t>(from.columns) + static_cast<std::size_t>(column)];
    };
    for (int j = 0; j < to.rows(); ++j) {
        const double y = row_at(from, rows.cell[static_cast<std::size_t>(j)] * from.rows / to.rows());
        const int low = static_cast<int>(std::floor(y));
        for (int i = 0; i < to.columns(); ++i) {
            const double x = (i + 0.5) * from.columns / to.columns() - 0.5;
            const int left = static_cast<int>(std::floor(x));
            const double a = x - left, b = y - low;
            to(i, j) = factor * ((1.0 - b) * ((1.0 - a) * value(left, low) + a * value(left + 1, low)) +
                                 b * ((1.0 - a) * value(left, low + 1) + a * value(left + 1, low + 1)));
        }
        to.wrap_row(j);
    }
}

} // namespace

FileStart start_from_file(const Scene& scene, Space& space, const std::filesystem::path& path) {
    const InternalVariable variable = scene.law->variables().front();
    const std::string internal(variable.name);
    const std::vector<std::string> names = {internal, "pressure", "s", "tau", "q"};
    const bool hdf5 = path.extension() == ".h5" || path.extension() == ".hdf5";
    const Fields fields = hdf5 ? read_hdf5(path, names) : read_csv(scene, path, names);
    if (!fields.values.contains(internal))
        throw InputError(fmt::format("{}: it lacks the field '{}'", path.string(), internal));
    for (const auto& [name, values] : fields.values)
        if (!std::ranges::all_of(values, [](double value) { return std::isfinite(value); }))
            throw InputError(fmt::format("{}: '{}' has a value that is not finite", path.string(), name));
    if (fields.values.size() != 1 && fields.values.size() != names.size())
        throw InputError(fmt::format("{}: a stress needs all of pressure, s, tau and q", path.string()));

    Field start(scene.grid.cells_y, scene.grid.cells_x);
    interpolate(fields, fields.values.at(internal), 1.0 / variable.natural_unit, space.rows(), start);
    for (int j = 0; j < start.rows(); ++j)
        for (int i = 0; i < start.columns(); ++i)
            if (!variable.can_start_at(start(i, j)))
                throw InputError(fmt::format("{}: the {} is {:.6g} at cell ({}, {}): it must be {}", path.string(),
                                             spoken_name(variable), start(i, j) * variable.natural_unit, i, j,
                                             describe_range(variable)));
    FileStart result{.state = initial_state(scene, space, start)};
    if (fields.values.size() == 1)
        return result;
    CellState& cells = result.state.cells;
    cells.wall = {};
    const double inverse = 1.0 / scene.units.stress;
    for (const auto& [name, field] : {std::pair{"pressure", &cells.stress.p}, std::pair{"s", &cells.stress.s},
                                      std::pair{"tau", &cells.stress.tau}, std::pair{"q", &cells.stress.q}})
        interpolate(fields, fields.values.at(name), inverse, space.rows(), *field);
    result.correction = put_into_equilibrium(scene, space, 0.0, cells);
    cells.energy = {}; // it starts from there
    return result;
}

} // namespace ductile::quasistatic
