// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/quasistatic/output.hpp>
#include <ductile/space/field_view.hpp>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace ductile::quasistatic {

namespace {

/// What a snapshot holds beside the state, at cells.
struct Derived {
    explicit Derived(const Grid& grid) {
        for (Field* field : {&magnitude, &von_mises, &xx, &yy, &zz, &plastic_rate, &velocity_x, &velocity_y})
            *field = Field(grid.cells_y, grid.cells_x);
    }

    Field magnitude, von_mises, xx, yy, zz, plastic_rate, velocity_x, velocity_y;
};

Derived derive(const Scene& scene, Space& space, const State& state) {
    Derived derived(scene.grid);
    const StressField& stress = state.cells.stress;
    space.plastic_strain_rate(state.cells, derived.plastic_rate);
    space.at_points(state.velocity, derived.velocity_x, derived.velocity_y);
    for (int j = 0; j < scene.grid.cells_y; ++j)
        for (int i = 0; i < scene.grid.cells_x; ++i) {
            const double p = stress.p(i, j), s = stress.s(i, j), tau = stress.tau(i, j), q = stress.q(i, j);
            derived.magnitude(i, j) = std::sqrt(s * s + tau * tau + 3.0 * q * q); // sbar
            derived.von_mises(i, j) = std::numbers::sqrt3 * derived.magnitude(i, j);
            derived.xx(i, j) = -p + s - q;
            derived.yy(i, j) = -p - s - q;
            derived.zz(i, j) = -p + 2.0 * q;
        }
    return derived;
}

/// Cells and corners of the grid that snapshots are drawn on, by fields of the space.
class Sampling {
public:
    Sampling(const Space& space, int cells_x, int cells_y)
        : cells_(space.interpolation(Space::At::cells, middles(cells_x, space.grid().cells_x),
                                     middles(cells_y, space.grid().cells_y))),
          corners_(space.interpolation(Space::At::nodes, edges(cells_x - 1, cells_x, space.grid().cells_x),
                                       edges(cells_y, cells_y, space.grid().cells_y))) {}

    /// Of the same name, unit and scale.
    [[nodiscard]] Field operator()(const io::SnapshotField& field) const {
        const Interpolation& interpolation = field.centring == io::Centring::cell ? cells_ : corners_;
        return interpolation(field.values.first, field.values.stride, field.values.columns);
    }

private:
    /// From the first to the one numbered `last`.
    [[nodiscard]] static std::vector<double> edges(int last, int parts, int cells) {
        std::vector<double> all;
        for (int k = 0; k <= last; ++k)
            all.push_back(static_cast<double>(k) * cells / parts);
        return all;
    }

    Interpolation cells_, corners_;
};

} // namespace

io::SnapshotGrid snapshot_grid(const Scene& scene, const Space& space, const run::Outputs& outputs) {
    const Grid& g = scene.grid;
    const double unit = scene.units.length;
    if (outputs.snapshot_cells_x > 0)
        return {
            outputs.snapshot_cells_x, outputs.snapshot_cells_y, g.width * unit, g.height * unit, g.x(0) * unit, g.y(0) * unit};
    io::SnapshotGrid grid{g.cells_x, g.cells_y, g.width * unit, g.height * unit, g.x(0) * unit, g.y(0) * unit};
    if (space.rows() == uniform_rows(g))
        return grid;
    for (const double position : space.rows().node)
        grid.y_corner_m.push_back(g.y(position) * unit);
    for (const double position : space.rows().cell)
        grid.y_centre_m.push_back(g.y(position) * unit);
    return grid;
}

void write_snapshot(const Scene& scene, Space& space, const State& state, const std::optional<Accumulated>& accumulated,
                    const run::Outputs& outputs, double time_s, std::int64_t step, io::SnapshotWriter& snapshots) {
    using enum io::Centring;
    const Units& u = scene.units;
    const CellState& cells = state.cells;
    const Derived derived = derive(scene, space, state);
    std::vector fields{io::SnapshotField{"pressure", "Pa", cell, view(cells.stress.p), u.stress},
                       io::SnapshotField{"s", "Pa", cell, view(cells.stress.s), u.stress},
                       io::SnapshotField{"tau", "Pa", cell, view(cells.stress.tau), u.stress},
                       io::SnapshotField{"q", "Pa", cell, view(cells.stress.q), u.stress},
                       io::SnapshotField{"deviatoric_magnitude", "Pa", cell, view(derived.magnitude), u.stress},
                       io::SnapshotField{"von_mises_stress", "Pa", cell, view(derived.von_mises), u.stress},
                       io::SnapshotField{"stress_xx", "Pa", cell, view(derived.xx), u.stress},
                       io::SnapshotField{"stress_yy", "Pa", cell, view(derived.yy), u.stress},
                       io::SnapshotField{"stress_zz", "Pa", cell, view(derived.zz), u.stress},
                       io::SnapshotField{"stress_xy", "Pa", cell, view(cells.stress.tau), u.stress, 0.0, "tau"},
                       io::SnapshotField{"plastic_strain_rate", "1/s", cell, view(derived.plastic_rate), 1.0 / u.time},
                       io::SnapshotField{"velocity_x", "m/s", corner, view(state.velocity.u), u.velocity()},
                       io::SnapshotField{"velocity_y", "m/s", corner, view(state.velocity.v), u.velocity()},
                       io::SnapshotField{"cell_velocity_x", "m/s", cell, view(derived.velocity_x), u.velocity()},
                       io::SnapshotField{"cell_velocity_y", "m/s", cell, view(derived.velocity_y), u.velocity()}};
    if (accumulated) {
        fields.push_back({"accumulated_plastic_strain", "1", cell, view(accumulated->plastic_strain)});
        fields.push_back({"displacement_x", "m", cell, view(accumulated->displacement_x), u.length});
        fields.push_back({"displacement_y", "m", cell, view(accumulated->displacement_y), u.length});
    }
    const auto variables = scene.law->variables();
    for (std::size_t k = 0; k < variables.size(); ++k)
        fields.push_back({std::string(variables[k].name), std::string(variables[k].unit), cell, view(cells.internal[k]),
                          variables[k].natural_unit});
    std::vector<Field> sampled;
    if (outputs.snapshot_cells_x > 0) {
        const Sampling sampling(space, outputs.snapshot_cells_x, outputs.snapshot_cells_y);
        sampled.reserve(fields.size());
        for (io::SnapshotField& field : fields)
            field.values = view(sampled.emplace_back(sampling(field)));
    }
    snapshots.write(time_s, step, fields);
}

} // namespace ductile::quasistatic
