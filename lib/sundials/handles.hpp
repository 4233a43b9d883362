// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: owners of what SUNDIALS makes; it needs the headers of SUNDIALS.
#include <ductile/base/error.hpp>

#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_nvector.h>

#include <cstddef>
#include <fmt/format.h>
#include <memory>
#include <span>
#include <type_traits>

namespace ductile::sundials {

template <auto release> struct Deleter {
    template <class T> void operator()(T* p) const { release(p); }
};
/// Owns a handle of the C library, which is a pointer.
template <class Handle, auto release> using Owner = std::unique_ptr<std::remove_pointer_t<Handle>, Deleter<release>>;

inline void free_context(SUNContext context) { SUNContext_Free(&context); }

/// A handle that was made, or RunError naming what could not be.
template <class Handle> Handle* made(Handle* handle, const char* what) {
    if (handle == nullptr)
        throw RunError(fmt::format("SUNDIALS could not create its {}: memory is short or its arguments are wrong", what));
    return handle;
}

/// The components of a serial vector.
[[nodiscard]] inline std::span<double> view(N_Vector v) {
    return {N_VGetArrayPointer(v), static_cast<std::size_t>(N_VGetLength(v))};
}

} // namespace ductile::sundials
