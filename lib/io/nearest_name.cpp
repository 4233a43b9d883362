// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/io/nearest_name.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <numeric>

namespace ductile::io {

int edit_distance(std::string_view a, std::string_view b) {
    // rows of the table of distances between the beginnings of a and those of b
    std::vector<int> before_last, last(b.size() + 1), now(b.size() + 1);
    std::iota(last.begin(), last.end(), 0);
    for (std::size_t i = 1; i <= a.size(); ++i) {
        now[0] = static_cast<int>(i);
        for (std::size_t j = 1; j <= b.size(); ++j) {
            now[j] = std::min({last[j] + 1, now[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                now[j] = std::min(now[j], before_last[j - 2] + 1);
        }
        before_last = last;
        last = now;
    }
    return last[b.size()];
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& names) {
    const std::string* nearest = nullptr;
    int smallest = 1 + std::max(1, static_cast<int>(word.size()) / 3);
    for (const std::string& name : names) {
        const bool begins = word.size() >= 3 && name.starts_with(word);
        if (!begins && std::abs(std::ssize(name) - std::ssize(word)) >= smallest)
            continue; // so far apart at least
        const int distance = begins ? 1 : edit_distance(word, name);
        if (distance < smallest) {
            smallest = distance;
            nearest = &name;
        }
    }
    return nearest != nullptr ? fmt::format("; did you mean {}?", *nearest) : "";
}

} // namespace ductile::io
