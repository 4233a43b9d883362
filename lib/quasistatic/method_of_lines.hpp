// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/quasistatic/scene.hpp>

namespace ductile::quasistatic {

/// Number of velocity passes of a right-hand side.
struct PassOptions {
    int largest = 4;           ///< at most so many elliptic solves a right-hand side
    double tolerance = 1e-6;   ///< error of v/U that is accepted, estimated from the contraction
    double contraction = 0.03; ///< factor by which a pass reduces the error of v, unless the passes show a larger one
};

/// What one right-hand side cost and found.
struct RateReport {
    int solves = 0;
    double velocity_change = 0.0;    ///< largest change of v/U in the last pass
    double largest_relaxation = 0.0; ///< max over cells of 2 mu dD^pl/dsbar [1/t_s]: the stiffness of the plastic flow
    double courant_rate = 0.0;       ///< max of |u|/dx + |v|/dy [1/t_s] in the full model: steps times this are Courant numbers
};

/// The index-reduced method of lines. div sigma = 0 is a linear, constant constraint in which v is the multiplier:
///   f(sigma, chi, v) = spin - advection - C : D^pl        (pointwise; Eqs. 5, 6, 20)
///   K v = -B^T f(sigma, chi, v),  v = wall velocity on the walls, prescribed or (walls.hpp) from the mean of f
///   d sigma/dt = f + C : D(v),   d chi/dt = F - v . grad chi
/// so that d(B^T sigma)/dt = 0 identically for K = B^T C B, and any Runge-Kutta method keeps B^T sigma at round-off.
/// v in f enters through spin and advection only; the fixed point v -> K^-1(-B^T f(v)) contracts by about s_Y/mu = 0.02-0.03.
class MethodOfLines {
public:
    MethodOfLines(const Scene& scene, Space& space, const PassOptions& passes);

    /// Evaluates at the state `cells` (ghost rows are refreshed) with walls that are told `told`. `velocity` holds a guess on
    /// entry (any wall rows) and v on exit; `rate` receives f, all powers, and how the walls move: the caller adds C : D(v) in
    /// its next sweep (combine, close_rate). Throws RunError when f is not finite; `velocity` then holds rubbish.
    RateReport evaluate(CellState& cells, const WallRates& told, VectorField& velocity, CellState& rate);

    /// f alone at a given velocity (wall rows included), without a solve: `rate` receives it, and all powers but that of the
    /// walls.
    void open_rate(CellState& cells, const VectorField& velocity, CellState& rate);

    /// Of an open rate, where force control asks for it.
    [[nodiscard]] MeanTraction mean_of_open(const CellState& rate);

    /// U; zero if all walls that move are under force control.
    [[nodiscard]] double speed_scale() const { return speed_scale_; }
    [[nodiscard]] long long evaluations() const { return evaluations_; }
    [[nodiscard]] long long solves() const { return solves_; }
    [[nodiscard]] double rate_seconds() const { return rate_seconds_; }
    [[nodiscard]] double solve_seconds() const { return solve_seconds_; }

private:
    Scene scene_;
    Space& space_;
    PassOptions passes_;
    VectorField next_velocity_; // force, then the new velocity of a pass
    double speed_scale_;        // U: the largest wall speed that is prescribed
    long long evaluations_ = 0, solves_ = 0;
    double rate_seconds_ = 0.0, solve_seconds_ = 0.0;
};

} // namespace ductile::quasistatic
