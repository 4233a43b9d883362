#pragma once

namespace ductile {

/// Rates of a plasticity model at one point (or one vector of points), in natural units.
template <class V> struct PlasticRates {
    V fluidity; ///< D^pl/sbar: the plastic rate of deformation of Eq. (20) is fluidity * sigma_0
    V internal; ///< rate of the internal variable
};

} // namespace ductile
