// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <string>
#include <string_view>

namespace ductile {

/// What a law says of its internal variable, in SI: files, columns, initial fields and error norms ask it.
struct InternalVariable {
    std::string_view name; ///< as files call it, e.g. "effective_temperature"
    std::string_view unit; ///< "K", or "1" without dimension
    double start = 0.0;    ///< where a material begins unless its scene says otherwise
    double scale = 1.0;    ///< a change by this counts as one in error norms
    double lower = 0.0;    ///< the least and the largest value that a material can begin with
    double upper = 0.0;
    double natural_unit = 1.0; ///< the value that the law's own numbers call 1

    [[nodiscard]] double natural_scale() const { return scale / natural_unit; }
    /// Whether a material can begin with this value, in the law's own numbers; NaN is not possible.
    [[nodiscard]] bool can_start_at(double value) const { return value >= lower / natural_unit && value <= upper / natural_unit; }
};

/// Equivalent plastic strain by any measure: it begins at zero, and one per cent counts. Nothing begins with more than 1000 %.
inline constexpr InternalVariable plastic_strain_variable{
    .name = "plastic_strain", .unit = "1", .start = 0.0, .scale = 0.01, .lower = 0.0, .upper = 10.0};

/// The name with its unit, as heads of columns are written: "effective_temperature_K", "plastic_strain".
[[nodiscard]] std::string column_name(const InternalVariable& variable);
/// "effective temperature" for sentences.
[[nodiscard]] std::string spoken_name(const InternalVariable& variable);
/// "from 1 to 21000 K", "from 0 to 10".
[[nodiscard]] std::string describe_range(const InternalVariable& variable);

} // namespace ductile
