// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/mpm/grid.hpp>
#include <ductile/mpm/state.hpp>

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace ductile::mpm {

/// What limits a step.
enum class StepLimit { target, ramp, failed_step, newton_iterations, rigid_travel, contact, end, history_knot };
/// For the progress line.
[[nodiscard]] const char* to_string(StepLimit limit);

/// Chooses the steps: from a first one up to the target by a constant factor (the paper's 20 % ramp), and
/// - no farther than to where a rigid body reaches new nodes: contact, which is looked for at the beginning of a step, would come
///   up to a step late. Always while the body touches nothing, and from there the steps grow anew; in contact where this happens
///   seldom, or with every step or two, so that it would be missed;
/// - about a cell of a rigid body's way at most, and of what its spin moves of its surface: it would pass through what it is to
/// push, without an error;
/// - half as long after a failure;
/// - 0.7 times as long after a step that needed many Newton iterations; no longer after one that needed half as many;
/// - to the end or the next knot of a rigid body's history at most, and exactly there: the rest of a step that was cut so is
///   the next one, and steps fall where they would without.
class StepControl {
public:
    struct Options {
        double target = 0.0; ///< [s]
        double first = 0.0;  ///< [s]
        double growth = 1.2; ///< at most, from step to step
        Grid grid = {};
        bool ends_at_contact = false;
        bool boxes = false;    ///< a rigid body's point reaches the nodes beyond an edge of its cell with its box (GIMP)
        double landing = 1e-9; ///< cells beyond that, from which it holds these nodes
        int many_newton_iterations = 30;
    };
    struct Step {
        double dt = 0.0;
        StepLimit limit = StepLimit::target;
        double planned = 0.0;       ///< its length but for rigid bodies, knots and the end
        bool first_contact = false; ///< it ends where a rigid body that touches nothing reaches new nodes
        double end = 0.0;           ///< the time then: exactly the end or the knot, where it ends there
        bool lands = false;         ///< it ends at the end
    };

    explicit StepControl(const Options& options) : options_(options), plan_{.next = options.first} {}

    /// The next step from state.time towards the end > state.time. A sliver of a step is worth less than a step that
    /// is longer by a millionth.
    [[nodiscard]] Step next(const State& state, double end) const;
    /// `touching`: for each rigid body whether it holds a node that carries mass.
    void accepted(const Step& step, int newton_iterations, std::span<const std::int64_t> touching);
    /// Halves the step; false once it is 2^-30 of the target: then it is no use going on.
    [[nodiscard]] bool failed(const Step& step);

    [[nodiscard]] const Options& options() const { return options_; }
    /// Why the steps are shorter than the target.
    enum class Shortened { by_ramp, by_failure, by_newton_iterations };
    /// What a checkpoint must hold.
    struct Plan {
        double next = 0.0; ///< length of the next step
        double rest = 0.0; ///< of the step that a knot cut, to be taken before; 0: none
        Shortened shortened = Shortened::by_ramp;
        std::vector<std::int64_t> touching = {}; ///< as in accepted(); empty: no body touches anything
    };
    [[nodiscard]] const Plan& plan() const { return plan_; }
    void restore(const Plan& plan) { plan_ = plan; }

private:
    [[nodiscard]] Step by_rigid_bodies(const State& state) const;
    /// A time of which knots and ends of steps that are nearer to each other are one.
    [[nodiscard]] double sliver() const;

    Options options_;
    Plan plan_;
};

/// How long after `time` a point of a rigid body will be the body's first to see the nodes of a cell, and how long the body takes
/// for a cell's way from then on [s]; infinity for bodies at rest, and for what lies beyond the next knot of the history.
struct NewNodes {
    double time = std::numeric_limits<double>::infinity(), interval = std::numeric_limits<double>::infinity();
};
[[nodiscard]] NewNodes time_to_new_nodes(const RigidBody& body, double time, const Grid& grid, double reach, double landing);

} // namespace ductile::mpm
