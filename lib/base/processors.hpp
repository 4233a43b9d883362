// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace ductile {

/// How many processors this process may use at once: those of its affinity (taskset, batch systems, containers), at most what the
/// quota of its control group lasts for, and at most OMP_NUM_THREADS if that is set. At least 1.
[[nodiscard]] int available_processors();

} // namespace ductile
