// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/tensor.hpp>
#include <ductile/material/law.hpp>
#include <ductile/scene/history.hpp>
#include <ductile/space/field.hpp>

#include <array>
#include <initializer_list>
#include <utility>
#include <vector>

namespace ductile {

/// Energy that has passed through a state since time 0, as the rates of that state say; of a rate, the powers. Energies are those
/// of the whole domain and a unit of thickness. What has passed in equilibrium obeys, at every instant,
///   d(elastic energy)/dt = work - dissipation + transport,
/// because sum sigma : D(v) dA is the power of the walls where B^T sigma vanishes, and spin does no work.
struct EnergyFlow {
    double work = 0.0;        ///< of the walls on what is between them
    double dissipation = 0.0; ///< sum of sigma : D^pl dA
    double transport = 0.0;   ///< sum of -sigma : C^-1 : (v . grad) sigma dA. By the equations it is the elastic energy times div
                              ///< v; what differences make of that is their error

    friend EnergyFlow operator+(const EnergyFlow& a, const EnergyFlow& b) {
        return {a.work + b.work, a.dissipation + b.dissipation, a.transport + b.transport};
    }
    friend EnergyFlow operator*(double factor, const EnergyFlow& e) {
        return {factor * e.work, factor * e.dissipation, factor * e.transport};
    }
    bool operator==(const EnergyFlow&) const = default;
};

/// The fields at cell centres that the constitutive law evolves, or their rates; two ghost rows for transport.
struct CellState {
    StressField stress;          ///< [N][M] each, units of stress
    std::vector<Field> internal; ///< [N][M] each, the law's internal variables
    Velocity wall;               ///< displacement of the upper wall; in a rate, its velocity
    EnergyFlow energy;           ///< in a rate, powers

    CellState() = default;
    CellState(const Grid& grid, std::size_t variables);

    /// Number of fields, in this order: p, s, tau, q, internal variables.
    [[nodiscard]] int count() const { return 4 + static_cast<int>(internal.size()); }
    [[nodiscard]] Field& field(int k) { return const_cast<Field&>(std::as_const(*this).field(k)); }
    [[nodiscard]] const Field& field(int k) const {
        const Field* const parts[] = {&stress.p, &stress.s, &stress.tau, &stress.q};
        return k < 4 ? *parts[k] : internal[static_cast<std::size_t>(k - 4)];
    }
    void wrap_row(int j) {
        for (int k = 0; k < count(); ++k)
            field(k).wrap_row(j);
    }
    void wrap() {
        for (int k = 0; k < count(); ++k)
            field(k).wrap();
    }
};

/// Closes all fields at the walls for the ENO stencil.
void extrapolate_to_ghost_rows(CellState& cells);

/// Row j of s, tau, q and the internal variables from column i on, as a Law takes them.
template <class Pointer> struct FlowRows {
    std::array<Pointer, 3 + most_variables> row;

    operator const Pointer*() const { return row.data(); }
};
[[nodiscard]] FlowRows<double*> flow_rows(CellState& cells, int j, int i = 0);
[[nodiscard]] FlowRows<const double*> flow_rows(const CellState& cells, int j, int i = 0);

// a field at a time; the first three wrap it

void set_all(Field& field, double value);
/// Shapes are equal, ghost rows aside.
void copy_values(const Field& from, Field& to);
struct FieldTerm {
    const Field* field = nullptr;
    double factor = 0.0;
};
/// out = sum of terms, of which there are at most four; `out` may be one of them.
void combine(std::initializer_list<FieldTerm> terms, Field& out);
[[nodiscard]] bool is_finite(const Field& field);
/// Over all cells, which count alike.
[[nodiscard]] double mean_square_difference(const Field& a, const Field& b);

/// Adds the same to the stress of every cell.
void add_uniform(const StressComponents<double>& change, StressField& stress);

/// target = newer + weight (newer - older), images included.
void extrapolate(const VectorField& older, const VectorField& newer, double weight, VectorField& target);
/// The largest magnitude of a component.
[[nodiscard]] double largest_component(const VectorField& velocity);
/// to += from, images included.
void add(const VectorField& from, VectorField& to);

} // namespace ductile
