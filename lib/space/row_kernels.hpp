// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: what spaces do with a row of cells once they know the velocity gradient there, gradient_at(i) for the pack of cells
// from column i on.
#include <ductile/base/simd.hpp>
#include <ductile/base/tensor.hpp>
#include <ductile/material/point_rates.hpp>
#include <ductile/space/terms.hpp>

#include <algorithm>
#include <array>

namespace ductile {
inline namespace DUCTILE_VECTOR_ABI {

[[gnu::DUCTILE_ALWAYS_INLINE]] inline std::array<Pack, stress_fields> elastic_fields(const IsotropicElasticity& elasticity,
                                                                                     const VelocityGradient<Pack>& gradient) {
    const StressComponents<Pack> rate = elastic_rate(elasticity, gradient);
    return {rate.p, rate.s, rate.tau, rate.q};
}

/// rate += C : D on row j, images not wrapped.
void close_row(const IsotropicElasticity& elasticity, const auto& gradient_at, int j, CellState& rate) {
    for (int i = 0; i < rate.stress.p.columns(); i += pack_size) {
        const auto elastic = elastic_fields(elasticity, gradient_at(i));
        for (int k = 0; k < stress_fields; ++k) {
            double* const row = rate.field(k).row(j) + i;
            store(load(row) + elastic[static_cast<std::size_t>(k)], row);
        }
    }
}

/// A combination whose last term is a rate that is not complete yet, Space::combine(terms, open, out).
class OpenTerms {
public:
    OpenTerms(std::span<const Term> terms, const OpenRate& open) : open_(open), closed_(terms), count_(terms.size() + 1) {
        std::ranges::copy(terms, all_.begin());
        all_[terms.size()] = {open.fields, open.factor}; // all but the stress is complete
    }

    [[nodiscard]] std::span<const Term> terms() const { return std::span(all_).first(count_); }

    void combine_row(const IsotropicElasticity& elasticity, const auto& gradient_at, int j, CellState& out) const {
        const auto rows = stress_rows_of(closed_, j);
        std::array<double*, stress_fields> rate, target;
        for (int k = 0; k < stress_fields; ++k) {
            rate[static_cast<std::size_t>(k)] = open_.fields->field(k).row(j);
            target[static_cast<std::size_t>(k)] = out.field(k).row(j);
        }
        for (int i = 0; i < out.stress.p.columns(); i += pack_size) {
            const auto elastic = elastic_fields(elasticity, gradient_at(i));
            for (std::size_t k = 0; k < stress_fields; ++k) {
                const Pack closed = load(rate[k] + i) + elastic[k];
                const Pack sum = sum_terms(closed_, rows[k], i) + Pack(open_.factor) * closed;
                if (open_.close)
                    store(closed, rate[k] + i);
                store(sum, target[k] + i);
            }
        }
        ductile::combine_row(terms(), stress_fields, j, out);
    }

private:
    OpenRate open_;
    std::span<const Term> closed_;
    std::array<Term, most_terms> all_;
    std::size_t count_;
};

/// Adds dt C : (D(phi) + wall) to cell row j; returns the row's sum of sbar_P^2/mu^2 + p_P^2/(K mu).
double correct_row(const IsotropicElasticity& c, const auto& gradient_at, const StressComponents<double>& wall_rate, double dt,
                   int j, StressField& stress) {
    const Pack deviatoric_weight(dt * dt / (c.shear_modulus * c.shear_modulus));
    const Pack pressure_weight(dt * dt / (c.bulk_modulus * c.shear_modulus));
    const int columns = stress.p.columns();
    Pack sum(0.0);
    for (int i = 0; i < columns; i += pack_size) {
        const StressComponents<Pack> rate = elastic_rate(c, gradient_at(i));
        const auto add = [&](Field& field, const Pack& correction, double wall) {
            double* f = field.row(j) + i;
            store(load(f) + Pack(dt) * (correction + Pack(wall)), f);
        };
        add(stress.p, rate.p, wall_rate.p);
        add(stress.s, rate.s, wall_rate.s);
        add(stress.tau, rate.tau, wall_rate.tau);
        add(stress.q, rate.q, wall_rate.q);

        Pack measure = deviatoric_weight * (rate.s * rate.s + rate.tau * rate.tau + Pack(3.0) * (rate.q * rate.q)) +
                       pressure_weight * (rate.p * rate.p);
        if (i + pack_size > columns) // lanes beyond the last column hold copies
            measure = select(Pack::counting_from(i) < Pack(static_cast<double>(columns)), measure, Pack(0.0));
        sum = sum + measure;
    }
    for (Field* f : {&stress.p, &stress.s, &stress.tau, &stress.q})
        f->wrap_row(j);
    return sum_of(sum);
}

} // namespace DUCTILE_VECTOR_ABI
} // namespace ductile
