// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/simd.hpp>
#include <ductile/base/threads.hpp>
#include <ductile/space/cells.hpp>
#include <ductile/space/transport.hpp>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace ductile {

CellState::CellState(const Grid& grid, std::size_t variables) : internal(variables) {
    for (int k = 0; k < count(); ++k)
        field(k) = Field(grid.cells_y, grid.cells_x, 2);
}

void extrapolate_to_ghost_rows(CellState& cells) {
    for (int k = 0; k < cells.count(); ++k)
        extrapolate_to_ghost_rows(cells.field(k));
}

namespace {

template <class Pointer> FlowRows<Pointer> rows_of(auto& cells, int j, int i) {
    FlowRows<Pointer> rows{};
    for (int k = 1; k < cells.count(); ++k)
        rows.row[static_cast<std::size_t>(k - 1)] = cells.field(k).row(j) + i;
    return rows;
}

} // namespace

FlowRows<double*> flow_rows(CellState& cells, int j, int i) { return rows_of<double*>(cells, j, i); }
FlowRows<const double*> flow_rows(const CellState& cells, int j, int i) { return rows_of<const double*>(cells, j, i); }

void set_all(Field& field, double value) {
    for (int j = 0; j < field.rows(); ++j)
        std::fill_n(field.row(j), field.columns(), value);
    field.wrap();
}

void copy_values(const Field& from, Field& to) {
    for (int j = 0; j < to.rows(); ++j)
        std::copy_n(from.row(j), to.columns(), to.row(j));
    to.wrap();
}

void combine(std::initializer_list<FieldTerm> terms, Field& out) {
    assert(terms.size() <= 4);
    std::array<FieldTerm, 4> all; // those without a field come to nothing
    all.fill({terms.begin()->field, 0.0});
    std::ranges::copy(terms, all.begin());
    for_each_row({out.rows(), out.columns()}, [&](int j) {
        const double *a = all[0].field->row(j), *b = all[1].field->row(j), *c = all[2].field->row(j), *d = all[3].field->row(j);
        const Pack by_a(all[0].factor), by_b(all[1].factor), by_c(all[2].factor), by_d(all[3].factor);
        double* const target = out.row(j);
        for (int i = 0; i < out.columns(); i += pack_size)
            store(by_a * load(a + i) + by_b * load(b + i) + (by_c * load(c + i) + by_d * load(d + i)), target + i);
        out.wrap_row(j);
    });
}

bool is_finite(const Field& field) {
    for (int j = 0; j < field.rows(); ++j)
        if (!std::all_of(field.row(j), field.row(j) + field.columns(), [](double value) { return std::isfinite(value); }))
            return false;
    return true;
}

double mean_square_difference(const Field& a, const Field& b) {
    double sum = 0.0;
    for (int j = 0; j < a.rows(); ++j)
        for (int i = 0; i < a.columns(); ++i)
            sum += (a(i, j) - b(i, j)) * (a(i, j) - b(i, j));
    return sum / (static_cast<double>(a.rows()) * a.columns());
}

void add_uniform(const StressComponents<double>& change, StressField& stress) {
    for_each_row({stress.p.rows(), stress.p.columns()}, [&](int j) {
        for (const auto& [field, value] : {std::pair{&stress.p, change.p}, std::pair{&stress.s, change.s},
                                           std::pair{&stress.tau, change.tau}, std::pair{&stress.q, change.q}}) {
            for (int i = 0; i < field->columns(); ++i)
                (*field)(i, j) += value;
            field->wrap_row(j);
        }
    });
}

namespace {

/// change(row of a, component, j, row of the target) for every row.
void for_each_component(const VectorField& a, VectorField& target, const auto& change) {
    for_each_row({target.u.rows(), target.u.columns()}, [&](int j) {
        for (const auto component : {&VectorField::u, &VectorField::v})
            change((a.*component).row(j), component, j, (target.*component).row(j));
    });
}

} // namespace

void extrapolate(const VectorField& older, const VectorField& newer, double weight, VectorField& target) {
    for_each_component(older, target, [&](const double* a, auto component, int j, double* row) {
        const double* b = (newer.*component).row(j);
        for (int i = -2; i < target.u.padded_columns() + 3; ++i)
            row[i] = b[i] + weight * (b[i] - a[i]);
    });
}

void add(const VectorField& from, VectorField& to) {
    for_each_component(from, to, [&](const double* f, auto, int, double* row) {
        for (int i = -2; i < to.u.padded_columns() + 3; ++i)
            row[i] += f[i];
    });
}

double largest_component(const VectorField& velocity) {
    double largest = 0.0;
    for (const Field* f : {&velocity.u, &velocity.v})
        for (int j = 0; j < f->rows(); ++j)
            for (int i = 0; i < f->columns(); ++i)
                largest = std::max(largest, std::abs((*f)(i, j)));
    return largest;
}

} // namespace ductile
