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

/// `rows` rows and `packs` packs of c.
template <bool accumulate, int rows, int packs>
[[gnu::DUCTILE_ALWAYS_INLINE]] inline void multiply_block(int inner, RowsOf<const double> a, RowsOf<const double> b,
                                                          RowsOf<double> c) {
    Pack sum[rows][packs];
    for (int r = 0; r < rows; ++r)
        for (int k = 0; k < packs; ++k)
            sum[r][k] = accumulate ? load(c.first + r * c.stride + k * pack_size) : Pack(0.0);
    const double* row = b.first;
    for (int l = 0; l < inner; ++l, row += b.stride) {
        Pack x[packs];
        for (int k = 0; k < packs; ++k)
            x[k] = load(row + k * pack_size);
        for (int r = 0; r < rows; ++r) {
            const Pack factor(a.first[r * a.stride + l]);
            for (int k = 0; k < packs; ++k)
                sum[r][k] = sum[r][k] + factor * x[k];
        }
    }
    for (int r = 0; r < rows; ++r)
        for (int k = 0; k < packs; ++k)
            store(sum[r][k], c.first + r * c.stride + k * pack_size);
}

/// c = a b, or c += a b; a is rows x inner, b inner x columns, in whole packs.
template <bool accumulate = false>
void multiply(int rows, int inner, int columns, RowsOf<const double> a, RowsOf<const double> b, RowsOf<double> c) {
    // sums enough to hide the latency of a multiplication, few enough for the registers: 32 with the widest vectors, or 16
    constexpr int block = 4, packs = Pack::register_size == 8 ? 3 : 1;
    const auto part = [&]<int count, int wide>(int r, int i) __attribute__((DUCTILE_ALWAYS_INLINE)) {
        multiply_block<accumulate, count, wide>(inner, {a.first + r * a.stride, a.stride}, {b.first + i, b.stride},
                                                {c.first + r * c.stride + i, c.stride});
    };
    int i = 0;
    for (; i + packs * pack_size <= columns; i += packs * pack_size) {
        int r = 0;
        for (; r + block <= rows; r += block)
            part.template operator()<block, packs>(r, i);
        for (; r < rows; ++r)
            part.template operator()<1, packs>(r, i);
    }
    if constexpr (packs > 1)
        for (; i < columns; i += pack_size) {
            int r = 0;
            for (; r + block <= rows; r += block)
                part.template operator()<block, 1>(r, i);
            for (; r < rows; ++r)
                part.template operator()<1, 1>(r, i);
        }
}

} // namespace DUCTILE_VECTOR_ABI
} // namespace ductile
