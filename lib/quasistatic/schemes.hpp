#pragma once
#include <span>

namespace ductile::quasistatic {

/// The time integrators.
enum class Scheme {
    automatic,
    euler,
    substepped,
    incremental,
    extrapolated,
    ralston,
    bogacki_shampine,
    dormand_prince,
    chebyshev,
    arkode_2,
    arkode_3,
    arkode_4,
    arkode_5,
    cvode_adams,
    cvode_bdf,
    ida,
    mri,
};

/// What steps a scheme goes by.
enum class SchemeKind {
    projection,    ///< predictor and projection (Lu & Rycroft)
    index_reduced, ///< our Runge-Kutta methods on the index-reduced method of lines, with an estimate of the error
    sundials,      ///< the same method of lines integrated by SUNDIALS, with the error control of SUNDIALS
};

struct SchemeDescription {
    Scheme scheme;
    SchemeKind kind;
    const char* name;    ///< as users say it
    const char* meaning; ///< one line
    double fields;       ///< numbers a cell that it keeps, about; see TimeStepper::memory_bytes
    int estimate_order;  ///< the power of dt that the estimate of the error falls with; 0 where there is none
};

/// All of them, in the order of the enumeration.
[[nodiscard]] std::span<const SchemeDescription> schemes();
[[nodiscard]] const SchemeDescription& description(Scheme scheme);

} // namespace ductile::quasistatic
