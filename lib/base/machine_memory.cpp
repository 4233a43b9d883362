// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/memory.hpp>

#include <unistd.h>

namespace ductile {

double machine_memory_bytes() {
    return static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

} // namespace ductile
