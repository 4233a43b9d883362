// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/memory.hpp>
#include <ductile/io/version.hpp>

#include <commit.hpp> // written by every build

#include <fmt/format.h>
#include <fstream>
#include <sys/utsname.h>
#include <thread>

namespace ductile::io {

namespace {

/// As /proc/cpuinfo calls it; the architecture where it does not.
std::string processor() {
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);)
        if (const std::size_t colon = line.find(": "); line.starts_with("model name") && colon != std::string::npos)
            return line.substr(colon + 2);
    utsname system{};
    return ::uname(&system) == 0 ? system.machine : "unknown processor";
}

} // namespace

std::string version() { return DUCTILE_VERSION; }

std::string commit() { return DUCTILE_COMMIT; }

std::string compiler() { return DUCTILE_COMPILER; }

std::string machine() {
    utsname system{};
    const bool known = ::uname(&system) == 0;
    return fmt::format("{}, {} processors, {:.0f} GB, {} {}", processor(), std::thread::hardware_concurrency(),
                       machine_memory_bytes() * 1e-9, known ? system.sysname : "unknown", known ? system.release : "system");
}

} // namespace ductile::io
