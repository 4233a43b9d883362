// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/sundials/integration.hpp>

#include <arkode/arkode.h>
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace ductile::sundials {

namespace {

// The integrators number the failures that users can mend alike.
static_assert(ARK_TOO_MUCH_WORK == CV_TOO_MUCH_WORK && ARK_TOO_MUCH_ACC == CV_TOO_MUCH_ACC && ARK_ERR_FAILURE == CV_ERR_FAILURE &&
              ARK_CONV_FAILURE == CV_CONV_FAILURE && ARK_RHSFUNC_FAIL == CV_RHSFUNC_FAIL &&
              ARK_FIRST_RHSFUNC_ERR == CV_FIRST_RHSFUNC_ERR && ARK_REPTD_RHSFUNC_ERR == CV_REPTD_RHSFUNC_ERR &&
              ARK_UNREC_RHSFUNC_ERR == CV_UNREC_RHSFUNC_ERR);

} // namespace

void check_tolerances(const std::string& who, double relative, double absolute) {
    if (!(relative >= 0.0 && absolute >= 0.0 && relative + absolute > 0.0))
        throw InputError(
            fmt::format("{}: tolerances must not be negative, and one of them must be positive: they are {} (relative) and {}",
                        who, relative, absolute));
}

Integration::Integration(std::string who, FlagName flag_name, RightHandSide f, std::size_t components)
    : who_(std::move(who)), flag_name_(flag_name), f_(std::move(f)), context_(make_context(note_)) {
    if (components == 0)
        throw InputError(fmt::format("{}: a system needs at least one component", who_));
    state_.reset(made(N_VNew_Serial(index_of(components), context_.get()), "vector"));
    N_VConst(0.0, state_.get());
}

std::span<double> Integration::values() const { return view(state_.get()); }

void Integration::begin(std::span<const double> y, double t0, double t1) const {
    if (y.size() != values().size())
        throw InputError(
            fmt::format("{}: a state of {} components was given, the system has {}", who_, y.size(), values().size()));
    if (!(t1 > t0) || !std::isfinite(t1 - t0))
        throw InputError(fmt::format("{}: the interval from {} to {} is empty or not finite", who_, t0, t1));
    std::copy(y.begin(), y.end(), values().begin());
}

std::string Integration::explain(int flag) const {
    switch (flag) {
    case ARK_TOO_MUCH_WORK:
        return "too many steps between two outputs";
    case ARK_TOO_MUCH_ACC:
        return "the tolerances ask for more than double precision has: loosen them";
    case ARK_ERR_FAILURE:
        return "the error test failed again and again, or the step shrank to its minimum: the right-hand side may be "
               "discontinuous or not finite";
    case ARK_CONV_FAILURE:
        return "the nonlinear equations of a step could not be solved: tighten the tolerances, or the right-hand side may be "
               "discontinuous or not finite";
    case ARK_RHSFUNC_FAIL:
    case ARK_FIRST_RHSFUNC_ERR:
    case ARK_REPTD_RHSFUNC_ERR:
    case ARK_UNREC_RHSFUNC_ERR:
        return "the right-hand side is not finite (at a stage of the step; a largest step may help)";
    default:
        break;
    }
    char* const name = flag_name_(flag);
    std::string text = name != nullptr ? name : "no name";
    std::free(name);
    return text;
}

void Integration::call(int flag, std::string_view what) {
    const std::string note = std::exchange(note_, {});
    if (flag < 0)
        throw RunError(fmt::format("SUNDIALS could not {}: {}{}{}", what, explain(flag), note.empty() ? "" : "; ", note));
}

void Integration::check_step(int flag, double t) {
    if (exception_)
        std::rethrow_exception(std::exchange(exception_, nullptr));
    if (flag < 0)
        call(flag, fmt::format("step from t = {:.6g}", t));
}

void Integration::show(const DenseOutput& dense, std::size_t& next, double t, void* memory,
                       int (*interpolate)(void*, sunrealtype, int, N_Vector)) {
    for (; next < dense.times.size() && dense.times[next] <= t; ++next) {
        if (!within_)
            within_.reset(made(N_VClone(state_.get()), "vector"));
        call(interpolate(memory, dense.times[next], 0, within_.get()), "tell what lies within a step");
        dense.show(dense.times[next], view(within_.get()));
    }
}

void Integration::give_up(long long steps, double t) const {
    throw RunError(
        fmt::format("{}: more than {} steps are needed (at t = {:.6g}): loosen the tolerances or allow more", who_, steps, t));
}

int Integration::guarded(std::span<const double> result, const std::function<void()>& callback) {
    try { // an exception must not cross the frames of a C library
        callback();
    } catch (...) {
        exception_ = std::current_exception();
        return -1;
    }
    return std::all_of(result.begin(), result.end(), [](double x) { return std::isfinite(x); }) ? 0 : 1;
}

int Integration::rate(sunrealtype t, N_Vector y, N_Vector rate, void* integration) {
    Integration& self = *static_cast<Integration*>(integration);
    ++self.evaluations_;
    return self.guarded(view(rate), [&] { self.f_(t, view(y), view(rate)); });
}

} // namespace ductile::sundials
