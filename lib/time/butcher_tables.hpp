// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <span>
#include <string_view>
#include <vector>

namespace ductile::time {

/// An explicit Runge-Kutta pair, first same as last: the last row of A is b, the last stage is the first of the next step.
struct ButcherTable {
    std::string_view name;    ///< as users say it
    std::string_view meaning; ///< for a list of schemes
    int order = 0;
    int estimate_order = 0;             ///< the estimate of a step's error falls with this power of dt
    std::vector<double> c;              ///< [stages]
    std::vector<std::vector<double>> a; ///< row i has i entries
    std::vector<double> error;          ///< [stages], b - b_embedded
    double real_stability = 0.0;        ///< the method is stable for -real_stability <= dt lambda <= 0
    /// [stages], or none: within a step y is cubic_within() + x^2 (1 - x)^2 dt sum_i quartic_i k_i, of one order more.
    std::vector<double> quartic = {};

    [[nodiscard]] std::size_t stages() const { return c.size(); }
};

/// All there are, of up to eight stages; one more is an entry here.
[[nodiscard]] std::span<const ButcherTable> butcher_tables();
/// Throws InputError for a name that none has.
[[nodiscard]] const ButcherTable& butcher_table(std::string_view name);

} // namespace ductile::time
