#pragma once
#include <ductile/base/threads.hpp>
#include <ductile/quasistatic/scene.hpp>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

namespace ductile::quasistatic {

/// Cells as one vector without images, field after field, scaled such that the root mean square of all components is sqrt(1/n)
/// times the norm (59) of (stress, internal/scale), n the number of fields: with an absolute tolerance A/sqrt(n) and no relative
/// one, the error test of SUNDIALS bounds that norm by A.
class PackedCells {
public:
    explicit PackedCells(const Scene& scene)
        : columns_(static_cast<std::size_t>(scene.grid.cells_x)),
          rows_(scene.grid.cells_y), scale_{std::sqrt(3.0), std::sqrt(2.0), std::sqrt(2.0), std::sqrt(6.0)} {
        for (const InternalVariable& variable : scene.law->variables())
            scale_.push_back(1.0 / variable.natural_scale());
    }

    [[nodiscard]] std::size_t fields() const { return scale_.size(); }
    [[nodiscard]] std::size_t size() const { return fields() * columns_ * static_cast<std::size_t>(rows_); }

    void pack(const CellState& cells, std::span<double> values) const {
        visit(cells, values, [](const Field& field, int j, double scale, std::span<double> row) {
            std::transform(field.row(j), field.row(j) + row.size(), row.begin(), [=](double x) { return scale * x; });
        });
    }
    void unpack(std::span<const double> values, CellState& cells) const {
        visit(cells, values, [](Field& field, int j, double scale, std::span<const double> row) {
            std::ranges::transform(row, field.row(j), [=](double x) { return x / scale; });
            field.wrap_row(j);
        });
    }

private:
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
};

} // namespace ductile::quasistatic
