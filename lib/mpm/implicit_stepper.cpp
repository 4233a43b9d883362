// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/base/timer.hpp>
#include <ductile/mpm/time_stepper.hpp>
#include <ductile/sundials/kinsol.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <optional>

namespace ductile::mpm {

namespace {

std::optional<sundials::KrylovSolver> kinsol_solver(SolverKind kind) {
    switch (kind) {
    case SolverKind::kinsol_gmres:
        return sundials::KrylovSolver::gmres;
    case SolverKind::kinsol_fgmres:
        return sundials::KrylovSolver::flexible_gmres;
    case SolverKind::kinsol_bicgstab:
        return sundials::KrylovSolver::bicgstab;
    case SolverKind::kinsol_cg:
        return sundials::KrylovSolver::conjugate_gradients;
    default:
        return std::nullopt;
    }
}

NewtonOptions newton_options(const ImplicitOptions& o) {
    NewtonOptions newton = o.newton;
    newton.linear = o.solver == SolverKind::newton_cg ? LinearMethod::conjugate_gradients : LinearMethod::gmres;
    return newton;
}

sundials::KinsolOptions kinsol_options(const ImplicitOptions& o) {
    return {.linear = kinsol_solver(o.solver).value_or(sundials::KrylovSolver::gmres),
            .krylov_vectors = o.newton.largest_linear_iterations,
            .eisenstat_walker = o.newton.eisenstat_walker,
            .linear_tolerance = o.newton.linear_tolerance,
            .difference_increment = o.newton.difference_increment,
            .largest_iterations = o.newton.largest_newton_iterations};
}

class ImplicitStepper final : public TimeStepper {
public:
    ImplicitStepper(const Scene& scene, const ImplicitOptions& options)
        : options_(options), linear_(is_linear(scene) && !options.always_newton), balance_(scene, options.scheme),
          preconditioner_(options.preconditioner), newton_(newton_options(options)), kinsol_(kinsol_options(options)) {
        const bool symmetric_only = options.solver == SolverKind::newton_cg || options.solver == SolverKind::kinsol_cg;
        if (symmetric_only && options.scheme.form == Form::momentum)
            throw InputError(
                "conjugate gradients need the symmetric Jacobian of the velocity form: choose GMRES for the momentum "
                "form");
        if (scene.surface_contact && options.scheme.form == Form::momentum)
            throw InputError("in implicit steps of the momentum form particles move with another velocity than the one that "
                             "strains them, and would pass through surfaces: choose --form velocity, or let rigid bodies hold "
                             "nodes");
    }

    StepOutcome attempt(State& state, double dt, double end) override {
        Timer timer;
        balance_.prepare(state, dt);
        preconditioner_.begin_step();
        seconds_[0] += timer.lap();
        unknown_.assign(balance_.initial_guess().begin(), balance_.initial_guess().end());
        const SolverCounts before = counts_;
        const SolverResult solution = solve();
        seconds_[1] += timer.lap();
        StepOutcome outcome{.newton_iterations = static_cast<int>(counts_.newton_iterations - before.newton_iterations),
                            .linear_iterations = static_cast<int>(counts_.linear_iterations - before.linear_iterations)};
        if (!solution.converged) {
            outcome.failure = StepFailure::no_convergence;
            outcome.reason = solution.failure;
            return outcome;
        }
        const NodalMotion motion = balance_.motion(unknown_);
        const Forecast forecast = balance_.discretisation().forecast(state.particles, motion);
        outcome.smallest_determinant = forecast.smallest_determinant;
        if (!(forecast.smallest_determinant > 0.0)) {
            outcome.failure = StepFailure::folded_grid;
            outcome.reason = fmt::format("the step would fold the grid: its deformation has the determinant {:.3g} at a particle",
                                         forecast.smallest_determinant);
            return outcome;
        }
        if (forecast.farthest_travel > 2.0) {
            outcome.failure = StepFailure::far_particle;
            outcome.reason = fmt::format("a particle would travel {:.3g} cells in the step", forecast.farthest_travel);
            return outcome;
        }
        if (forecast.leaving >= 0) {
            const auto p = static_cast<std::size_t>(forecast.leaving);
            outcome.failure = StepFailure::leaving_particle;
            outcome.reason = fmt::format("particle {} at ({:.6g}, {:.6g}) m would leave the background grid",
                                         state.particles.id[p], state.particles.x[p], state.particles.y[p]);
            return outcome;
        }
        outcome.energies = balance_.advance(motion, state.particles);
        move_rigid_bodies(state, dt);
        state.time = end;
        ++state.step;
        outcome.accepted = true;
        seconds_[2] += timer.lap();
        return outcome;
    }

    [[nodiscard]] const Discretisation& discretisation() const override { return balance_.discretisation(); }
    [[nodiscard]] std::span<const double> force() override {
        force_.resize(balance_.size());
        balance_.force_at_end(force_);
        return force_;
    }
    [[nodiscard]] SolverCounts counts() const override { return counts_; }
    [[nodiscard]] PhaseSeconds phase_seconds() const override {
        return {{"weights", seconds_[0]}, {"solver", seconds_[1]}, {"particles", seconds_[2]}};
    }
    [[nodiscard]] std::size_t memory_bytes() const override { return balance_.discretisation().memory_bytes(); }

private:
    SolverResult solve() {
        double constant = options_.scale == ResidualScale::none ? 1.0 : balance_.paper_scale();
        if (options_.scale == ResidualScale::stiffness_rms)
            constant *= std::sqrt(static_cast<double>(balance_.size()));
        const double least = balance_.round_off() / options_.newton.tolerance;
        const auto residual = [&](std::span<const double> u, std::span<double> f) {
            if (options_.scale == ResidualScale::forces)
                return balance_.residual_and_forces(u, f) + least;
            balance_.residual(u, f);
            return constant;
        };
        const bool preconditioned = preconditioner_.kind() != PreconditionerKind::none;
        const auto linearise = [&](std::span<const double> u) {
            balance_.linearise(u);
            preconditioner_.update(balance_);
        };
        const auto jacobian_times = [&](auto s, auto js) { balance_.jacobian_times(s, js); };
        const auto precondition = [&](std::span<double> z) { preconditioner_.apply(z); };
        const auto velocity_change = [&](auto s, auto w) { balance_.straining_change(s, w); };
        const NonlinearSystem system{.size = balance_.size(),
                                     .residual = residual,
                                     .linearise = linearise,
                                     .jacobian_times = jacobian_times,
                                     .precondition = preconditioned ? InPlaceMap(precondition) : InPlaceMap(),
                                     .velocity_change = velocity_change};
        if (kinsol_solver(options_.solver))
            return solve_by_kinsol(system);
        return linear_ ? newton_.solve_linear(system, unknown_, counts_) : newton_.solve(system, unknown_, counts_);
    }

    /// KINSOL keeps one scale for all iterates: where the forces at its solution are smaller, it begins again from there.
    SolverResult solve_by_kinsol(const NonlinearSystem& system) {
        residual_.resize(system.size);
        for (int pass = 0;; ++pass) {
            const double scale = system.residual(unknown_, residual_), now = norm(residual_);
            ++counts_.residual_evaluations;
            if (now <= options_.newton.tolerance * scale)
                return {true, now > 0.0 ? now / scale : 0.0, {}};
            if (!std::isfinite(now))
                return {false, now, "the residual is not finite"};
            if (pass == 5)
                return {false, now / scale,
                        fmt::format("KINSOL left the residual {:.3g} in each of {} passes, the tolerance is {:.3g}", now / scale,
                                    pass, options_.newton.tolerance)};
            SolverResult result = run_kinsol(system, scale);
            if (!result.converged || options_.scale != ResidualScale::forces)
                return result;
        }
    }

    /// The size of a component of u that matters: that of the guess, or, from rest, of what the forces make of it.
    [[nodiscard]] double typical_unknown() const {
        double typical = 0.0;
        for (const double x : unknown_)
            typical = std::max(typical, std::abs(x));
        if (typical > 0.0)
            return typical;
        if (options_.scheme.form == Form::momentum)
            return norm(residual_);
        return norm(residual_) / norm(balance_.nodes().mass);
    }

    SolverResult run_kinsol(const NonlinearSystem& system, double scale) {
        // the same goal as Newton's: KINSOL bounds the largest component, which is at least the norm / sqrt(size)
        const double tolerance = options_.newton.tolerance / std::sqrt(static_cast<double>(system.size));
        const auto scaled = [&](std::span<double> f) {
            for (double& x : f)
                x /= scale;
        };
        sundials::KinsolSystem scaled_system{.size = system.size,
                                             .residual =
                                                 [&](auto u, auto f) {
                                                     system.residual(u, f);
                                                     scaled(f);
                                                 },
                                             .linearise = system.linearise};
        if (options_.newton.product == JacobianProduct::analytic)
            scaled_system.jacobian_times = [&](auto s, auto js) {
                system.jacobian_times(s, js);
                scaled(js);
            };
        if (system.precondition)
            scaled_system.precondition = [&](auto z) {
                system.precondition(z);
                for (double& x : z)
                    x *= scale;
            };
        const sundials::KinsolResult result = kinsol_.solve(scaled_system, unknown_, tolerance, typical_unknown());
        counts_.newton_iterations += result.counts.iterations;
        counts_.linear_iterations += result.counts.linear_iterations;
        counts_.residual_evaluations += result.counts.residual_evaluations;
        counts_.jacobian_products += result.counts.jacobian_products;
        counts_.backtracks += result.counts.backtracks;
        return {result.converged, 0.0, result.failure};
    }

    ImplicitOptions options_;
    bool linear_;
    MomentumBalance balance_;
    Preconditioner preconditioner_;
    NewtonKrylov newton_;
    sundials::KinsolSolver kinsol_;
    aligned_vector<double> unknown_, residual_, force_;
    SolverCounts counts_;
    double seconds_[3] = {};
};

} // namespace

std::unique_ptr<TimeStepper> make_implicit_stepper(const Scene& scene, const ImplicitOptions& options) {
    return std::make_unique<ImplicitStepper>(scene, options);
}

} // namespace ductile::mpm
