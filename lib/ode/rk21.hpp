// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/simd.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <limits>

namespace ductile {

/// Tolerances and limits of the RK2(1) pair; the factors are those of Lu & Rycroft, App. B.
struct Rk21Options {
    double absolute_tolerance = 1e-8;
    double relative_tolerance = 1e-8;
    double safety = 0.9;              ///< f_s
    double largest_growth = 3.0;      ///< f_max
    double smallest_shrink = 1. / 3.; ///< f_min
    /// Components left out of the state because they integrate exactly; they count in the mean of (B.2) with zero error.
    int exact_components = 0;
};

/// What the error of a substep is compared with.
enum class Rk21Scale {
    both_ends, ///< s_i = A + R max(|y0_i|, |yhat1_i|), (B.1)
    start,     ///< s_i = A + R |y0_i|: the error weights of SUNDIALS
};

struct Rk21Counts {
    long long accepted = 0; ///< substeps, summed over points
    long long rejected = 0;
    double largest_error_square = 0.0; ///< the largest E^2 (B.2) of an accepted substep
    bool failed = false;               ///< a point's substep shrank below 1e-12 of the interval: not finite or hopelessly stiff

    void add(const Rk21Counts& other) {
        accepted += other.accepted;
        rejected += other.rejected;
        largest_error_square = std::max(largest_error_square, other.largest_error_square);
        failed = failed || other.failed;
    }
};

namespace detail {

/// sum_i (a_i/b_i)^2 with a single division, the reciprocals unfolded from that of the product of all b. Where that product
/// overflows the ratios come out as zero or NaN; the sum is then infinite, so that no error passes for a small one.
template <class V, std::size_t n>
[[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] inline V sum_of_squared_ratios(const std::array<V, n>& a, const std::array<V, n>& b) {
    std::array<V, n> product = b; // product[i] = b_0 ... b_i
    for (std::size_t i = 1; i < n; ++i)
        product[i] = product[i - 1] * b[i];
    V inverse = V(1.0) / product[n - 1]; // 1/(b_0 ... b_i) as i goes down
    V sum(0.0);
    for (std::size_t i = n; i-- > 0;) {
        const V ratio = i > 0 ? V(a[i] * inverse * product[i - 1]) : V(a[0] * inverse);
        sum = sum + ratio * ratio;
        inverse = inverse * b[i];
    }
    return select(product[n - 1] < V(std::numeric_limits<double>::max()), sum, V(std::numeric_limits<double>::infinity()));
}

/// Of one point, what the friend of that name is of a batch.
[[nodiscard]] inline double largest_of(double x) { return x; }

/// Stands for an observer where there is none.
struct Unobserved {};

} // namespace detail

/// Integrates dy/dt = f(y) over `duration` with the RK2(1) first-same-as-last pair of Table A.4 (Ralston's method):
///   k1 = f(y0), k2 = f(y0 + 2h/3 k1), yhat1 = y0 + h (k1/4 + 3 k2/4), k3 = f(yhat1) = k1 of the next substep,
///   y1 - yhat1 = h (k1/12 - 5 k2/12 + k3/3),
///   s_i = A + R max(|y0_i|, |yhat1_i|) (B.1),  E = sqrt(mean (y1 - yhat1)_i^2/s_i^2) (B.2),  accept if E < 1,
///   h_new = h min(f_max, max(f_min, f_s E^(-1/2))) (B.4); after a rejection the next step does not grow (Hairer's rule).
/// The first substep is the whole interval, the last one lands on its end.
///
/// V is double (one point) or Pack (a batch): every lane has its own substeps, masks keep finished lanes still, so the result of
/// a point does not depend on its neighbours. `active` marks the lanes to integrate; others keep their state and count nothing.
/// `f` maps the state of all lanes to its rate. On failure the state is unusable and `failed` is set.
/// `observe(accepted, h, y)`, if given, is called after every attempt with the lanes that took the substep, its size, and the
/// state.
template <Rk21Scale scale_by = Rk21Scale::both_ends, class V, std::size_t n, class Rhs, class Observer = detail::Unobserved>
requires std::invocable < Rhs, const std::array<V, n>
& > [[gnu::DUCTILE_ALWAYS_INLINE]] inline void integrate_rk21(Rhs&& f, std::array<V, n>& y, Mask<V> active, double duration,
                                                              const Rk21Options& options, Rk21Counts& counts,
                                                              const Observer& observe = {}) {
    using State = std::array<V, n>;
    const V mean_weight(1.0 / static_cast<double>(n + static_cast<std::size_t>(options.exact_components)));
    V left(duration);
    V h(duration);
    V growth_limit(options.largest_growth);
    State k1 = f(y);

    while (any_of(active)) {
        const Mask<V> last = h >= left;
        h = select(last, left, h);

        State trial;
        for (std::size_t i = 0; i < n; ++i)
            trial[i] = y[i] + h * V(2.0 / 3.0) * k1[i];
        const State k2 = f(trial);
        for (std::size_t i = 0; i < n; ++i)
            trial[i] = y[i] + h * (V(0.25) * k1[i] + V(0.75) * k2[i]);
        const State k3 = f(trial);

        State error, scale;
        for (std::size_t i = 0; i < n; ++i) {
            error[i] = h * (V(1.0 / 12.0) * k1[i] - V(5.0 / 12.0) * k2[i] + V(1.0 / 3.0) * k3[i]);
            V size = magnitude(y[i]);
            if constexpr (scale_by == Rk21Scale::both_ends)
                size = maximum(size, magnitude(trial[i]));
            scale[i] = V(options.absolute_tolerance) + V(options.relative_tolerance) * size;
        }
        V error_square = detail::sum_of_squared_ratios(error, scale);
        error_square = error_square * mean_weight;

        const Mask<V> accepted = (error_square < V(1.0)) && active;
        for (std::size_t i = 0; i < n; ++i) {
            y[i] = select(accepted, trial[i], y[i]);
            k1[i] = select(accepted, k3[i], k1[i]);
        }
        if constexpr (!std::same_as<Observer, detail::Unobserved>)
            observe(accepted, h, y);
        counts.accepted += count_of(accepted);
        if (any_of(accepted && error_square > V(counts.largest_error_square))) { // seldom: a maximum grows a few times
            using detail::largest_of;
            counts.largest_error_square = largest_of(select(accepted, error_square, V(0.0)));
        }
        const Mask<V> rejected = active && !accepted;
        active = active && !(accepted && last);
        if (!any_of(active))
            return; // the usual end: no step-size arithmetic for points that took one substep

        counts.rejected += count_of(rejected);
        left = select(accepted, left - h, left);
        // E^(-1/2) = (E^2)^(-1/4); a non-finite error compares false everywhere and ends at the smallest factor.
        const V proposal = V(options.safety) / square_root(square_root(error_square));
        V factor = select(proposal > V(options.smallest_shrink), proposal, V(options.smallest_shrink));
        factor = minimum(factor, growth_limit);
        growth_limit = select(accepted, V(options.largest_growth), V(1.0));
        h = h * factor;
        if (any_of(active && (h < V(1e-12 * duration)) && (left > h))) {
            counts.failed = true;
            return;
        }
    }
}

} // namespace ductile
