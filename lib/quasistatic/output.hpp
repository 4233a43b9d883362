// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/snapshots.hpp>
#include <ductile/quasistatic/accumulation.hpp>
#include <ductile/quasistatic/scene.hpp>
#include <ductile/quasistatic/state.hpp>
#include <ductile/run/recorder.hpp>

#include <cstdint>
#include <optional>

namespace ductile::quasistatic {

/// What snapshots are drawn on, in metres: the cells of the space or, if `outputs` say so, equal ones.
[[nodiscard]] io::SnapshotGrid snapshot_grid(const Scene& scene, const Space& space, const run::Outputs& outputs);

/// Writes the fields of a state, what follows from them, and what has accumulated, if that is known, in SI, on snapshot_grid().
void write_snapshot(const Scene& scene, Space& space, const State& state, const std::optional<Accumulated>& accumulated,
                    const run::Outputs& outputs, double time_s, std::int64_t step, io::SnapshotWriter& snapshots);

} // namespace ductile::quasistatic
