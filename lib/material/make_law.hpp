// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/material/duvaut_lions.hpp>
#include <ductile/material/law.hpp>
#include <ductile/material/point_rates.hpp>
#include <ductile/material/viscoplastic.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace ductile {
inline namespace DUCTILE_VECTOR_ABI {
namespace detail {

template <class V, std::size_t n>
[[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] inline std::array<V, n> load_rows(ConstArrays rows, int i) {
    std::array<V, n> y;
    for (std::size_t k = 0; k < n; ++k)
        y[k] = load(rows[k] + i);
    return y;
}
template <class V, std::size_t n>
[[gnu::DUCTILE_ALWAYS_INLINE]] inline void store_rows(const std::array<V, n>& y, Arrays rows, int i) {
    for (std::size_t k = 0; k < n; ++k)
        store(y[k], rows[k] + i);
}

/// A law by its step form and its rate form.
template <StepForm Step, RateForm Rate> class LawOf final : public Law::Interface {
    static constexpr std::size_t n = variable_count<Step>, m = 3 + n;
    static_assert(n <= most_variables);
    using Internal = std::array<double, n>;
    using Cells = std::array<Pack, m>;

public:
    LawOf(const Step& step, const Rate& rate)
        : Interface(step.elasticity(), list_of(step.variables())), step_(step), rate_(rate) {}

    [[nodiscard]] bool linear() const override { return Step::linear; }
    [[nodiscard]] double equivalent_yield_stress(std::span<const double> internal) const override {
        return step_.yield_stress(internal_from(internal.data()));
    }

    [[nodiscard]] bool has_rates() const override { return Step::isochoric; }

    [[nodiscard]] FlowAt flow_at(double sbar, std::span<const double> internal) const override {
        require_rates();
        const Internal x = internal_from(internal.data());
        const auto rates = rate_.rates(sbar, x);
        return {rate_.yield_stress(x), rates.fluidity, rate_.flow_slope(sbar, x), {rates.internal.begin(), rates.internal.end()}};
    }

    void add_flow_rate(const double* y, double* rate) const override {
        require_rates();
        std::array<double, m> state, source;
        std::copy_n(y, m, state.begin());
        std::copy_n(rate, m, source.begin());
        std::ranges::copy(FlowRate<Rate, double, m>{rate_, two_mu(), source}(state), rate);
    }

    void yield_stress(int count, ConstArrays internal, double* yield) const override {
        require_rates();
        for (int i = 0; i < count; i += pack_size)
            store(rate_.yield_stress(load_rows<Pack, n>(internal, i)), yield + i);
    }

    [[nodiscard]] FlowSums add_flow_rates(int count, ConstArrays y, Arrays rate) const override {
        require_rates();
        const Pack viscosity(two_mu());
        Pack relaxation(0.0), relaxed(0.0);
        for (int i = 0; i < count; i += pack_size) {
            const Cells state = load_rows<Pack, m>(y, i);
            const Pack sbar = deviatoric_magnitude(state);
            const auto internal = internal_of(state);
            if (!any_of(!(sbar < rate_.yield_stress(internal)))) // not a number counts as plastic and is found out later
                continue;
            const Cells source = load_rows<Pack, m>(rate, i), slope = FlowRate<Rate, Pack, m>{rate_, viscosity, source}(state);
            store_rows(slope, rate, i);
            relaxed = relaxed + real_lanes(work_of(state, source, slope), i, count);
            relaxation = maximum(relaxation, viscosity * rate_.flow_slope(sbar, internal));
        }
        return {largest_of(relaxation), sum_of(relaxed) * 2.0 / two_mu()};
    }

    double flow_by_euler(int count, ConstArrays y, Arrays end, double dt) const override {
        require_rates();
        Pack relaxed(0.0);
        for (int i = 0; i < count; i += pack_size)
            relaxed =
                relaxed +
                advance(
                    y, end, i, count,
                    dt, [&](const auto& flow, const Cells& start, const Pack::Mask&) __attribute__((DUCTILE_ALWAYS_INLINE)) {
                        return moved(start, dt, flow(start));
                    });
        return sum_of(relaxed) / two_mu();
    }

    double flow_by_substeps(int count, ConstArrays y, Arrays end, double dt, const Rk21Options& options,
                            Rk21Counts& counts) const override {
        require_rates();
        const auto substeps = [&](const Pack::Mask& real) __attribute__((DUCTILE_ALWAYS_INLINE)) {
            return [&, real ](const auto& flow, const Cells& start, const Pack::Mask& plastic)
                __attribute__((DUCTILE_ALWAYS_INLINE)) {
                Cells state = start;
                integrate_rk21(flow, state, plastic && real, dt, options, counts);
                return state;
            };
        };
        const int whole = count - count % pack_size;
        Pack relaxed(0.0);
        int i = 0;
        for (; i < whole; i += pack_size)
            relaxed = relaxed + advance(y, end, i, count, dt, substeps(Pack::Mask(true)));
        if (i < count) // lanes beyond the last point: computed, not counted
            relaxed =
                relaxed + advance(y, end, i, count, dt, substeps(Pack::counting_from(i) < Pack(static_cast<double>(count))));
        return sum_of(relaxed) / two_mu();
    }

    void correct(std::size_t count, const SymmetricTensor* trial, ConstArrays internal, double dt, SymmetricTensor* stress,
                 Arrays internal_end) const override {
        for (std::size_t i = 0; i < count; ++i) {
            const StressReturn<n> end = step_.correct(trial[i], internal_at(internal, i), dt);
            stress[i] = end.stress;
            for (std::size_t k = 0; k < n; ++k)
                internal_end[k][i] = end.internal[k];
        }
    }

    void tangent(std::size_t count, const SymmetricTensor* trial, ConstArrays internal, double dt,
                 Tangent* tangent) const override {
        for (std::size_t i = 0; i < count; ++i)
            tangent[i] = step_.tangent(trial[i], internal_at(internal, i), dt);
    }

    void release_thickness(std::size_t count, const SymmetricTensor* start, ConstArrays internal, double dt,
                           SymmetricTensor* strain) const override {
        const IsotropicElasticity& e = elasticity();
        for (std::size_t i = 0; i < count; ++i) {
            strain[i].zz = -(e.beta() * (strain[i].xx + strain[i].yy) + start[i].zz) / e.alpha();
            if constexpr (!Step::linear) {
                const Internal x = internal_at(internal, i);
                for (int iteration = 0; iteration < 50; ++iteration) {
                    const SymmetricTensor trial = start[i] + elastic_stress(e, strain[i]);
                    const double excess = step_.correct(trial, x, dt).stress.zz;
                    if (std::abs(excess) <= 1e-13 * equivalent_stress(trial))
                        break;
                    strain[i].zz -= excess / step_.tangent(trial, x, dt).entry[2][2];
                }
            }
        }
    }

private:
    static std::vector<InternalVariable> list_of(const std::array<InternalVariable, n>& variables) {
        return {variables.begin(), variables.end()};
    }
    static void require_rates() {
        if constexpr (!Step::isochoric)
            throw std::logic_error("this law's flow changes the volume: it has no rate form");
    }
    [[nodiscard]] double two_mu() const { return 2.0 * elasticity().shear_modulus; }
    static Internal internal_from(const double* values) {
        Internal x;
        std::copy_n(values, n, x.begin());
        return x;
    }
    static Internal internal_at(ConstArrays internal, std::size_t i) {
        Internal x;
        for (std::size_t k = 0; k < n; ++k)
            x[k] = internal[k][i];
        return x;
    }
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] static Cells moved(const Cells& y, double dt, const Cells& slope) {
        const Pack step(dt);
        Cells end;
        for (std::size_t k = 0; k < m; ++k)
            end[k] = y[k] + step * slope[k];
        return end;
    }

    /// mu sigma : (plastic strain), from what the deviator is without plastic flow and with it.
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] static Pack work_of(const Cells& stress, const Cells& without, const Cells& with) {
        return stress[0] * (without[0] - with[0]) + stress[1] * (without[1] - with[1]) +
               Pack(3.0) * (stress[2] * (without[2] - with[2]));
    }
    /// Lanes beyond the last point hold anything.
    [[nodiscard, gnu::DUCTILE_ALWAYS_INLINE]] static Pack real_lanes(const Pack& values, int i, int count) {
        return i + pack_size <= count ? values
                                      : select(Pack::counting_from(i) < Pack(static_cast<double>(count)), values, Pack(0.0));
    }

    /// Along the straight elastic path, which sbar is convex on, or by `flow` where that path meets yield. Returns twice the
    /// stress in the middle times what flow took from the deviator.
    [[gnu::DUCTILE_ALWAYS_INLINE]] Pack advance(ConstArrays y, Arrays end, int i, int count, double dt,
                                                const auto& by_flow) const {
        const Cells start = load_rows<Pack, m>(y, i), source = load_rows<Pack, m>(end, i);
        Cells after = moved(start, dt, source);
        const Pack yield = minimum(rate_.yield_stress(internal_of(start)), rate_.yield_stress(internal_of(after)));
        const Pack::Mask plastic = !(maximum(deviatoric_square(start), deviatoric_square(after)) < yield * yield);
        Pack relaxed(0.0);
        if (any_of(plastic)) {
            const Cells flown = by_flow(FlowRate<Rate, Pack, m>{rate_, Pack(two_mu()), source}, start, plastic), trial = after;
            Cells twice_middle = start;
            for (std::size_t k = 0; k < m; ++k) {
                after[k] = select(plastic, flown[k], after[k]);
                twice_middle[k] = start[k] + after[k];
            }
            relaxed = real_lanes(work_of(twice_middle, trial, after), i, count);
        }
        store_rows(after, end, i);
        return relaxed;
    }

    Step step_;
    Rate rate_;
};

} // namespace detail

/// A law from its rate form. Throws InputError for moduli that are not positive.
template <RateForm M> [[nodiscard]] Law make_law(const IsotropicElasticity& elasticity, const M& model) {
    const Viscoplastic<M> step(elasticity, model);
    return Law(std::make_shared<detail::LawOf<Viscoplastic<M>, M>>(step, model));
}

/// A law from its step form. Cells let it relax within `relaxation_time`, in its units of time; particles do not need that.
template <StepForm L> [[nodiscard]] Law make_law(const L& law, double relaxation_time = 1.0) {
    return Law(std::make_shared<detail::LawOf<L, DuvautLions<L>>>(law, DuvautLions<L>(law, relaxation_time)));
}

} // namespace DUCTILE_VECTOR_ABI
} // namespace ductile
