#include <ductile/quasistatic/step_control.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ductile::quasistatic {

const char* to_string(StepLimit limit) {
    switch (limit) {
    case StepLimit::fixed:
        return "fixed";
    case StepLimit::projection:
        return "projection Q*";
    case StepLimit::growth:
        return "growth";
    case StepLimit::largest:
        return "largest step";
    case StepLimit::smallest:
        return "smallest step";
    case StepLimit::output:
        return "output time";
    }
    return "";
}

StepControl::StepControl(const Grid& grid, double fixed_step, const PointwiseTolerance& pointwise)
    : cell_area_(grid.cell_area()), pointwise_(pointwise), planned_(fixed_step) {}

StepControl::StepControl(const Grid& grid, const AdaptiveStepOptions& adaptive, const PointwiseTolerance& pointwise)
    : cell_area_(grid.cell_area()), adaptive_(adaptive), pointwise_(pointwise), planned_(adaptive.first_step),
      limit_(StepLimit::growth) {}

StepControl::Step StepControl::next(double time, double target) const {
    const double left = target - time;
    if (planned_ >= left * (1.0 - 1e-6)) // a sliver of a step is worth less than a step longer by a millionth
        return {.dt = left, .end = target, .lands = true, .limit = planned_ > left * (1.0 + 1e-6) ? StepLimit::output : limit_};
    if (adaptive_ && planned_ > 0.5 * left)
        return {.dt = 0.5 * left, .end = time + 0.5 * left, .limit = StepLimit::output};
    return {.dt = planned_, .end = time + planned_, .limit = limit_};
}

void StepControl::update(const Step& step, double projection_measure) {
    if (!adaptive_)
        return;
    const AdaptiveStepOptions& a = *adaptive_;
    const double tolerance = *projection_tolerance();
    const double by_projection =
        projection_measure > 0.0 ? a.safety * std::sqrt(tolerance / projection_measure) : std::numeric_limits<double>::infinity();
    const double factor = std::min(a.largest_growth, by_projection);
    limit_ = by_projection < a.largest_growth ? StepLimit::projection : StepLimit::growth;
    double proposal = step.dt * factor;
    // a step cut to land on a target does not shrink the plan, as far as Q* ~ dt^2 lets the plan stand
    if (step.limit == StepLimit::output)
        proposal = std::max(proposal, std::min(planned_, step.dt * by_projection));
    if (proposal >= a.largest_step)
        limit_ = StepLimit::largest;
    if (proposal <= a.smallest_step)
        limit_ = StepLimit::smallest;
    planned_ = std::clamp(proposal, a.smallest_step, a.largest_step);
}

void StepControl::restore_planned_step(double dt) {
    if (adaptive_)
        planned_ = std::clamp(dt, adaptive_->smallest_step, adaptive_->largest_step);
}

Rk21Options StepControl::pointwise_options(double dt) const {
    const double scale = adaptive_ ? pointwise_.adaptive_factor * cell_area_ : pointwise_.fixed_factor * dt * dt;
    return {.absolute_tolerance = std::max(scale, 1e-16), .relative_tolerance = std::max(scale, 1e-17), .exact_components = 1};
}

std::optional<double> StepControl::projection_tolerance() const {
    if (!adaptive_)
        return std::nullopt;
    return adaptive_->tolerance * cell_area_;
}

} // namespace ductile::quasistatic
