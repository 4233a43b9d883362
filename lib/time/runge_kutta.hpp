// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/time/butcher_tables.hpp>
#include <ductile/time/method.hpp>

namespace ductile::time {

/// The explicit Runge-Kutta method of a table.
template <class Vector> class RungeKutta final : public Method<Vector> {
public:
    RungeKutta(System<Vector>& system, const ButcherTable& table) : system_(system), table_(table) {
        for (std::size_t i = 2; i < table.stages(); ++i)
            inner_rates_.push_back(system.make());
        terms_.reserve(table.stages() + 1);
    }

    [[nodiscard]] double advance(const Step<Vector>& step) override {
        const auto stage_rate = [&](std::size_t i) -> Vector& {
            return i == 0 ? step.start_rate : i + 1 == table_.stages() ? step.next_rate : inner_rates_[i - 1];
        };
        OpenRate<Vector> open;
        for (std::size_t i = 1; i < table_.stages(); ++i) {
            // Y_i = y_n + dt sum_j a_ij k_j; the latest rate is completed on the way
            const std::vector<double>& row = table_.a[i];
            terms_.assign(1, {&step.start, 1.0});
            for (std::size_t j = 0; j + 1 < i; ++j)
                if (row[j] != 0.0)
                    terms_.push_back({&stage_rate(j), step.dt * row[j]});
            const double latest = step.dt * row[i - 1];
            if (i == 1) { // the start's rate is complete
                terms_.push_back({&step.start_rate, latest});
                system_.combine(terms_, step.next);
            } else {
                system_.combine(terms_, open, latest, Completed::kept, step.next);
            }
            open = system_.evaluate(step.next, table_.c[i], stage_rate(i));
        }
        system_.close(open);
        terms_.clear();
        for (std::size_t i = 0; i < table_.stages(); ++i)
            terms_.push_back({&stage_rate(i), step.dt * table_.error[i]});
        return system_.norm(terms_);
    }

    [[nodiscard]] bool interpolates() const override { return true; }
    void interpolate(const Step<Vector>& step, double fraction, Vector& y) const override {
        const auto cubic = cubic_within(step, fraction);
        std::vector<Term<Vector>> terms(cubic.begin(), cubic.end());
        const double weight = step.dt * fraction * fraction * (1.0 - fraction) * (1.0 - fraction);
        for (std::size_t i = 0; i < table_.quartic.size(); ++i) {
            if (i == 0 || i + 1 == table_.stages())
                terms[i == 0 ? 1 : 3].factor += weight * table_.quartic[i];
            else if (table_.quartic[i] != 0.0)
                terms.push_back({&inner_rates_[i - 1], weight * table_.quartic[i]});
        }
        system_.combine(terms, y);
    }

    [[nodiscard]] double relaxation_step(double relaxation, std::span<const double>) const override {
        return table_.real_stability / relaxation;
    }
    [[nodiscard]] double courant_number(std::span<const double>) const override { return table_.real_stability / 4.0; }
    [[nodiscard]] double evaluations(double, double) const override { return static_cast<double>(table_.stages() - 1); }
    [[nodiscard]] int buffers() const override { return static_cast<int>(inner_rates_.size()); }

private:
    System<Vector>& system_;
    const ButcherTable& table_;
    std::vector<Vector> inner_rates_;
    std::vector<Term<Vector>> terms_;
};

} // namespace ductile::time
