// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: products of small dense matrices, all that elements are made of.
#include <ductile/base/simd.hpp>

#include <cstddef>

namespace ductile {
inline namespace DUCTILE_VECTOR_ABI {

/// A matrix in memory, row after row, `stride` numbers apart.
template <class T> struct RowsOf {
    T* first = nullptr;
    std::ptrdiff_t stride = 0;
};

template <int rows, bool accumulate>
[[gnu::DUCTILE_ALWAYS_INLINE]] inline void multiply_rows(int inner, int columns, RowsOf<const double> a, RowsOf<const double> b,
                                                         RowsOf<double> c) {
    for (int i = 0; i < columns; i += pack_size) {
        Pack sum[rows];
        for (int r = 0; r < rows; ++r)
            sum[r] = accumulate ? load(c.first + r * c.stride + i) : Pack(0.0);
        const double* row = b.first + i;
        for (int l = 0; l < inner; ++l, row += b.stride) {
            const Pack x = load(row);
            for (int r = 0; r < rows; ++r)
                sum[r] = sum[r] + Pack(a.first[r * a.stride + l]) * x;
        }
        for (int r = 0; r < rows; ++r)
            store(sum[r], c.first + r * c.stride + i);
    }
}

/// c = a b, or c += a b; a is rows x inner, b inner x columns, in whole packs.
template <bool accumulate = false>
void multiply(int rows, int inner, int columns, RowsOf<const double> a, RowsOf<const double> b, RowsOf<double> c) {
    constexpr int block = 4; // sums enough to hide the latency of a multiplication, few enough for the registers
    int r = 0;
    const auto at = [&](int row) { return RowsOf<const double>{a.first + row * a.stride, a.stride}; };
    const auto to = [&](int row) { return RowsOf<double>{c.first + row * c.stride, c.stride}; };
    for (; r + block <= rows; r += block)
        multiply_rows<block, accumulate>(inner, columns, at(r), b, to(r));
    switch (rows - r) {
    case 3:
        return multiply_rows<3, accumulate>(inner, columns, at(r), b, to(r));
    case 2:
        return multiply_rows<2, accumulate>(inner, columns, at(r), b, to(r));
    case 1:
        return multiply_rows<1, accumulate>(inner, columns, at(r), b, to(r));
    default:
        return;
    }
}

} // namespace DUCTILE_VECTOR_ABI
} // namespace ductile
