#pragma once
#include <ductile/quasistatic/combination.hpp>
#include <ductile/quasistatic/schemes.hpp>

#include <functional>
#include <memory>

namespace ductile::quasistatic {

/// What a Runge-Kutta method works on: the fields of its stepper and the right-hand side.
struct Stages {
    const Scene& scene;
    CellState& start;        ///< y_n
    CellState& start_rate;   ///< its complete rate
    CellState& next;         ///< receives y_{n+1}
    CellState& next_rate;    ///< receives its complete rate
    double relaxation = 0.0; ///< of the flow at y_n
    /// f at a state of stage time t_n + fraction dt; returns the velocity that completes it, valid until the next call but two.
    std::function<const VectorField&(CellState& cells, double fraction, CellState& rate)> evaluate;
};

/// An explicit Runge-Kutta method whose last stage is the new state (first same as last), with an embedded error estimate.
class EmbeddedMethod {
public:
    virtual ~EmbeddedMethod() = default;

    [[nodiscard]] virtual Scheme scheme() const = 0;
    /// Makes a step of length dt; returns the norm of its estimated error.
    [[nodiscard]] virtual CombinationNorm advance(const Stages& stages, double dt) = 0;
    /// The longest step that the method holds stable when the plastic flow relaxes at `relaxation`.
    [[nodiscard]] virtual double relaxation_step(double relaxation) const = 0;
    /// The longest Courant number |u| dt/dx + |v| dt/dy of stable advection. The shortest wave of the one-sided differences of
    /// Eq. (4) decays at 4 times the Courant rate.
    [[nodiscard]] virtual double courant_number() const = 0;
    /// Right-hand sides of a step of length dt, where it may be that long.
    [[nodiscard]] virtual double evaluations(double dt, double relaxation) const = 0;
    /// Number of cell states the method itself keeps.
    [[nodiscard]] virtual int buffers() const = 0;
};

/// Scheme::ralston (Lu & Rycroft's Table A.4), bogacki_shampine (3(2), 1989) or dormand_prince (5(4), 1980).
[[nodiscard]] std::unique_ptr<EmbeddedMethod> runge_kutta_method(Scheme scheme, const Scene& scene);

/// Scheme::chebyshev: the stabilised Runge-Kutta-Chebyshev method of second order (Sommeijer, Shampine & Verwer 1998); the number
/// of stages follows the relaxation rate of the plastic flow.
[[nodiscard]] std::unique_ptr<EmbeddedMethod> chebyshev_method(const Scene& scene);

} // namespace ductile::quasistatic
