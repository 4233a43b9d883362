// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <string>

namespace ductile::io {

/// The version of this library, e.g. "0.1.0".
[[nodiscard]] std::string version();

/// Of which commit its sources were when it was compiled, with "-dirty" if some had changed since; "unknown" outside a
/// repository.
[[nodiscard]] std::string commit();
/// What it was compiled with, e.g. "GNU 12.2.0, Release, for this processor".
[[nodiscard]] std::string compiler();
/// Where it runs, e.g. "Intel(R) Xeon(R) Processor, 2 processors, 24 GB, Linux 6.1".
[[nodiscard]] std::string machine();

} // namespace ductile::io
