// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/processors.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sched.h>
#include <string>
#include <string_view>
#include <thread>

namespace ductile {
namespace {

constexpr int unlimited = std::numeric_limits<int>::max();

int by_affinity() {
    cpu_set_t set;
    CPU_ZERO(&set);
    // fails on machines of more than 1024 processors
    return sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : static_cast<int>(std::thread::hardware_concurrency());
}

/// The smallest quota of the control group (version 2) and those above it, in whole processors.
int by_quota() {
    std::ifstream groups("/proc/self/cgroup");
    int smallest = unlimited;
    for (std::string line; std::getline(groups, line);) {
        if (!line.starts_with("0::/"))
            continue;
        const std::filesystem::path root = "/sys/fs/cgroup";
        for (std::filesystem::path group = line.substr(4);; group = group.parent_path()) {
            std::ifstream file(root / group / "cpu.max");
            double quota = 0.0, period = 0.0; // "max 100000" without a quota
            if (file >> quota >> period && period > 0.0)
                smallest = std::min(smallest, static_cast<int>(std::ceil(quota / period)));
            if (group.empty())
                break;
        }
    }
    return smallest;
}

int by_environment() {
    const char* const text = std::getenv("OMP_NUM_THREADS"); // a number, or one for each level: "4,2"
    int count = 0;
    if (text != nullptr)
        std::from_chars(text, text + std::string_view(text).size(), count);
    return count >= 1 ? count : unlimited;
}

} // namespace

int available_processors() { return std::max(1, std::min({by_affinity(), by_quota(), by_environment()})); }

} // namespace ductile
