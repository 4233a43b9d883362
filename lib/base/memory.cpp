// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/base/memory.hpp>

#include <fmt/format.h>

namespace ductile {

void require_memory(double bytes, const std::string& what, const std::string& remedy) {
    if (const double present = machine_memory_bytes(); !(bytes <= present))
        throw InputError(fmt::format("{}: this needs about {:.3g} GB of memory, this machine has {:.3g} GB: {}", what,
                                     bytes * 1e-9, present * 1e-9, remedy));
}

} // namespace ductile
