// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: what differs between SUNDIALS 6.4 (Debian 12) and 7.1 (Debian 13). The rest of this folder is written for both.
#include <ductile/base/error.hpp>
#include <ductile/sundials/handles.hpp>

#include <arkode/arkode_erkstep.h>
#include <sundials/sundials_config.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_types.h>
#if SUNDIALS_VERSION_MAJOR >= 7
#include <arkode/arkode.h>
#include <sunadaptcontroller/sunadaptcontroller_soderlind.h>
#endif

#include <array>
#include <cstddef>
#include <fmt/format.h>
#include <limits>
#include <string>

// ARKODE's functions: one set for all of its steppers since 7.1, one a stepper before.
// Messages: kept by the handler of the context since 7, by that of each solver's memory before.
#if SUNDIALS_VERSION_MAJOR >= 7
#define DUCTILE_ERK(function) ARKode##function
#define DUCTILE_MRI(function) ARKode##function
#define DUCTILE_KEEP_MESSAGES(package, memory, kept) ((void)(memory), (void)(kept), 0)
#else
#define DUCTILE_ERK(function) ERKStep##function
#define DUCTILE_MRI(function) MRIStep##function
#define DUCTILE_KEEP_MESSAGES(package, memory, kept) package##SetErrHandlerFn(memory, &::ductile::sundials::keep_message, kept)
#endif

namespace ductile::sundials {

/// A number of components as SUNDIALS counts them, which may be with 32 bits. Throws InputError where they do not suffice.
[[nodiscard]] inline sunindextype index_of(std::size_t components) {
    if (components > static_cast<std::size_t>(std::numeric_limits<sunindextype>::max()))
        throw InputError(fmt::format("SUNDIALS was built for at most {} unknowns; the system has {}",
                                     std::numeric_limits<sunindextype>::max(), components));
    return static_cast<sunindextype>(components);
}

using Context = Owner<SUNContext, free_context>;

/// h_new = h E_n^(-k1/p) E_(n-1)^(k2/p), E_n the bias times the error of step n and p an order of the pair.
struct StepController {
    double k1 = 0.0, k2 = 0.0, bias = 1.0;
    int order_above_embedded = 0; ///< p less the order of the embedded solution: 0, or the difference to that of the method
};

#if SUNDIALS_VERSION_MAJOR >= 7

/// Keeps what SUNDIALS would print.
inline void keep_message(int, const char*, const char*, const char* message, SUNErrCode, void* kept, SUNContext) {
    *static_cast<std::string*>(kept) = message;
}

/// A context that prints nothing; its last error message is written to `kept`, which must outlive it.
[[nodiscard]] inline Context make_context(std::string& kept) {
    SUNContext context = nullptr;
    if (SUNContext_Create(SUN_COMM_NULL, &context) != SUN_SUCCESS)
        throw RunError("SUNDIALS could not create its context");
    Context owner(context);
    if (SUNContext_ClearErrHandlers(context) != SUN_SUCCESS || // the one that is there prints
        SUNContext_PushErrHandler(context, &keep_message, &kept) != SUN_SUCCESS ||
        SUNContext_SetLogger(context, nullptr) != SUN_SUCCESS) // the one that is there prints warnings, to standard output
        throw RunError("SUNDIALS could not set up its context");
    return owner;
}

inline void free_controller(SUNAdaptController controller) { SUNAdaptController_Destroy(controller); }
/// Must outlive the stepper that uses it.
using ControllerMemory = Owner<SUNAdaptController, free_controller>;

/// Returns a flag of ARKODE.
[[nodiscard]] inline int set_controller(void* erk_stepper, SUNContext context, ControllerMemory& memory,
                                        const StepController& c) {
    memory.reset(made(SUNAdaptController_PI(context), "step control"));
    if (SUNAdaptController_SetParams_PI(memory.get(), c.k1, -c.k2) != SUN_SUCCESS)
        return ARK_CONTROLLER_ERR;
    if (const int flag = ARKodeSetAdaptController(erk_stepper, memory.get()); flag != ARK_SUCCESS)
        return flag;
    if (const int flag = ARKodeSetErrorBias(erk_stepper, c.bias); flag != ARK_SUCCESS)
        return flag;
    return ARKodeSetAdaptivityAdjustment(erk_stepper, c.order_above_embedded - 1); // it adds one to the embedded order
}

#else

inline void keep_message(int, const char*, const char*, char* message, void* kept) { *static_cast<std::string*>(kept) = message; }

[[nodiscard]] inline Context make_context(std::string&) {
    SUNContext context = nullptr;
    if (SUNContext_Create(nullptr, &context) != 0)
        throw RunError("SUNDIALS could not create its context");
    return Context(context);
}

struct ControllerMemory {}; // the stepper holds it

[[nodiscard]] inline int set_controller(void* erk_stepper, SUNContext, ControllerMemory&, const StepController& c) {
    constexpr int no_defaults = 0;
    std::array<double, 3> k{c.k1, c.k2, 0.0};
    const int order_of_method = c.order_above_embedded != 0 ? 1 : 0;
    if (const int flag = ERKStepSetAdaptivityMethod(erk_stepper, ARK_ADAPT_PI, no_defaults, order_of_method, k.data());
        flag != ARK_SUCCESS)
        return flag;
    return ERKStepSetErrorBias(erk_stepper, c.bias);
}

#endif

} // namespace ductile::sundials
