// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/mpm/setup.hpp>

namespace ductile::mpm {

/// The observable that a setup asks for. Throws InputError for a quantity or a body that the setup does not have.
[[nodiscard]] Observable make_observable(const Setup::Measure& measure, const Setup& setup);

} // namespace ductile::mpm
