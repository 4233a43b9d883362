// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <cstddef>

namespace ductile::io {

/// A read-only look at a 2-D array stored by rows, possibly padded: value (row j, column i) is first[j * stride + i].
/// Holds nothing: what it looks at must live on. Requires stride >= columns.
struct ArrayView {
    const double* first = nullptr;
    int rows = 0;
    int columns = 0;
    std::ptrdiff_t stride = 0; ///< distance between the beginnings of two rows, in doubles

    [[nodiscard]] const double* row(int j) const { return first + j * stride; }
};

/// The same look with the right to write.
struct MutableArrayView {
    double* first = nullptr;
    int rows = 0;
    int columns = 0;
    std::ptrdiff_t stride = 0;

    [[nodiscard]] double* row(int j) const { return first + j * stride; }
    operator ArrayView() const { return {first, rows, columns, stride}; }
};

} // namespace ductile::io
