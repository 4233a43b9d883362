#pragma once
#include <ductile/quasistatic/scene.hpp>
#include <ductile/space/staggered.hpp>
#include <ductile/time/system.hpp>

#include <algorithm>
#include <span>

/// Linear combinations of cell states: all that a Runge-Kutta method does between two right-hand sides, one sweep each.
namespace ductile::quasistatic {

/// factor * (all cell fields).
using Term = time::Term<CellState>;

/// A rate that is not complete yet: `fields` hold f of the method of lines; the rate is f + C : D(velocity).
struct OpenRate {
    CellState* fields = nullptr;
    const VectorField* velocity = nullptr;
    double factor = 0.0;
    bool close = true; ///< write the complete rate back to `fields`
};

/// out = sum of terms + open.factor * (f + C : D(v)); images wrapped. `out` may be one of the terms.
void combine(const Scene& scene, std::span<const Term> terms, const OpenRate& open, CellState& out);

/// out = sum of terms; images wrapped.
void combine(const Scene& scene, std::span<const Term> terms, CellState& out);

/// Completes a rate in place: f += C : D(v).
void close_rate(const Scene& scene, const VectorField& velocity, CellState& rate);

/// Norms (59) of a combination.
struct CombinationNorm {
    /// Frobenius norm of the 3 x 3 stress, root mean square over the domain; or, if that is more, the stress that the motion of
    /// walls under force control would make.
    double stress = 0.0;
    double internal = 0.0; ///< root mean square of an internal variable in units of its scale, the largest of all

    [[nodiscard]] double largest() const { return std::max(stress, internal); }
};
[[nodiscard]] CombinationNorm norm(const Scene& scene, std::span<const Term> terms);

} // namespace ductile::quasistatic
