// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <experimental/simd>
#include <utility>

// Code compiled for different instruction sets may meet in one program (an installed library and its user): everything whose size
// or code depends on the set lives in a namespace named after it.
#if defined(__AVX512F__)
#define DUCTILE_VECTOR_ABI avx512
#elif defined(__AVX__)
#define DUCTILE_VECTOR_ABI avx
#else
#define DUCTILE_VECTOR_ABI baseline
#endif

// The name of the attribute that forces inlining. Under the address sanitizer it is another, harmless one: instrumented kernels
// that are all one function take compilers many minutes.
#if defined(__SANITIZE_ADDRESS__)
#define DUCTILE_ALWAYS_INLINE hot
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define DUCTILE_ALWAYS_INLINE hot
#endif
#endif
#if !defined(DUCTILE_ALWAYS_INLINE)
#define DUCTILE_ALWAYS_INLINE always_inline
#endif

/// A thin vocabulary over std::experimental::simd, written so that the same formulas run on one double and on a batch of them.
/// Everything here and in the cell kernels is forced inline: vectors passed through memory cost more than the arithmetic.
namespace ductile {

inline namespace DUCTILE_VECTOR_ABI {

namespace detail {
using Register = std::experimental::native_simd<double>;
using IntegerRegister = std::experimental::rebind_simd_t<std::int64_t, Register>;
} // namespace detail

/// A batch of doubles: two vector registers of the build (2, 4 or 8 doubles each), so that the long dependent chains of the
/// plasticity models (square root, division, exponential) overlap. pack_size divides row_unit.
class Pack {
public:
    using Register = detail::Register;
    static constexpr int register_size = static_cast<int>(Register::size());
    static constexpr int size = 2 * register_size;

    struct Mask {
        Register::mask_type a, b;

        [[gnu::DUCTILE_ALWAYS_INLINE]] explicit Mask(bool value) : a(value), b(value) {}
        [[gnu::DUCTILE_ALWAYS_INLINE]] Mask(Register::mask_type first, Register::mask_type second) : a(first), b(second) {}
        [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend Mask operator&&(const Mask& x, const Mask& y) {
            return {x.a && y.a, x.b && y.b};
        }
        [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] Mask operator!() const { return {!a, !b}; }
    };

    [[gnu::DUCTILE_ALWAYS_INLINE]] Pack() = default;
    [[gnu::DUCTILE_ALWAYS_INLINE]] explicit Pack(double value) : a_(broadcast(value)), b_(a_) {}
    [[gnu::DUCTILE_ALWAYS_INLINE]] Pack(Register a, Register b) : a_(a), b_(b) {}
    /// The numbers first, first + 1, ...
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] static Pack counting_from(double first) {
        const Register lanes([](auto lane) { return static_cast<double>(static_cast<int>(lane)); });
        return {lanes + first, lanes + (first + register_size)};
    }

    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] static Pack load(const double* p) {
        return {Register(p, std::experimental::element_aligned), Register(p + register_size, std::experimental::element_aligned)};
    }
    [[gnu::DUCTILE_ALWAYS_INLINE]] friend void store(const Pack& x, double* p) {
        x.a_.copy_to(p, std::experimental::element_aligned);
        x.b_.copy_to(p + register_size, std::experimental::element_aligned);
    }

    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend Pack operator+(const Pack& x, const Pack& y) {
        return {x.a_ + y.a_, x.b_ + y.b_};
    }
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend Pack operator-(const Pack& x, const Pack& y) {
        return {x.a_ - y.a_, x.b_ - y.b_};
    }
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend Pack operator*(const Pack& x, const Pack& y) {
        return {x.a_ * y.a_, x.b_ * y.b_};
    }
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend Pack operator/(const Pack& x, const Pack& y) {
        return {x.a_ / y.a_, x.b_ / y.b_};
    }
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] Pack operator-() const { return {-a_, -b_}; }
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend Mask operator<(const Pack& x, const Pack& y) {
        return {x.a_ < y.a_, x.b_ < y.b_};
    }
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend Mask operator>(const Pack& x, const Pack& y) {
        return {x.a_ > y.a_, x.b_ > y.b_};
    }
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend Mask operator>=(const Pack& x, const Pack& y) {
        return {x.a_ >= y.a_, x.b_ >= y.b_};
    }

    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend bool any_of(const Mask& m) { return std::experimental::any_of(m.a || m.b); }
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend int count_of(const Mask& m) {
        return std::experimental::popcount(m.a) + std::experimental::popcount(m.b);
    }
    /// mask ? x : y in every lane.
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend Pack select(const Mask& mask, const Pack& x, const Pack& y) {
        Pack r = y;
        where(mask.a, r.a_) = x.a_;
        where(mask.b, r.b_) = x.b_;
        return r;
    }
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend Pack magnitude(const Pack& x) { return {abs(x.a_), abs(x.b_)}; }
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend Pack maximum(const Pack& x, const Pack& y) {
        return {max(x.a_, y.a_), max(x.b_, y.b_)};
    }
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend Pack minimum(const Pack& x, const Pack& y) {
        return {min(x.a_, y.a_), min(x.b_, y.b_)};
    }
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend Pack square_root(const Pack& x) { return {sqrt(x.a_), sqrt(x.b_)}; }
    /// 2^n for the integers n that a rounding shift left in the low bits of x (see exponential_of).
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend Pack power_of_two_from_bits(const Pack& x) {
        const auto scale = [](const Register& part) __attribute__((DUCTILE_ALWAYS_INLINE)) {
            using Integer = detail::IntegerRegister;
            return std::bit_cast<Register>((std::bit_cast<Integer>(part) << 52) + Integer(0x3ff0000000000000LL));
        };
        return {scale(x.a_), scale(x.b_)};
    }
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend double sum_of(const Pack& x) { return reduce(x.a_ + x.b_); }
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend double largest_of(const Pack& x) { return hmax(max(x.a_, x.b_)); }
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] friend double smallest_of(const Pack& x) { return hmin(min(x.a_, x.b_)); }
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] double operator[](int lane) const {
        return lane < register_size ? double(a_[static_cast<std::size_t>(lane)])
                                    : double(b_[static_cast<std::size_t>(lane - register_size)]);
    }

private:
    using Vector [[gnu::vector_size(sizeof(Register))]] = double;

    /// The library's own goes through a function for each lane, and compilers stop inlining those in large kernels.
    [[gnu::DUCTILE_ALWAYS_INLINE]] static Register broadcast(double value) { return std::bit_cast<Register>(value - Vector{}); }

    Register a_, b_;
};

inline constexpr int pack_size = Pack::size;

[[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] inline Pack load(const double* p) { return Pack::load(p); }

/// The type of a comparison between two values of type V.
template <class V> struct MaskOf { using type = typename V::Mask; };
template <> struct MaskOf<double> { using type = bool; };
template <class V> using Mask = typename MaskOf<V>::type;

// The same vocabulary for a single double.
[[nodiscard]] inline bool any_of(bool mask) { return mask; }
[[nodiscard]] inline int count_of(bool mask) { return mask ? 1 : 0; }
[[nodiscard]] inline double select(bool mask, double x, double y) { return mask ? x : y; }
[[nodiscard]] inline double magnitude(double x) { return std::abs(x); }
[[nodiscard]] inline double maximum(double x, double y) { return std::max(x, y); }
[[nodiscard]] inline double minimum(double x, double y) { return std::min(x, y); }
[[nodiscard]] inline double square_root(double x) { return std::sqrt(x); }
[[nodiscard]] inline double power_of_two_from_bits(double x) {
    return std::bit_cast<double>((std::bit_cast<std::uint64_t>(x) << 52) + 0x3ff0000000000000ULL);
}

/// The exponential by Cody-Waite reduction x = n ln 2 + r and a Taylor polynomial of degree 12 on |r| <= ln 2 / 2
/// (truncation 2e-16 of the result). Arguments are clamped to [-708, 709]; NaN stays NaN.
template <class V> [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] inline V exponential(V x) {
    constexpr double shift = 0x1.8p52; // adding it rounds to an integer, kept in the low bits
    x = select(x > V(709.0), V(709.0), x);
    x = select(x < V(-708.0), V(-708.0), x);
    const V shifted = x * V(0x1.71547652b82fep0) + V(shift);
    const V n = shifted - V(shift);
    const V r = (x - n * V(0x1.62e42fefa0000p-1)) - n * V(0x1.cf79abc9e3b3ap-40);
    // Estrin's scheme: half the latency of Horner's
    const V r2 = r * r, r4 = r2 * r2, r8 = r4 * r4;
    const V p01 = V(1.0) + r, p23 = V(1.0 / 2.0) + V(1.0 / 6.0) * r, p45 = V(1.0 / 24.0) + V(1.0 / 120.0) * r,
            p67 = V(1.0 / 720.0) + V(1.0 / 5040.0) * r, p89 = V(1.0 / 40320.0) + V(1.0 / 362880.0) * r,
            pab = V(1.0 / 3628800.0) + V(1.0 / 39916800.0) * r, pc = V(1.0 / 479001600.0);
    const V p = (p01 + p23 * r2) + (p45 + p67 * r2) * r4 + ((p89 + pab * r2) + pc * r4) * r8;
    return p * power_of_two_from_bits(shifted);
}

} // namespace DUCTILE_VECTOR_ABI

} // namespace ductile
