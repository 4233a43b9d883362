// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/quasistatic/state.hpp>

#include <array>
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
/// A piece of a step from a to b takes the trapezoidal rule for the rate of plastic strain, the mean of the velocities,
/// v = (v_a + v_b)/2, or, where a scheme knows it (TimeStepper::leaves_velocity_of_middle), the one in the middle of its steps,
/// and for what is carried along, A = -v . grad y as Space::advect() has it, the value in the middle, where y is found with that
/// of the piece before:
///   y_b = y_a + dt (r + A),   A = A(v, y_a + dt (r + A_before)/2),   r = ((r_a + r_b)/2, v).
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
    using Fields = std::array<Field, 3>; // e, u_x, u_y
    [[nodiscard]] static Accumulated view_of(const Fields& y) { return {y[0], y[1], y[2]}; }
    /// The way from y_a to y_b, where `to` is, and what is known at b.
    void lead(const Fields& from, const State& to, Fields& y);
    /// What is known at b becomes what is known at a.
    void turn(const State& at);

    Scene scene_;
    Space& space_;
    bool velocity_of_middle_;
    Fields now_, carried_;          // y at the last end(), and A of the last piece
    Field rate_, next_rate_;        // of plastic strain, r_a and r_b
    bool knows_rate_ = false;       // rate_ is that of now_
    Fields within_, shown_;         // y at the last pass(), and of at(): empty until needed
    const Fields* from_ = nullptr;  // y_a
    double time_ = 0.0;             // at a
    VectorField velocity_, middle_; // v_a, v
    Field velocity_x_, velocity_y_; // v where y lives
    Fields predicted_;
};

} // namespace ductile::quasistatic
