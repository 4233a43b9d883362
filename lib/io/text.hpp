#pragma once
#include <string>
#include <utility>
#include <vector>

namespace ductile::io {

using LabelledLines = std::vector<std::pair<std::string, std::string>>;

/// A title and, below it, "label   value" lines with the values aligned: the header and the summary of a run.
[[nodiscard]] std::string aligned_lines(const std::string& title, const LabelledLines& lines);

/// "warning: ..." with a line end.
[[nodiscard]] std::string warning_line(const std::string& warning);

/// "17 B", "3.2 MiB".
[[nodiscard]] std::string human_bytes(double bytes);
/// "0.4 s", "2:05 min", "3:12:45 h"; "-" for what is not finite.
[[nodiscard]] std::string human_duration(double seconds);

} // namespace ductile::io
