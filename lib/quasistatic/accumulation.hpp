// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/quasistatic/state.hpp>

#include <string>
#include <utility>
#include <vector>

namespace ductile::quasistatic {

/// What matter has been through since time 0. At cells, [N][M], in natural units.
struct Accumulated {
    const Field& plastic_strain; ///< the equivalent one, as Space::plastic_strain_rate() counts it
    const Field &displacement_x, &displacement_y;
};

/// Integrates the plastic strain e and the displacement u along the steps that a run accepts. Nothing depends on either:
///   de/dt + v . grad e = sqrt(2/3 D^pl : D^pl),   du/dt + v . grad u = v,
/// in the reduced model, Eqs. (57), (58), without v . grad. There u is the way of the cell, in the full model that of the matter
/// which is at x now and was at x - u.
///
/// A piece of a step from a to b takes the trapezoidal rule for the right-hand sides r, and for what is carried along,
/// A = -v . grad y as Space::transport() has it, its value in the middle, where y is found with that of the piece before:
///   y_b = y_a + dt (r + A),   A = A(v, y_a + dt (r + A_before)/2),   r = (r_a + r_b)/2,   v = (v_a + v_b)/2,
/// or, where a scheme knows the velocity in the middle of its steps (TimeStepper::leaves_velocity_of_middle), with that one.
/// A piece is off by O(dt^3), all of them by O(dt^2); a cell that begins or ends to yield within a piece, or a velocity that
/// jumps, adds O(dt^2) once. The plastic strain of matter that never flows is zero exactly, and in the reduced model it never
/// falls.
class Accumulation {
public:
    /// From a state at time 0, whose walls may have moved already: they do where they bear a load from the start on.
    Accumulation(const Scene& scene, Space& space, const State& start, bool velocity_of_middle);

    /// A step begins here; where the velocity of the walls jumps, with that after the jump.
    void begin(const State& state);
    /// The step, which has been accepted, passes here: one piece of it ends, and another begins.
    void pass(const State& state);
    /// What there is at a state between the beginning of the piece and the next one; valid until the next call.
    [[nodiscard]] Accumulated at(const State& state);
    /// The step ends here.
    void end(const State& state);

    /// At the last end().
    [[nodiscard]] Accumulated now() const { return view_of(now_); }
    /// The fields of now(), and what the next step needs to know, by their names in files.
    [[nodiscard]] std::vector<std::pair<std::string, Field*>> named_fields();

private:
    // y, r and A lie in fields of cells that spin leaves alone, so that a space carries them along: e in p, u in q and one more
    [[nodiscard]] static Accumulated view_of(const CellState& y) { return {y.stress.p, y.stress.q, y.internal[0]}; }
    /// The way from y_a to y_b, where `to` is, and what is known at b.
    void lead(const CellState& from, const State& to, CellState& y);
    /// What is known at b becomes what is known at a.
    void turn(const State& at);

    Scene scene_;
    Space& space_;
    bool velocity_of_middle_;
    CellState now_, carried_;         // y at the last end(), and A of the last piece
    CellState rates_, next_rates_;    // r_a, r_b
    bool knows_rates_ = false;        // rates_ are those of now_, but for a velocity that jumps
    CellState within_, shown_;        // y at the last pass(), and of at(): empty until needed
    const CellState* from_ = nullptr; // y_a
    double time_ = 0.0;               // at a
    VectorField velocity_, middle_;   // v_a, v
    CellState room_, predicted_;
    VectorField force_;
};

} // namespace ductile::quasistatic
