// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: the sweeps over linear combinations of states.
#include <ductile/base/simd.hpp>
#include <ductile/space/space.hpp>

#include <array>
#include <cassert>

namespace ductile {
inline namespace DUCTILE_VECTOR_ABI {

using Term = Space::Term;

constexpr std::size_t most_terms = 10;

[[gnu::DUCTILE_ALWAYS_INLINE]] inline Pack sum_terms(std::span<const Term> terms,
                                                     const std::array<const double*, most_terms>& rows, int i) {
    Pack sum(0.0);
    for (std::size_t m = 0; m < terms.size(); ++m)
        sum = sum + Pack(terms[m].factor) * load(rows[m] + i);
    return sum;
}

/// Row j of one field of the terms.
inline std::array<const double*, most_terms> rows_of(std::span<const Term> terms, int field, int j) {
    assert(terms.size() <= most_terms);
    std::array<const double*, most_terms> rows{};
    for (std::size_t m = 0; m < terms.size(); ++m)
        rows[m] = terms[m].vector->field(field).row(j);
    return rows;
}

constexpr int stress_fields = 4;

/// Those of all stress components.
inline std::array<std::array<const double*, most_terms>, stress_fields> stress_rows_of(std::span<const Term> terms, int j) {
    return {rows_of(terms, 0, j), rows_of(terms, 1, j), rows_of(terms, 2, j), rows_of(terms, 3, j)};
}

/// What a state has beside its fields.
inline void combine_numbers(std::span<const Term> terms, CellState& out) {
    Velocity wall;
    EnergyFlow energy;
    for (const Term& term : terms) {
        wall = wall + term.factor * term.vector->wall;
        energy = energy + term.factor * term.vector->energy;
    }
    out.wall = wall;
    out.energy = energy;
}

/// Row j of `out` from the field number `first` on.
inline void combine_row(std::span<const Term> terms, int first, int j, CellState& out) {
    for (int k = first; k < out.count(); ++k) {
        const auto rows = rows_of(terms, k, j);
        double* const target = out.field(k).row(j);
        for (int i = 0; i < out.field(k).columns(); i += pack_size)
            store(sum_terms(terms, rows, i), target + i);
    }
    out.wrap_row(j);
}

} // namespace DUCTILE_VECTOR_ABI
} // namespace ductile
