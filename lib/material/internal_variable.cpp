// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/material/internal_variable.hpp>

#include <algorithm>
#include <fmt/format.h>

namespace ductile {

std::string column_name(const InternalVariable& variable) {
    return variable.unit == "1" ? std::string(variable.name) : fmt::format("{}_{}", variable.name, variable.unit);
}

std::string spoken_name(const InternalVariable& variable) {
    std::string name(variable.name);
    std::ranges::replace(name, '_', ' ');
    return name;
}

std::string describe_range(const InternalVariable& variable) {
    return fmt::format("from {:g} to {:g}{}{}", variable.lower, variable.upper, variable.unit == "1" ? "" : " ",
                       variable.unit == "1" ? "" : variable.unit);
}

} // namespace ductile
