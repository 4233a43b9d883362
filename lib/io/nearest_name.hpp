// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace ductile::io {

/// Changes that make one word of another: a letter more, less or another one, or two neighbours exchanged.
[[nodiscard]] int edit_distance(std::string_view a, std::string_view b);

/// "; did you mean X?" with that of the names which looks like a slip of the pen for `word` or is its continuation; else empty.
[[nodiscard]] std::string did_you_mean(std::string_view word, const std::vector<std::string>& names);

} // namespace ductile::io
