// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/array_view.hpp>
#include <ductile/space/field.hpp>

namespace ductile {

/// A field as files see it: without images and ghost rows.
[[nodiscard]] inline io::ArrayView view(const Field& field) {
    return {field.row(0), field.rows(), field.columns(), field.stride()};
}
[[nodiscard]] inline io::MutableArrayView view(Field& field) {
    return {field.row(0), field.rows(), field.columns(), field.stride()};
}

} // namespace ductile
