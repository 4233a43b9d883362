// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <string>

namespace ductile {

/// The main memory of this machine [bytes].
[[nodiscard]] double machine_memory_bytes();

/// Throws InputError, "<what>: this needs about ... of memory, this machine has ...: <remedy>", where so many bytes cannot fit:
/// the system would kill the program, or swap out half of the machine.
void require_memory(double bytes, const std::string& what, const std::string& remedy);

} // namespace ductile
