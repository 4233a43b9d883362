// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/mpm/state.hpp>
#include <ductile/mpm/step_energies.hpp>

#include <nlohmann/json.hpp>

#include <array>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace ductile::mpm {

/// What there is to see after a step, and at the start (dt = 0).
struct Observation {
    const State& state;
    double dt = 0.0; ///< of the step [s]
    std::span<const std::array<double, 2>> contact_forces =
        {};                     ///< of the particles on each rigid body in the step, contact_force()
    StepEnergies energies = {}; ///< of the step
};

/// A number that a scene is about, one more column of history.csv; the name carries the unit.
struct Observable {
    std::string name;
    std::function<double(const Observation&)> value;
};

/// Numbers that a run gathers over all its steps, whichever of them are written, and keeps in its checkpoints.
using Tally = std::map<std::string, std::vector<double>>;

/// What a summary needs of every step, and what it makes of it.
struct Conclusions {
    /// Called at the start, and after every step. It must create at the start whatever it uses.
    std::function<void(const Observation&, Tally&)> observe = {};
    /// Results for summary.json at the end; keys carry units.
    std::function<void(const Observation&, const Tally&, nlohmann::ordered_json& extra)> conclude = {};
};

/// The mean of a quantity over the steps of the last part of a run, wherever that ends: of the steps that end at a time t >=
/// from * (time of the last).
class TrailingMean {
public:
    TrailingMean(std::string name, double from) : name_(std::move(name)), from_(from) {}
    void add(Tally& tally, double time, double value) const;
    [[nodiscard]] double mean(const Tally& tally) const;
    [[nodiscard]] double last(const Tally& tally) const { return tally.at(name_).back(); }

private:
    std::string name_; // in the tally: times and values in turn
    double from_;
};

} // namespace ductile::mpm
