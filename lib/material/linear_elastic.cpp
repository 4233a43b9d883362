// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/material/linear_elastic.hpp>
#include <ductile/material/make_law.hpp>

namespace ductile {

Law linear_elastic_law(const IsotropicElasticity& elasticity) { return make_law(LinearElastic(elasticity)); }

} // namespace ductile
