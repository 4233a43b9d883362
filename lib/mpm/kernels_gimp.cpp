// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/mpm/kernels.hpp>

namespace ductile::mpm {

template std::unique_ptr<Discretisation> make_kernels<Gimp>(const Scene&, bool);

} // namespace ductile::mpm
