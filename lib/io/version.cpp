// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/io/version.hpp>

namespace ductile::io {

std::string version() { return DUCTILE_VERSION; }

} // namespace ductile::io
