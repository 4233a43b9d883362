// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace ductile::io {

using LabelledLines = std::vector<std::pair<std::string, std::string>>;

/// A title and, below it, "label   value" lines with the values aligned: the header and the summary of a run.
[[nodiscard]] std::string aligned_lines(const std::string& title, const LabelledLines& lines);

/// "warning: ..." with a line end. `columns`: of the terminal, 0: whatever its length on one line.
[[nodiscard]] std::string warning_line(const std::string& warning, std::size_t columns = 0);

/// Columns of the terminal that a file descriptor writes to; nothing where it is none.
[[nodiscard]] std::optional<std::size_t> terminal_columns(int descriptor);

/// Every line of `text` broken between words into lines of at most `columns` (words that are longer stay whole), each behind
/// `margin`. A line that begins with spaces keeps them, and what continues it has four more.
[[nodiscard]] std::string wrapped(const std::string& text, std::size_t columns, const std::string& margin = {});

/// "17 B", "3.2 MiB".
[[nodiscard]] std::string human_bytes(double bytes);
/// "0.4 s", "2:05 min", "3:12:45 h"; "-" for what is not finite.
[[nodiscard]] std::string human_duration(double seconds);

} // namespace ductile::io
