// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/quasistatic/options.hpp>

namespace ductile::quasistatic {

/// The rest of a program once its options are parsed: sets up the scene or restores the state of --restart, checks all input,
/// runs and reports. Returns the exit status. With --accuracy it sets what that leaves to find.
[[nodiscard]] int run_program(const io::Program& program, Options& options);

} // namespace ductile::quasistatic
