// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/quasistatic/step_control.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace ductile::quasistatic {

namespace {

double first_step(const StepControl::Policy& policy) {
    if (const auto* fixed = std::get_if<FixedSteps>(&policy))
        return fixed->dt;
    if (const auto* projection = std::get_if<ProjectionSteps>(&policy))
        return projection->first_step;
    return std::numeric_limits<double>::infinity(); // until start()
}

} // namespace

const char* to_string(StepLimit limit) {
    switch (limit) {
    case StepLimit::fixed:
        return "fixed";
    case StepLimit::projection:
        return "projection Q*";
    case StepLimit::accuracy:
        return "accuracy";
    case StepLimit::relaxation:
        return "plastic relaxation";
    case StepLimit::advection:
        return "advection";
    case StepLimit::growth:
        return "growth";
    case StepLimit::largest:
        return "largest step";
    case StepLimit::smallest:
        return "smallest step";
    case StepLimit::yield:
        return "yield onset";
    case StepLimit::output:
        return "output time";
    }
    return "";
}

StepControl::StepControl(const Grid& grid, const Policy& policy)
    : cell_area_(grid.cell_area()), policy_(policy), planned_(first_step(policy)),
      limit_(std::holds_alternative<ProjectionSteps>(policy) || std::holds_alternative<ErrorSteps>(policy) ? StepLimit::growth
                                                                                                           : StepLimit::fixed) {}

void StepControl::start(double time_scale) {
    if (const auto* error = std::get_if<ErrorSteps>(&policy_))
        planned_ = time_scale * std::pow(error->tolerance, 1.0 / error->order);
    if (steps_are_own())
        planned_ = time_scale;
}

StepControl::Step StepControl::next(double time, double target) {
    const double left = target - time;
    short_plans_ = planned_ < 1e-8 * left ? short_plans_ + 1 : 0;
    const bool crawls = short_plans_ > 1000 && !std::holds_alternative<FixedSteps>(policy_);
    if (crawls || !(time + planned_ > time))
        throw RunError(fmt::format(
            "time stands still: the next step (limit: {}) is {:.3g} of the time that is left until the next output, so the run "
            "would not end; load more slowly, or not so long, or take a scheme for stiff problems, or a looser tolerance",
            to_string(limit_), planned_ / left));
    // a sliver of a step is worth less than a step that is a little longer; equal steps have no other way to avoid it
    const double stretch = std::holds_alternative<FixedSteps>(policy_) ? 1e-2 : 1e-6;
    if (planned_ >= left * (1.0 - stretch))
        return {.dt = left, .end = target, .lands = true, .limit = planned_ > left * (1.0 + 1e-6) ? StepLimit::output : limit_};
    if (planned_ > 0.5 * left && limit_ != StepLimit::fixed)
        return {.dt = 0.5 * left, .end = time + 0.5 * left, .limit = StepLimit::output};
    return {.dt = planned_, .end = time + planned_, .limit = limit_};
}

StepControl::Step StepControl::shortened(const Step& step, double time, double dt) {
    if (dt >= step.dt)
        return step;
    return {.dt = dt, .end = time + dt, .limit = StepLimit::yield};
}

bool StepControl::judge(const Step& step, const StepAttempt& attempt) {
    if (const auto* projection = std::get_if<ProjectionSteps>(&policy_))
        return judge_by_projection(*projection, step, attempt.measure);
    if (const auto* error = std::get_if<ErrorSteps>(&policy_))
        return judge_by_error(*error, step, attempt);
    return true;
}

// Eq. (56)
bool StepControl::judge_by_projection(const ProjectionSteps& policy, const Step& step, double measure) {
    const double tolerance = policy.tolerance * cell_area_;
    const double by_projection =
        measure > 0.0 ? policy.safety * std::sqrt(tolerance / measure) : std::numeric_limits<double>::infinity();
    if (measure > policy.largest_excess * tolerance && step.dt > policy.smallest_step) {
        limit_ = StepLimit::projection;
        planned_ = std::max(step.dt * std::max(by_projection, 0.1), policy.smallest_step);
        return false;
    }
    const double factor = std::min(policy.largest_growth, by_projection);
    limit_ = by_projection < policy.largest_growth ? StepLimit::projection : StepLimit::growth;
    double proposal = step.dt * factor;
    // a step cut to land on a target does not shrink the plan, as far as Q* ~ dt^2 lets the plan stand
    if (step.limit == StepLimit::output)
        proposal = std::max(proposal, std::min(planned_, step.dt * by_projection));
    if (proposal >= policy.largest_step)
        limit_ = StepLimit::largest;
    if (proposal <= policy.smallest_step)
        limit_ = StepLimit::smallest;
    planned_ = std::clamp(proposal, policy.smallest_step, policy.largest_step);
    return true;
}

bool StepControl::judge_by_error(const ErrorSteps& policy, const Step& step, const StepAttempt& attempt) {
    const double error = std::max(attempt.measure / policy.tolerance, 1e-6);
    limit_ = StepLimit::accuracy;
    if (!(error < 1.0)) { // NaN, too
        planned_ = step.dt * std::max(policy.smallest_shrink, policy.safety * std::pow(error, -1.0 / policy.order));
        return false;
    }
    const double pi = policy.safety * std::pow(error, -0.7 / policy.order) * std::pow(previous_error_, 0.4 / policy.order);
    const double factor = std::clamp(pi, policy.smallest_shrink, policy.largest_growth);
    if (pi > policy.largest_growth)
        limit_ = StepLimit::growth;
    previous_error_ = std::max(error, 1e-2);
    double proposal = step.dt * factor;
    if ((step.limit == StepLimit::output || step.limit == StepLimit::yield) && pi >= 1.0)
        proposal = std::max(proposal, planned_);
    for (const auto& [longest, limit] :
         {std::pair{attempt.relaxation_step, StepLimit::relaxation}, std::pair{attempt.advection_step, StepLimit::advection}})
        if (proposal > longest) {
            proposal = longest;
            limit_ = limit;
        }
    planned_ = proposal;
    return true;
}

bool StepControl::retry_shorter(const Step& step) {
    const auto* error = std::get_if<ErrorSteps>(&policy_);
    if (error == nullptr || error->smallest_shrink * step.dt < error->smallest_step)
        return false;
    planned_ = error->smallest_shrink * step.dt;
    limit_ = StepLimit::accuracy;
    return true;
}

const char* StepControl::identity() const {
    if (std::holds_alternative<ErrorSteps>(policy_))
        return "error";
    if (steps_are_own())
        return "own";
    return std::holds_alternative<ProjectionSteps>(policy_) ? "projection" : "fixed";
}

void StepControl::resume() {
    if (const auto* projection = std::get_if<ProjectionSteps>(&policy_))
        planned_ = std::clamp(planned_, projection->smallest_step, projection->largest_step);
}

std::vector<std::pair<std::string, double*>> StepControl::hidden_numbers() {
    if (std::holds_alternative<FixedSteps>(policy_))
        return {}; // the plan is the option --dt
    return {{"planned_step", &planned_}, {"previous_error", &previous_error_}};
}

} // namespace ductile::quasistatic
