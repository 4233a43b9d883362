// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <string>

namespace ductile::io {

/// The version of this library, e.g. "0.1.0".
[[nodiscard]] std::string version();

} // namespace ductile::io
