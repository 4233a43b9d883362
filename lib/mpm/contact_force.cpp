// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/mpm/contact_force.hpp>

namespace ductile::mpm {

void add_held_force(const ActiveNodes& nodes, double dt, std::span<double> force) {
    for (std::size_t c = 0; c < nodes.mapped.size(); ++c)
        if (nodes.prescribed[c])
            force[c] += nodes.mass[c / 2] * (nodes.mapped[c] - nodes.velocity[c]) / dt;
}

std::array<double, 2> contact_force(const ActiveNodes& nodes, std::span<const double> force, std::int32_t holder) {
    std::array<double, 2> sum{};
    for (const Hold& hold : nodes.holds)
        if (hold.holder == holder) {
            const auto c = static_cast<std::size_t>(hold.component);
            sum[c % 2] += force[c] / nodes.prescribed[c];
        }
    return sum;
}

} // namespace ductile::mpm
