// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/snapshots.hpp>
#include <ductile/quasistatic/scene.hpp>
#include <ductile/quasistatic/state.hpp>

#include <cstdint>

namespace ductile::quasistatic {

/// Writes the fields of a state, and what follows from them, in SI. The plastic strain rate is the equivalent one,
/// sqrt(2/3 D^pl : D^pl): with the stress of von Mises it makes the plastic power.
void write_snapshot(const Scene& scene, Space& space, const State& state, double time_s, std::int64_t step,
                    io::SnapshotWriter& snapshots);

} // namespace ductile::quasistatic
