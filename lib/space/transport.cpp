// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/space/transport.hpp>

namespace ductile {

void extrapolate_to_ghost_rows(Field& field) {
    const int last = field.rows() - 1;
    for (const auto& [wall, inward] : {std::pair{0, 1}, std::pair{last, -1}}) {
        const double* first = field.row(wall);
        const double* second = field.row(wall + inward);
        for (int distance = 1; distance <= 2; ++distance) {
            double* ghost = field.row(wall - distance * inward);
            for (int i = 0; i < field.columns(); ++i)
                ghost[i] = first[i] + distance * (first[i] - second[i]);
            field.wrap_row(wall - distance * inward);
        }
    }
}

} // namespace ductile
