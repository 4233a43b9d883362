// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/ode/rk21.hpp>
#include <ductile/quasistatic/method_of_lines.hpp>
#include <ductile/quasistatic/projection.hpp>
#include <ductile/quasistatic/time_stepper.hpp>
#include <ductile/time/method.hpp>

#include <array>
#include <cmath>
#include <vector>

namespace ductile::quasistatic {

/// The index-reduced method of lines as integrators see it.
///
/// A right-hand side wants a guess of v: the line through the two latest velocities of the sequence v_{n-1}, v_n, stages of the
/// current step.
class RateSystem final : public time::System<CellState> {
public:
    RateSystem(const Scene& scene, Space& space, const PassOptions& passes);

    /// Begins the sequence of velocities of a step, which begin_step() has begun, with v_n and, `earlier_step` before it unless
    /// that is zero, v_{n-1}; both must live through the step.
    void begin_velocities(VectorField& velocity, VectorField& earlier_velocity, double earlier_step);
    /// Of the latest evaluation of the step, or v_n before the first; valid until the next one but two.
    [[nodiscard]] const VectorField& velocity() const { return *sequence_.back().velocity; }
    /// Exchanges it for another's values.
    void swap_velocity(VectorField& other) { std::swap(*sequence_.back().velocity, other); }
    [[nodiscard]] const RateReport& latest() const { return latest_; }
    /// What the walls are told at stage_time(fraction).
    [[nodiscard]] WallRates told(double fraction) const { return scene_.walls.before(stage_time(fraction)); }

    [[nodiscard]] CellState make() const override { return space_.make_cells(); }
    time::OpenRate<CellState> evaluate(CellState& cells, double fraction, CellState& rate) override;
    void close(time::OpenRate<CellState> rate) override;
    void combine(std::span<const time::Term<CellState>> terms, CellState& out) override;
    void combine(std::span<const time::Term<CellState>> terms, time::OpenRate<CellState> rate, double factor,
                 time::Completed completed, CellState& out) override;
    /// The largest of the norms (59) of sigma/s_Y and the internal variables in units of their scales.
    [[nodiscard]] double norm(std::span<const time::Term<CellState>> terms) override;

    /// The packed fields; the energies that pass, a unit of area, and with walls under force control their displacement, as the
    /// stress that it would make, each weighed as much as a field: what weighs less is not solved for by Newton's method.
    [[nodiscard]] std::size_t components() const override { return space_.packed_size() + 3 + walls(); }
    [[nodiscard]] double norm_of_components() const override { return std::sqrt(static_cast<double>(fields())); }
    void pack(const CellState& cells, std::span<double> values) const override;
    void unpack(std::span<const double> values, CellState& cells) const override;

    // what a method may want that does more than integrate rates

    /// Takes the part of the stress that is out of equilibrium away, with itself or with the load of the walls at
    /// stage_time(fraction); `force` is room to work in.
    void put_into_equilibrium(CellState& cells, double fraction, VectorField& force);
    /// K v = force, which v takes the place of.
    void solve(VectorField& force, WallData walls);
    void count_substeps(const Rk21Counts& substeps);

    [[nodiscard]] const Scene& scene() const { return scene_; }
    [[nodiscard]] Space& space() { return space_; }
    /// Unknowns of the walls: two under force control.
    [[nodiscard]] std::size_t walls() const { return scene_.walls.by_traction() ? 2 : 0; }
    [[nodiscard]] MethodOfLines& lines() { return lines_; }
    [[nodiscard]] const MethodOfLines& lines() const { return lines_; }
    [[nodiscard]] StepperCounts counts() const;
    /// Of one velocity field.
    [[nodiscard]] std::size_t velocity_bytes() const { return 2 * stage_velocity_[0].u.storage().size() * sizeof(double); }

private:
    [[nodiscard]] std::size_t fields() const { return 4 + scene_.law->variables().size(); }

    struct TimedVelocity {
        double fraction = 0.0; ///< of the current step
        VectorField* velocity = nullptr;
    };
    void guess_velocity(double fraction, VectorField& guess) const;

    Scene scene_;
    Space& space_;
    MethodOfLines lines_;
    Projection projection_;
    Velocity wall_scale_ = {};                  ///< in a packed state
    double energy_scale_;                       ///< in a packed state
    std::array<VectorField, 3> stage_velocity_; ///< the latest of the current step, in turns
    std::vector<TimedVelocity> sequence_;       ///< in the order of time
    std::size_t stage_ = 0;
    RateReport latest_;
    StepperCounts counts_; ///< of what is not counted elsewhere
};

/// A method on it. Methods keep a reference to the system.
using CellMethod = time::Method<CellState>;

/// SUNDIALS on the index-reduced method of lines (or, IDA, on the system of index 1). CVODE and IDA have no fixed steps, MRIStep
/// no others.
enum class CvodeFormulas { adams, bdf_projected };
[[nodiscard]] std::unique_ptr<CellMethod> make_cvode(RateSystem& system, CvodeFormulas formulas, double tolerance);
[[nodiscard]] std::unique_ptr<CellMethod> make_ida(RateSystem& system, double tolerance);
[[nodiscard]] std::unique_ptr<CellMethod> make_mri(RateSystem& system, double tolerance);

/// Ends a step of SUNDIALS with RunError once the program is asked to end: an attempt may last, and the state before it is kept.
void end_if_interrupted();

} // namespace ductile::quasistatic
