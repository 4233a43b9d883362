// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/quasistatic/options.hpp>
#include <ductile/quasistatic/state.hpp>

#include <algorithm>
#include <array>
#include <functional>
#include <string>
#include <vector>

/// How fine elements must be, and how tight a tolerance, for an error that is asked for (--accuracy).
///
/// Runs without outputs to the end of the scene, each half as fine again as the one before, are compared at the same places. With
/// d_k the difference of the ends of the runs k - 1 and k, whose points are f_k times as dense as at first, errors
///   e_k = A f_k^-p,   d_k = e_{k-1} - e_k,
/// are fitted to two differences in a row. Errors of smooth fields fall faster and faster, so that this rather overestimates
/// them. The run that is made for its outputs is as fine as half of what was asked for needs; its difference from the run before
/// estimates its own error. Nothing is believed before differences have fallen three times in a row. The error of the steps is
/// the difference that an eighth of the tolerance makes, on few points at first, in the end on those of the last comparison;
/// added.
namespace ductile::quasistatic {

/// Errors at the end: root mean squares of sigma/s_Y in the norm (59), of the internal variables in their scales and of the
/// velocity over the largest of the walls, and the larger traction over s_Y.
struct EndErrors {
    double stress = 0.0, internal = 0.0, velocity = 0.0, traction = 0.0;

    [[nodiscard]] double largest() const { return std::max({stress, internal, velocity, traction}); }
    friend EndErrors operator+(const EndErrors& a, const EndErrors& b) {
        return {a.stress + b.stress, a.internal + b.internal, a.velocity + b.velocity, a.traction + b.traction};
    }
    friend EndErrors operator*(double factor, const EndErrors& e) {
        return {factor * e.stress, factor * e.internal, factor * e.velocity, factor * e.traction};
    }
};

/// The end of a run at places that do not depend on its points.
struct EndState {
    EndState() = default;
    /// `speed` is the unit of velocities: the largest of the walls; at least the largest there is at the end is taken.
    EndState(const Scene& scene, Space& space, const State& state, double speed);

    std::vector<Field> stress, internal, velocity; ///< p, s, tau, q; in units of their scales; u, v
    MeanTraction traction;
    double speed = 0.0;
};
[[nodiscard]] EndErrors difference(const EndState& a, const EndState& b);
/// What to warn of where errors exceed what was asked for, or do not fall and are infinite; empty where they do not exceed it.
[[nodiscard]] std::string missed_accuracy(const EndErrors& errors, double asked);

/// How fine three runs in a row are, and how large the differences of neighbours.
struct Refinement {
    std::array<double, 3> fineness = {};
    std::array<double, 2> differences = {};

    /// p; 0 where differences do not fall.
    [[nodiscard]] double power() const;
    /// The error of the last run over the last difference; infinity where differences do not fall.
    [[nodiscard]] double error_of_last() const;
    /// How many times as fine the last run must be for an error that is smaller by this factor.
    [[nodiscard]] double refinement_for(double factor) const;
};

/// Elements found for an accuracy.
class Resolution {
public:
    /// Sets --space, --cells and --tolerance. `integrate` makes a run of options and may throw what runs throw; `say` gets a line
    /// about each. Throws InputError for options that leave nothing to choose, RunError where errors do not fall.
    Resolution(Options& options, const std::function<EndState(const Options&)>& integrate,
               const std::function<void(const std::string&)>& say);

    /// Of the run that was made with them.
    [[nodiscard]] EndErrors errors(const EndState& end) const;

private:
    struct Run {
        io::CellCount points;
        double fineness = 1.0;
        EndState end = {};
    };
    /// Points `factor` times as dense.
    [[nodiscard]] Run refined(const Run& run, double factor) const;
    /// Of runs[k], k > 1.
    [[nodiscard]] Refinement refinement(std::size_t k) const;

    int degree_;
    std::vector<Run> runs_;              // those made without outputs, and the one to come
    std::vector<EndErrors> differences_; // of neighbours among the first
    EndErrors in_time_ = {};             // of the steps
};

} // namespace ductile::quasistatic
