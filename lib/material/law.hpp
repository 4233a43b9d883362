// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/material/elasticity.hpp>
#include <ductile/material/internal_variable.hpp>
#include <ductile/material/symmetric_tensor.hpp>
#include <ductile/ode/rk21.hpp>

#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace ductile {

/// So many internal variables may a law have.
inline constexpr std::size_t most_variables = 13;

/// Arrays of one batch of points: [0..2] are s, tau, q, [3 + k] is the k-th internal variable.
using Arrays = double* const*;
using ConstArrays = const double* const*;

/// What a law says of one state, for diagnostics.
struct FlowAt {
    double yield_stress = 0.0; ///< of sbar; infinity if there is none
    double fluidity = 0.0;     ///< D^pl/sbar
    double slope = 0.0;        ///< dD^pl/dsbar
    std::vector<double> internal_rates = {};
};

/// Of the rates at a batch of points.
struct FlowSums {
    double relaxation = 0.0;  ///< the largest relaxation rate 2 mu dD^pl/dsbar
    double dissipation = 0.0; ///< sum of sigma : D^pl
};

class FiniteStrain;

/// A material law whose type is forgotten: what both carriers use. It is called once for a row of cells or a run of particles, so
/// that the loops over points are compiled with the law: one of a user's own is as fast as those of the library.
///
/// It is made of a law in rate form (rate_form.hpp) or in step form (step_form.hpp); the other form is derived: a step by
/// backward Euler (viscoplastic.hpp), rates by relaxation towards the law (duvaut_lions.hpp). Or of one at finite strain
/// (finite_strain.hpp), which has neither. Values are in the units that the
/// law was made with: natural ones in a scene of cells, SI for particles. Copies share one immutable object.
class Law {
public:
    class Interface;
    explicit Law(std::shared_ptr<const Interface> law) : law_(std::move(law)) {}

    [[nodiscard]] const Interface* operator->() const { return law_.get(); }

private:
    std::shared_ptr<const Interface> law_;
};

/// The functions of a law. Batches of cells are whole vectors long: their arrays can be read and written up to the next multiple
/// of row_unit values, as those of a Field can.
class Law::Interface {
public:
    virtual ~Interface() = default;

    [[nodiscard]] const IsotropicElasticity& elasticity() const { return elasticity_; }
    [[nodiscard]] std::span<const InternalVariable> variables() const { return variables_; }
    /// Whether correct() hands the trial stress back, always.
    [[nodiscard]] virtual bool linear() const = 0;
    /// The equivalent stress of von Mises at yield without mean stress; infinity if there is none.
    [[nodiscard]] virtual double equivalent_yield_stress(std::span<const double> internal) const = 0;

    /// Its functions if it is one at finite strain, else null; such a law knows deformations, and its rates and steps below throw
    /// std::logic_error.
    [[nodiscard]] virtual const FiniteStrain* finite_strain() const { return nullptr; }
    /// Elastic energy by present volume.
    [[nodiscard]] virtual double stored_energy(const SymmetricTensor& stress, std::span<const double>) const {
        return 0.5 * contraction(stress, elastic_strain(elasticity_, stress));
    }

    // --- rates, Eq. (20): throw std::logic_error for a law whose flow changes the volume, see has_rates()

    /// Whether there is a rate form: cells need one.
    [[nodiscard]] virtual bool has_rates() const = 0;
    /// At sbar > 0.
    [[nodiscard]] virtual FlowAt flow_at(double sbar, std::span<const double> internal) const = 0;
    /// rate += (-2 mu D^pl/sbar (s, tau, q), d(internal)/dt) at one point y = (s, tau, q, internal).
    virtual void add_flow_rate(const double* y, double* rate) const = 0;
    /// The yield stress, of sbar, of `count` points with internal variables internal[0], internal[1], ...
    virtual void yield_stress(int count, ConstArrays internal, double* yield) const = 0;
    /// add_flow_rate() at `count` points, yielding ones.
    virtual FlowSums add_flow_rates(int count, ConstArrays y, Arrays rate) const = 0;
    /// Takes `count` points from y over dt with constant sources, in `end` on entry, to `end`: one forward Euler step, or
    /// RK2(1) substeps of every point that flows. A point whose sbar is below yield at both ends of its straight elastic path
    /// takes none. flow_by_euler() counts nothing. Both return the sum over the points of sigma : (plastic strain), with the
    /// stress in the middle between y and the end.
    virtual double flow_by_euler(int count, ConstArrays y, Arrays end, double dt) const = 0;
    virtual double flow_by_substeps(int count, ConstArrays y, Arrays end, double dt, const Rk21Options& options,
                                    Rk21Counts& counts) const = 0;

    // --- steps of `count` points with internal variables internal[0][i], internal[1][i], ... for i < count

    /// `stress` may be `trial`, and `internal_end` `internal`.
    virtual void correct(std::size_t count, const SymmetricTensor* trial, ConstArrays internal, double dt,
                         SymmetricTensor* stress, Arrays internal_end) const = 0;
    /// The derivative of the corrected stress with respect to the strain increment.
    virtual void tangent(std::size_t count, const SymmetricTensor* trial, ConstArrays internal, double dt,
                         Tangent* tangent) const = 0;
    /// Plane stress: sets strain.zz such that sigma_zz = 0 at the end of a step from `start`: at once where the law stays
    /// elastic, by Newton's method with the consistent tangent otherwise.
    virtual void release_thickness(std::size_t count, const SymmetricTensor* start, ConstArrays internal, double dt,
                                   SymmetricTensor* strain) const = 0;

protected:
    Interface(const IsotropicElasticity& elasticity, std::vector<InternalVariable> variables)
        : elasticity_(elasticity), variables_(std::move(variables)) {}

private:
    IsotropicElasticity elasticity_;
    std::vector<InternalVariable> variables_;
};

} // namespace ductile
