#include <ductile/base/error.hpp>
#include <ductile/quasistatic/accuracy_watch.hpp>
#include <ductile/quasistatic/projection.hpp>

#include <fmt/format.h>

namespace ductile::quasistatic {

namespace {
constexpr const char* remedy =
    "use a smaller --dt (fixed steps) or --tolerance (adaptive steps), or leave out --scheme and --step";
}

AccuracyWatch::AccuracyWatch(const Scene& scene) : scene_(scene), force_(scene.grid) {}

void AccuracyWatch::judge(const StepAttempt& attempt, double time, double dt) {
    if (!(attempt.error <= largest_error))
        throw RunError(fmt::format(
            "step at t = {:.6g} s with dt = {:.3g} s: its error is an estimated {:.2g} of the yield stress (or of the "
            "internal variable's scale); beyond {:g} numbers mean nothing: {}",
            time * scene_.units.time, dt * scene_.units.time, attempt.error, largest_error, remedy));
    if (attempt.error > error_) {
        error_ = attempt.error;
        error_time_ = time;
        error_step_ = dt;
    }
}

void AccuracyWatch::observe(const State& state, bool last) {
    if (state.step % residual_interval != 0 && !last)
        return;
    const double residual = equilibrium_residual(scene_, state.cells, force_);
    if (!(residual <= residual_)) {
        residual_ = residual;
        residual_time_ = state.time;
    }
}

std::vector<std::string> AccuracyWatch::warnings() const {
    std::vector<std::string> sentences;
    if (error_ > doubtful_error)
        sentences.push_back(fmt::format("the step at t = {:.6g} s with dt = {:.3g} s has an estimated error of {:.2g} of the "
                                        "yield stress (or of the internal "
                                        "variable's scale): {}",
                                        error_time_ * scene_.units.time, error_step_ * scene_.units.time, error_, remedy));
    if (!(residual_ <= doubtful_residual))
        sentences.push_back(
            fmt::format("the stress is out of equilibrium by {:.2g} of itself from cell to cell at t = {:.6g} s: use "
                        "--operator exact",
                        residual_, residual_time_ * scene_.units.time));
    return sentences;
}

std::vector<std::pair<std::string, double*>> AccuracyWatch::hidden_numbers() {
    return {{"largest_error", &error_},
            {"largest_error_time", &error_time_},
            {"largest_error_step", &error_step_},
            {"largest_residual", &residual_},
            {"largest_residual_time", &residual_time_}};
}

} // namespace ductile::quasistatic
