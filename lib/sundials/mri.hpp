// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/sundials/initial_value.hpp>

#include <cstddef>
#include <functional>
#include <memory>
#include <span>

namespace ductile::sundials {

/// dy/dt = slow(t, y) + fast(t, y). The functions may throw: the exception comes out of MriIntegrator::integrate.
struct MultirateSystem {
    std::size_t components = 0;
    RightHandSide slow, fast;
    /// Takes `y` over `duration` by dy/dt = forcing + fast(y), with constant forcing.
    std::function<void(double duration, std::span<const double> forcing, std::span<double> y)> advance_fast;
};

/// A large system with slow and fast rates, integrated by SUNDIALS (ARKODE's MRIStep) with the multirate infinitesimal step
/// method of third order of Knoth and Wolke (1998): three slow rates a step, between which the fast rate is integrated under
/// constant forcing. Steps are fixed: SUNDIALS 6 and 7.1 have no others. One object belongs to one thread. Throws RunError when
/// SUNDIALS gives up.
class MriIntegrator {
public:
    explicit MriIntegrator(MultirateSystem system);
    ~MriIntegrator();

    /// Takes `y` from t0 to t1 > t0 in one slow step. `y` is unchanged when it throws.
    void integrate(std::span<double> y, double t0, double t1);

    [[nodiscard]] Counts counts() const; ///< evaluations: of the slow rate

private:
    class Memory;
    std::unique_ptr<Memory> memory_;
};

} // namespace ductile::sundials
