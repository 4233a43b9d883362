#include <ductile/quasistatic/embedded_method.hpp>
#include <ductile/quasistatic/index_reduced.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace ductile::quasistatic {

namespace {

/// Steps in a row that must speak for the other method before it takes over.
constexpr int patience = 20;
/// The stabilised method takes over where it would make the same way with so many times fewer right-hand sides, and gives back
/// where a step has so few stages that it could be the other's.
constexpr double worthwhile = 8.0;
constexpr double few_stages = 3.0;

/// A method, or two of the same order of their estimates of which one is for stiff flow. The fields that they share are all that
/// a step leaves, so that nothing is lost when one hands over to the other between two steps.
class EmbeddedStepper final : public IndexReducedStepper {
public:
    EmbeddedStepper(Scheme scheme, std::vector<std::unique_ptr<EmbeddedMethod>> methods, double tolerance, const Scene& scene,
                    std::unique_ptr<EquilibriumSolver> solver, const PassOptions& passes, State state)
        : IndexReducedStepper(scene, std::move(solver), passes, std::move(state)), scheme_(scheme), methods_(std::move(methods)),
          tolerance_(tolerance), steps_(methods_.size(), 0.0), stages_{.scene = scene,
                                                                       .start = start(),
                                                                       .start_rate = start_rate(),
                                                                       .next = next(),
                                                                       .next_rate = next_rate(),
                                                                       .evaluate = [this](CellState& cells, double fraction,
                                                                                          CellState& rate) -> const VectorField& {
                                                                           evaluate(cells, fraction, rate);
                                                                           return velocity();
                                                                       }} {}

    [[nodiscard]] Scheme scheme() const override { return scheme_; }

    [[nodiscard]] std::vector<std::pair<Scheme, long long>> steps_by_scheme() const override {
        std::vector<std::pair<Scheme, long long>> counts;
        if (methods_.size() == 1)
            return counts;
        for (std::size_t k = 0; k < methods_.size(); ++k)
            counts.emplace_back(methods_[k]->scheme(), static_cast<long long>(steps_[k]));
        return counts;
    }

    [[nodiscard]] std::vector<std::pair<std::string, double*>> hidden_numbers() override {
        auto numbers = IndexReducedStepper::hidden_numbers();
        if (methods_.size() == 1)
            return numbers;
        numbers.emplace_back(std::string(description(methods_[1]->scheme()).name) + "_in_use", &stiff_in_use_);
        numbers.emplace_back("steps_for_a_change", &steps_for_a_change_);
        for (std::size_t k = 0; k < methods_.size(); ++k)
            numbers.emplace_back(std::string("steps_") + description(methods_[k]->scheme()).name, &steps_[k]);
        return numbers;
    }

private:
    [[nodiscard]] EmbeddedMethod& method() const { return *methods_[stiff_in_use_ == 0.0 ? 0 : 1]; }

    CombinationNorm advance(double dt) override {
        stages_.relaxation = relaxation();
        return method().advance(stages_, dt);
    }

    void step_accepted(double dt, double measure) override {
        ++steps_[stiff_in_use_ == 0.0 ? 0 : 1];
        if (methods_.size() == 1)
            return;
        steps_for_a_change_ = speaks_for_the_other(dt, measure) ? steps_for_a_change_ + 1.0 : 0.0;
        if (steps_for_a_change_ < patience)
            return;
        stiff_in_use_ = 1.0 - stiff_in_use_;
        steps_for_a_change_ = 0.0;
    }

    [[nodiscard]] bool speaks_for_the_other(double dt, double measure) const {
        const EmbeddedMethod &common = *methods_[0], &stiff = *methods_[1];
        if (stiff_in_use_ != 0.0)
            return stiff.evaluations(dt, relaxation()) <= few_stages && dt <= common.relaxation_step(relaxation());
        // what the error would allow: both estimates fall with dt^3
        const double accurate =
            std::min(dt * std::cbrt(tolerance_ / std::max(measure, 1e-6 * tolerance_)), stiff.relaxation_step(relaxation()));
        const double stable = common.relaxation_step(relaxation());
        return common.evaluations(stable, relaxation()) / stable >
               worthwhile * stiff.evaluations(accurate, relaxation()) / accurate;
    }

    [[nodiscard]] double relaxation_step(double relaxation) const override { return method().relaxation_step(relaxation); }
    [[nodiscard]] double courant_number() const override { return method().courant_number(); }
    [[nodiscard]] int buffers() const override {
        int sum = 0;
        for (const auto& m : methods_)
            sum += m->buffers();
        return sum;
    }

    Scheme scheme_;
    std::vector<std::unique_ptr<EmbeddedMethod>> methods_;
    double tolerance_;          ///< of the error of a step
    double stiff_in_use_ = 0.0; ///< 1 where the second method is
    double steps_for_a_change_ = 0.0;
    std::vector<double> steps_; ///< accepted, by method
    Stages stages_;
};

} // namespace

std::unique_ptr<TimeStepper> make_embedded(Scheme scheme, const Scene& scene, std::unique_ptr<EquilibriumSolver> solver,
                                           const PassOptions& passes, double tolerance, State state) {
    std::vector<std::unique_ptr<EmbeddedMethod>> methods;
    if (scheme != Scheme::chebyshev)
        methods.push_back(runge_kutta_method(scheme == Scheme::automatic ? Scheme::bogacki_shampine : scheme, scene));
    if (scheme == Scheme::chebyshev || scheme == Scheme::automatic)
        methods.push_back(chebyshev_method(scene));
    return std::make_unique<EmbeddedStepper>(scheme, std::move(methods), tolerance, scene, std::move(solver), passes,
                                             std::move(state));
}

} // namespace ductile::quasistatic
