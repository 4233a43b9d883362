// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/time/butcher_tables.hpp>

#include <algorithm>
#include <fmt/format.h>

namespace ductile::time {

std::span<const ButcherTable> butcher_tables() {
    static const std::vector<ButcherTable> tables{
        {.name = "ralston", // Lu & Rycroft, Table A.4
         .meaning = "Ralston (order 2)",
         .order = 2,
         .estimate_order = 2,
         .c = {0, 2. / 3, 1},
         .a = {{}, {2. / 3}, {1. / 4, 3. / 4}},
         .error = {-1. / 12, 5. / 12, -1. / 3},
         .real_stability = 2.0},
        {.name = "bogacki-shampine", // 3(2), 1989
         .meaning = "Bogacki-Shampine (order 3)",
         .order = 3,
         .estimate_order = 3,
         .c = {0, 1. / 2, 3. / 4, 1},
         .a = {{}, {1. / 2}, {0, 3. / 4}, {2. / 9, 1. / 3, 4. / 9}},
         .error = {2. / 9 - 7. / 24, 1. / 3 - 1. / 4, 4. / 9 - 1. / 3, -1. / 8},
         .real_stability = 2.5},
        {.name = "dormand-prince", // 5(4), 1980
         .meaning = "Dormand-Prince (order 5)",
         .order = 5,
         .estimate_order = 5,
         .c = {0, 1. / 5, 3. / 10, 4. / 5, 8. / 9, 1, 1},
         .a = {{},
               {1. / 5},
               {3. / 40, 9. / 40},
               {44. / 45, -56. / 15, 32. / 9},
               {19372. / 6561, -25360. / 2187, 64448. / 6561, -212. / 729},
               {9017. / 3168, -355. / 33, 46732. / 5247, 49. / 176, -5103. / 18656},
               {35. / 384, 0, 500. / 1113, 125. / 192, -2187. / 6784, 11. / 84}},
         .error = {71. / 57600, 0, -71. / 16695, 71. / 1920, -17253. / 339200, 22. / 525, -1. / 40},
         .real_stability = 3.3,
         // Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, II.6
         .quartic = {-12715105075. / 11282082432, 0, 87487479700. / 32700410799, -10690763975. / 1880347072,
                     701980252875. / 199316789632, -1453857185. / 822651844, 69997945. / 29380423}}};
    return tables;
}

const ButcherTable& butcher_table(std::string_view name) {
    const auto tables = butcher_tables();
    const auto found = std::ranges::find(tables, name, &ButcherTable::name);
    if (found == tables.end())
        throw InputError(fmt::format("there is no Runge-Kutta method '{}'", name));
    return *found;
}

} // namespace ductile::time
