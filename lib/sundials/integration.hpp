// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: what the wrappers of SUNDIALS' integrators share; it needs the headers of SUNDIALS.
#include <ductile/base/error.hpp>
#include <ductile/sundials/handles.hpp>
#include <ductile/sundials/initial_value.hpp>
#include <ductile/sundials/release.hpp>

#include <cstddef>
#include <exception>
#include <fmt/format.h>
#include <span>
#include <string>
#include <string_view>

namespace ductile::sundials {

/// Throws InputError unless both are zero or positive and one is positive. `who` begins the message.
void check_tolerances(const std::string& who, double relative, double absolute);

/// The initial value problem of an integrator as SUNDIALS sees it: callbacks, context and state vector, and flags that become
/// exceptions. It must not move: its address is the user data of the callbacks.
class Integration {
public:
    using FlagName = char* (*)(long);

    /// `who` begins the messages of errors; `flag_name` is the function of the integrator that names its flags.
    /// Throws InputError unless there are components.
    Integration(std::string who, FlagName flag_name, RightHandSide f, std::size_t components);
    Integration(const Integration&) = delete;
    Integration& operator=(const Integration&) = delete;

    [[nodiscard]] SUNContext context() const { return context_.get(); }
    [[nodiscard]] N_Vector state() const { return state_.get(); }
    [[nodiscard]] std::span<double> values() const;
    /// How often the right-hand side was called.
    [[nodiscard]] long long evaluations() const { return evaluations_; }

    /// Copies `y` in. Throws InputError when its size is wrong or t0 < t1 does not hold.
    void begin(std::span<const double> y, double t0, double t1) const;

    /// Throws RunError for a flag that is an error, with advice and what SUNDIALS would have printed.
    void call(int flag, std::string_view what);
    /// The same for the flag of a step that began at `t`; what the right-hand side threw goes first.
    void check_step(int flag, double t);
    /// Shows what lies before `t`, where the integrator has come to, from the `next` of the times on. `interpolate` is its
    /// function GetDky, of `memory`.
    void show(const DenseOutput& dense, std::size_t& next, double t, void* memory,
              int (*interpolate)(void*, sunrealtype, int, N_Vector));
    [[noreturn]] void give_up(long long steps, double t) const;

    /// Runs a callback that fills `result`: keeps what it throws for check_step(). Returns 0, or the flag that SUNDIALS takes for
    /// a failure: -1 after an exception, 1 (try a shorter step) where the result is not finite.
    int guarded(std::span<const double> result, const std::function<void()>& callback);

    /// The right-hand side, with this object as user data.
    static int rate(sunrealtype t, N_Vector y, N_Vector rate, void* integration);

    /// What SUNDIALS would print: for DUCTILE_KEEP_MESSAGES.
    [[nodiscard]] std::string* note() { return &note_; }

private:
    [[nodiscard]] std::string explain(int flag) const;

    std::string who_;
    FlagName flag_name_;
    RightHandSide f_;
    std::string note_;
    Context context_; // first made, last destroyed
    Owner<N_Vector, N_VDestroy> state_, within_;
    long long evaluations_ = 0;
    std::exception_ptr exception_;
};

} // namespace ductile::sundials
