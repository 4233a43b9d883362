#include <ductile/quasistatic/embedded_method.hpp>

#include <array>
#include <cassert>
#include <vector>

namespace ductile::quasistatic {

namespace {

/// A first-same-as-last Butcher table: the last row of A is b, the last stage is the first of the next step.
struct Table {
    int stages;
    std::array<double, 7> c;
    std::array<std::array<double, 6>, 7> a;
    std::array<double, 7> error; ///< b - b_embedded
    double real_stability;       ///< the method is stable for -real_stability <= dt lambda <= 0
};

const Table& table_of(Scheme scheme) {
    static const Table ralston{3, {0, 2. / 3, 1}, {{{}, {2. / 3}, {1. / 4, 3. / 4}}}, {-1. / 12, 5. / 12, -1. / 3}, 2.0};
    static const Table bogacki_shampine{4,
                                        {0, 1. / 2, 3. / 4, 1},
                                        {{{}, {1. / 2}, {0, 3. / 4}, {2. / 9, 1. / 3, 4. / 9}}},
                                        {2. / 9 - 7. / 24, 1. / 3 - 1. / 4, 4. / 9 - 1. / 3, -1. / 8},
                                        2.5};
    static const Table dormand_prince{7,
                                      {0, 1. / 5, 3. / 10, 4. / 5, 8. / 9, 1, 1},
                                      {{{},
                                        {1. / 5},
                                        {3. / 40, 9. / 40},
                                        {44. / 45, -56. / 15, 32. / 9},
                                        {19372. / 6561, -25360. / 2187, 64448. / 6561, -212. / 729},
                                        {9017. / 3168, -355. / 33, 46732. / 5247, 49. / 176, -5103. / 18656},
                                        {35. / 384, 0, 500. / 1113, 125. / 192, -2187. / 6784, 11. / 84}}},
                                      {71. / 57600, 0, -71. / 16695, 71. / 1920, -17253. / 339200, 22. / 525, -1. / 40},
                                      3.3};
    switch (scheme) {
    case Scheme::ralston:
        return ralston;
    case Scheme::bogacki_shampine:
        return bogacki_shampine;
    default:
        assert(scheme == Scheme::dormand_prince);
        return dormand_prince;
    }
}

class RungeKuttaMethod final : public EmbeddedMethod {
public:
    RungeKuttaMethod(Scheme scheme, const Scene& scene) : scheme_(scheme), table_(table_of(scheme)) {
        for (int i = 2; i < table_.stages; ++i)
            inner_rates_.emplace_back(scene);
    }

    [[nodiscard]] Scheme scheme() const override { return scheme_; }

    [[nodiscard]] CombinationNorm advance(const Stages& stages, double dt) override {
        // rates of the stages: the first is the start's, the last the next step's first
        const auto stage_rate = [&](int i) -> CellState& {
            if (i == 0)
                return stages.start_rate;
            return i == table_.stages - 1 ? stages.next_rate : inner_rates_[static_cast<std::size_t>(i - 1)];
        };
        const VectorField* velocity = nullptr;
        for (int i = 1; i < table_.stages; ++i) {
            // Y_i = y_n + dt sum_j a_ij k_j; the latest rate is completed on the way
            const auto& row = table_.a[static_cast<std::size_t>(i)];
            std::array<Term, 8> terms;
            std::size_t count = 0;
            terms[count++] = {&stages.start, 1.0};
            for (int j = 0; j + 1 < i; ++j)
                if (row[static_cast<std::size_t>(j)] != 0.0)
                    terms[count++] = {&stage_rate(j), dt * row[static_cast<std::size_t>(j)]};
            const double latest = dt * row[static_cast<std::size_t>(i - 1)];
            if (i == 1) { // the start's rate is complete
                terms[count++] = {&stages.start_rate, latest};
                combine(stages.scene, {terms.data(), count}, stages.next);
            } else {
                combine(stages.scene, {terms.data(), count}, {&stage_rate(i - 1), velocity, latest}, stages.next);
            }
            velocity = &stages.evaluate(stages.next, table_.c[static_cast<std::size_t>(i)], stage_rate(i));
        }
        close_rate(stages.scene, *velocity, stages.next_rate);
        std::array<Term, 7> terms;
        for (int i = 0; i < table_.stages; ++i)
            terms[static_cast<std::size_t>(i)] = {&stage_rate(i), dt * table_.error[static_cast<std::size_t>(i)]};
        return norm(stages.scene, {terms.data(), static_cast<std::size_t>(table_.stages)});
    }

    [[nodiscard]] double relaxation_step(double relaxation) const override { return table_.real_stability / relaxation; }
    [[nodiscard]] double courant_number() const override { return table_.real_stability / 4.0; }
    [[nodiscard]] double evaluations(double, double) const override { return table_.stages - 1; }
    [[nodiscard]] int buffers() const override { return static_cast<int>(inner_rates_.size()); }

private:
    Scheme scheme_;
    const Table& table_;
    std::vector<CellState> inner_rates_;
};

} // namespace

std::unique_ptr<EmbeddedMethod> runge_kutta_method(Scheme scheme, const Scene& scene) {
    return std::make_unique<RungeKuttaMethod>(scheme, scene);
}

} // namespace ductile::quasistatic
