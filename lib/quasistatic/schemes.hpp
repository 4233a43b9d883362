// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/quasistatic/method_of_lines.hpp>
#include <ductile/quasistatic/projection_stepper.hpp>
#include <ductile/quasistatic/time_stepper.hpp>

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace ductile::quasistatic {

/// What steps a scheme goes by.
enum class SchemeKind {
    projection,    ///< predictor and projection (Lu & Rycroft)
    index_reduced, ///< our Runge-Kutta methods on the index-reduced method of lines, with an estimate of the error
    sundials,      ///< the same method of lines integrated by SUNDIALS, with the error control of SUNDIALS
};

/// What a scheme is built with; each looks at what it has a use for.
struct SchemeOptions {
    PassOptions passes = {};           ///< of a right-hand side
    double tolerance = 1e-4;           ///< of the error of a step; with SUNDIALS, of one of its own steps
    bool fixed_steps = false;          ///< SUNDIALS: one of its steps a step, without error control
    PointwiseTolerance pointwise = {}; ///< projection schemes
};

/// A time integrator of the quasi-static system. Its name is what users say and files hold.
struct Scheme {
    std::string name = {}, meaning = {}; ///< the meaning in one line
    SchemeKind kind = SchemeKind::projection;
    double fields = 0.0;    ///< numbers a cell that it keeps, about; see TimeStepper::memory_bytes
    int estimate_order = 0; ///< the power of dt that the estimate of the error falls with; 0 where there is none
    enum class Steps { any, fixed, adaptive } steps = Steps::any; ///< which it can take
    int order = 0; ///< of the method, where the estimate falls with a higher power of dt than the error of a run; otherwise 0
    std::function<std::unique_ptr<TimeStepper>(const Scene&, std::unique_ptr<Space>, const SchemeOptions&)> make = {};
    /// The tightest tolerance that runs were seen to keep within a factor of ten (verification/results/tolerance.md, for BDF
    /// stability_grid.md), 0 where there was none that they missed: estimates of high order overlook the corners of a rate where
    /// cell after cell yields, and errors of many short steps add up.
    double kept_tolerance = 0.0;
};

/// All there are, the standard one first. Every table of time::butcher_tables() is one.
[[nodiscard]] std::span<const Scheme> schemes();
/// What the error of a step may be so that that of a run is proportional to `tolerance`. Where a method of order p has an
/// estimate that falls with dt^q, q > p, the error of a run falls with the power p/q of what a step may be off by only: below
/// 1e-3 steps get 1e-3 (tolerance/1e-3)^(q/p).
[[nodiscard]] double step_tolerance(const Scheme& scheme, double tolerance);
/// Throws InputError for a name that none has.
[[nodiscard]] const Scheme& scheme_named(std::string_view name);

/// A stepper with its space. Throws InputError when the scheme has no fixed steps,
/// or no others, but is asked for them.
[[nodiscard]] std::unique_ptr<TimeStepper> make_stepper(std::string_view scheme, const Scene& scene, std::unique_ptr<Space> space,
                                                        const SchemeOptions& options);

} // namespace ductile::quasistatic
