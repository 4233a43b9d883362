// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <cstddef>
#include <new>
#include <vector>

namespace ductile {

/// Alignment in bytes of every array that vector instructions touch: the widest batch in use (Pack, 16 doubles).
inline constexpr std::size_t alignment = 128;
/// Rows are padded to a multiple of this many doubles, whatever the vector width of the build.
inline constexpr int row_unit = static_cast<int>(alignment / sizeof(double));

[[nodiscard]] constexpr int round_up_to_row_unit(int n) { return (n + row_unit - 1) / row_unit * row_unit; }

template <class T> struct AlignedAllocator {
    using value_type = T;
    AlignedAllocator() = default;
    template <class U> AlignedAllocator(const AlignedAllocator<U>&) noexcept {}
    T* allocate(std::size_t n) { return static_cast<T*>(::operator new (n * sizeof(T), std::align_val_t{alignment})); }
    void deallocate(T* p, std::size_t) noexcept { ::operator delete (p, std::align_val_t{alignment}); }
    template <class U> bool operator==(const AlignedAllocator<U>&) const noexcept { return true; }
};

/// A std::vector whose storage starts on a 128-byte boundary.
template <class T> using aligned_vector = std::vector<T, AlignedAllocator<T>>;

} // namespace ductile
