#include <ductile/quasistatic/schemes.hpp>

#include <array>
#include <cstddef>

namespace ductile::quasistatic {

namespace {

using enum SchemeKind;

constexpr std::array table{
    SchemeDescription{Scheme::automatic, index_reduced, "auto", "bogacki-shampine, and chebyshev where plastic flow is stiff",
                      47.0, 3},
    SchemeDescription{Scheme::euler, projection, "euler", "first-order projection, forward Euler", 21.0, 0},
    SchemeDescription{Scheme::substepped, projection, "substepped", "first-order projection, substepped plasticity", 16.0, 0},
    SchemeDescription{Scheme::incremental, projection, "incremental", "second-order incremental projection", 16.0, 0},
    SchemeDescription{Scheme::extrapolated, projection, "extrapolated",
                      "second-order incremental projection, spin and advection extrapolated", 28.0, 0},
    SchemeDescription{Scheme::ralston, index_reduced, "ralston", "index-reduced Ralston (order 2)", 37.0, 2},
    SchemeDescription{Scheme::bogacki_shampine, index_reduced, "bogacki-shampine", "index-reduced Bogacki-Shampine (order 3)",
                      42.0, 3},
    SchemeDescription{Scheme::dormand_prince, index_reduced, "dormand-prince", "index-reduced Dormand-Prince (order 5)", 57.0, 5},
    SchemeDescription{Scheme::chebyshev, index_reduced, "chebyshev", "index-reduced Runge-Kutta-Chebyshev (order 2)", 37.0, 3},
    SchemeDescription{Scheme::arkode_2, sundials, "arkode-2", "index-reduced, ARKODE with Ralston's pair (order 2)", 80.0, 0},
    SchemeDescription{Scheme::arkode_3, sundials, "arkode-3", "index-reduced, ARKODE with Bogacki-Shampine (order 3)", 80.0, 0},
    SchemeDescription{Scheme::arkode_4, sundials, "arkode-4", "index-reduced, ARKODE with Zonneveld (order 4)", 90.0, 0},
    SchemeDescription{Scheme::arkode_5, sundials, "arkode-5", "index-reduced, ARKODE with Dormand-Prince (order 5)", 100.0, 0},
    SchemeDescription{Scheme::cvode_adams, sundials, "cvode-adams", "index-reduced, CVODE with Adams-Moulton formulas", 170.0, 0},
    SchemeDescription{Scheme::cvode_bdf, sundials, "cvode-bdf",
                      "index-reduced, CVODE with backward differentiation and projected steps", 220.0, 0},
    SchemeDescription{Scheme::ida, sundials, "ida", "system of index 1, IDA", 280.0, 0},
    SchemeDescription{Scheme::mri, sundials, "mri", "ARKODE's MRIStep: plastic flow fast, the rest slow (order 3)", 110.0, 0},
};

constexpr bool in_order() {
    for (std::size_t i = 0; i < table.size(); ++i)
        if (static_cast<std::size_t>(table[i].scheme) != i)
            return false;
    return true;
}
static_assert(in_order(), "schemes are described in the order of their enumeration");

} // namespace

std::span<const SchemeDescription> schemes() { return table; }
const SchemeDescription& description(Scheme scheme) { return table[static_cast<std::size_t>(scheme)]; }

} // namespace ductile::quasistatic
