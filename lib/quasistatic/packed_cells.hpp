#pragma once
#include <ductile/base/threads.hpp>
#include <ductile/quasistatic/scene.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

namespace ductile::quasistatic {

/// Cells as one vector without images, field after field, scaled such that the root mean square of all components is sqrt(1/n)
/// times the norm (59) of (stress, internal/scale), n the number of fields: with an absolute tolerance A/sqrt(n) and no relative
/// one, the error test of SUNDIALS bounds that norm by A. The displacement of walls under force control comes last, as the stress
/// that it would make, weighed as much as a field.
class PackedCells {
public:
    explicit PackedCells(const Scene& scene)
        : columns_(static_cast<std::size_t>(scene.grid.cells_x)),
          rows_(scene.grid.cells_y), scale_{std::sqrt(3.0), std::sqrt(2.0), std::sqrt(2.0), std::sqrt(6.0)} {
        for (const InternalVariable& variable : scene.law->variables())
            scale_.push_back(1.0 / variable.natural_scale());
        const IsotropicElasticity& c = scene.law->elasticity();
        const double strains = 2.0 / scene.grid.height * std::sqrt(static_cast<double>(columns_) * rows_);
        if (scene.walls.by_traction())
            wall_scale_ = {std::numbers::sqrt2 * c.shear_modulus * strains, c.alpha() * strains};
    }

    [[nodiscard]] std::size_t fields() const { return scale_.size(); }
    [[nodiscard]] std::size_t size() const {
        return fields() * columns_ * static_cast<std::size_t>(rows_) + (has_walls() ? 2 : 0);
    }

    void pack(const CellState& cells, std::span<double> values) const {
        visit(cells, values, [](const Field& field, int j, double scale, std::span<double> row) {
            std::transform(field.row(j), field.row(j) + row.size(), row.begin(), [=](double x) { return scale * x; });
        });
        if (has_walls()) {
            values[size() - 2] = wall_scale_.u * cells.wall.u;
            values[size() - 1] = wall_scale_.v * cells.wall.v;
        }
    }
    void unpack(std::span<const double> values, CellState& cells) const {
        visit(cells, values, [](Field& field, int j, double scale, std::span<const double> row) {
            std::ranges::transform(row, field.row(j), [=](double x) { return x / scale; });
            field.wrap_row(j);
        });
        if (has_walls())
            cells.wall = {values[size() - 2] / wall_scale_.u, values[size() - 1] / wall_scale_.v};
    }

private:
    [[nodiscard]] bool has_walls() const { return wall_scale_.u > 0.0; }

    template <class Cells, class Values, class Action> void visit(Cells& cells, Values values, const Action& action) const {
        const std::size_t field_size = columns_ * static_cast<std::size_t>(rows_);
        for_each_row({rows_, static_cast<int>(columns_)}, [&](int j) {
            for (std::size_t k = 0; k < fields(); ++k)
                action(cells.field(static_cast<int>(k)), j, scale_[k],
                       values.subspan(k * field_size + static_cast<std::size_t>(j) * columns_, columns_));
        });
    }

    std::size_t columns_;
    int rows_;
    std::vector<double> scale_;
    Velocity wall_scale_; ///< zero without force control
};

} // namespace ductile::quasistatic
