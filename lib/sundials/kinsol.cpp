// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/sundials/handles.hpp>
#include <ductile/sundials/kinsol.hpp>
#include <ductile/sundials/release.hpp>

#include <kinsol/kinsol.h>
#include <sunlinsol/sunlinsol_pcg.h>
#include <sunlinsol/sunlinsol_spbcgs.h>
#include <sunlinsol/sunlinsol_spfgmr.h>
#include <sunlinsol/sunlinsol_spgmr.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <fmt/format.h>
#include <limits>
#include <utility>

namespace ductile::sundials {

namespace {

void free_solver(void* solver) { KINFree(&solver); }

/// What KINSOL's flags mean to someone who wants a solution; its own names of some of them are missing.
std::string explain(int flag) {
    switch (flag) {
    case KIN_STEP_LT_STPTOL:
        return "the Newton step became too small to change the solution while the residual was still above the tolerance";
    case KIN_LINESEARCH_NONCONV:
        return "the line search found no step that lowers the residual: the Jacobian products may be inaccurate";
    case KIN_MAXITER_REACHED:
        return "too many Newton iterations";
    case KIN_MXNEWT_5X_EXCEEDED:
        return "five Newton steps in a row had the largest length allowed";
    case KIN_LINESEARCH_BCFAIL:
        return "the line search could not satisfy its second condition";
    case KIN_LINSOLV_NO_RECOVERY:
    case KIN_LSOLVE_FAIL:
        return "the linear solver failed: more Krylov vectors or a better preconditioner may help";
    case KIN_LINIT_FAIL:
    case KIN_LSETUP_FAIL:
        return "the preconditioner could not be set up";
    case KIN_SYSFUNC_FAIL:
    case KIN_FIRST_SYSFUNC_ERR:
    case KIN_REPTD_SYSFUNC_ERR:
        return "the residual is not finite";
    case KIN_VECTOROP_ERR:
        return "an operation on vectors failed";
    default:
        return fmt::format("KINSOL ended with its flag {}", flag);
    }
}

} // namespace

class KinsolSolver::Memory {
public:
    Memory(const KinsolOptions& options, std::size_t size, bool products, bool preconditioned)
        : size_(size), products_(products), preconditioned_(preconditioned), context_(make_context(message_)) {
        SUNContext const context = context_.get();
        for (auto* vector : {&u_, &u_scale_, &f_scale_})
            vector->reset(made(N_VNew_Serial(index_of(size), context), "vector"));
        N_VConst(1.0, f_scale_.get());
        solver_.reset(made(KINCreate(context), "nonlinear solver"));
        void* const solver = solver_.get();
        call(DUCTILE_KEEP_MESSAGES(KIN, solver, &message_), "keep its messages");
        call(KINSetUserData(solver, this), "take its user data");
        call(KINInit(solver, &Memory::residual, u_.get()), "start");
        const int side = preconditioned ? SUN_PREC_RIGHT : SUN_PREC_NONE;
        const int vectors = options.krylov_vectors;
        const auto linear = [&]() -> SUNLinearSolver {
            switch (options.linear) {
            case KrylovSolver::flexible_gmres:
                return SUNLinSol_SPFGMR(u_.get(), side, vectors, context);
            case KrylovSolver::bicgstab:
                return SUNLinSol_SPBCGS(u_.get(), side, vectors, context);
            case KrylovSolver::conjugate_gradients:
                return SUNLinSol_PCG(u_.get(), side, vectors, context);
            case KrylovSolver::gmres:
                break;
            }
            return SUNLinSol_SPGMR(u_.get(), side, vectors, context);
        };
        linear_.reset(made(linear(), "linear solver"));
        call(KINSetLinearSolver(solver, linear_.get(), nullptr), "take the linear solver");
        if (products)
            call(KINSetJacTimesVecFn(solver, &Memory::times), "take the Jacobian products");
        if (preconditioned)
            call(KINSetPreconditioner(solver, &Memory::set_up, &Memory::precondition), "take the preconditioner");
        call(KINSetMaxSetupCalls(solver, 1), "renew the preconditioner at every iterate");
        call(KINSetNumMaxIters(solver, options.largest_iterations), "take the number of iterations");
        call(KINSetRelErrFunc(solver, options.difference_increment * options.difference_increment), "take the error of F");
        // every number that decides about steps: defaults may change from release to release
        call(KINSetScaledStepTol(solver, std::pow(std::numeric_limits<double>::epsilon(), 2.0 / 3.0)), "take the smallest step");
        call(KINSetMaxBetaFails(solver, 10), "take the number of failed line searches");
        // the default would be 1 for a guess of zero, whatever the units
        call(KINSetMaxNewtonStep(solver, 1e10), "take the largest step");
        call(KINSetNoMinEps(solver, SUNTRUE), "take the forcing as it is");
        if (options.eisenstat_walker) {
            call(KINSetEtaForm(solver, KIN_ETACHOICE2), "take the forcing");
            call(KINSetEtaParams(solver, 0.9, 2.0), "take the forcing's parameters");
        } else {
            call(KINSetEtaForm(solver, KIN_ETACONSTANT), "take the forcing");
            call(KINSetEtaConstValue(solver, options.linear_tolerance), "take the linear tolerance");
        }
        if (options.linear == KrylovSolver::gmres) {
            call(SUNLinSol_SPGMRSetMaxRestarts(linear_.get(), 0), "take the number of restarts");
            call(SUNLinSol_SPGMRSetGSType(linear_.get(), SUN_MODIFIED_GS), "take the orthogonalisation");
        } else if (options.linear == KrylovSolver::flexible_gmres) {
            call(SUNLinSol_SPFGMRSetMaxRestarts(linear_.get(), 0), "take the number of restarts");
            call(SUNLinSol_SPFGMRSetGSType(linear_.get(), SUN_MODIFIED_GS), "take the orthogonalisation");
        }
    }
    Memory(const Memory&) = delete;
    Memory& operator=(const Memory&) = delete;

    [[nodiscard]] bool fits(const KinsolSystem& system) const {
        return system.size == size_ && bool(system.jacobian_times) == products_ && bool(system.precondition) == preconditioned_;
    }

    KinsolResult solve(const KinsolSystem& system, std::span<double> u, double tolerance, double typical_u) {
        system_ = &system;
        linearised_ = false;
        std::copy(u.begin(), u.end(), view(u_.get()).begin());
        N_VConst(1.0 / typical_u, u_scale_.get());
        call(KINSetFuncNormTol(solver_.get(), tolerance), "take the tolerance");
        const int flag = KINSol(solver_.get(), u_.get(), KIN_LINESEARCH, u_scale_.get(), f_scale_.get());
        if (exception_)
            std::rethrow_exception(std::exchange(exception_, nullptr));
        const std::span<const double> end = view(u_.get());
        std::copy(end.begin(), end.end(), u.begin());
        KinsolResult result{.converged = flag == KIN_SUCCESS || flag == KIN_INITIAL_GUESS_OK, .counts = counts()};
        if (!result.converged) {
            double norm = 0.0;
            call(KINGetFuncNorm(solver_.get(), &norm), "say how far it came");
            result.failure = fmt::format("{} (after {} Newton and {} linear iterations, {} of the linear solves short of their "
                                         "tolerance; residual {:.3g}, tolerance {:.3g})",
                                         explain(flag), result.counts.iterations, result.counts.linear_iterations,
                                         result.counts.linear_failures, norm, tolerance);
        }
        return result;
    }

private:
    [[nodiscard]] KinsolCounts counts() {
        long numbers[7] = {};
        call(KINGetNumNonlinSolvIters(solver_.get(), &numbers[0]), "count iterations");
        call(KINGetNumLinIters(solver_.get(), &numbers[1]), "count linear iterations");
        call(KINGetNumFuncEvals(solver_.get(), &numbers[2]), "count evaluations");
        call(KINGetNumLinFuncEvals(solver_.get(), &numbers[3]), "count difference quotients");
        call(KINGetNumJtimesEvals(solver_.get(), &numbers[4]), "count products");
        call(KINGetNumBacktrackOps(solver_.get(), &numbers[5]), "count backtracks");
        call(KINGetNumLinConvFails(solver_.get(), &numbers[6]), "count linear failures");
        return {.iterations = numbers[0],
                .linear_iterations = numbers[1],
                .residual_evaluations = numbers[2] + numbers[3],
                .jacobian_products = products_ ? numbers[4] : 0,
                .backtracks = numbers[5],
                .linear_failures = numbers[6]};
    }

    static void call(int flag, const char* what) {
        if (flag < 0)
            throw RunError(fmt::format("SUNDIALS' KINSOL could not {}: {}", what, explain(flag)));
    }

    /// Runs `action`; an exception must not cross the frames of a C library. The result is a flag for KINSOL.
    int guarded(const auto& action) {
        try {
            action();
            return 0;
        } catch (...) {
            exception_ = std::current_exception();
            return -1;
        }
    }

    static int residual(N_Vector u, N_Vector f, void* self_pointer) {
        Memory& self = *static_cast<Memory*>(self_pointer);
        const std::span<double> result = view(f);
        const int flag = self.guarded([&] { self.system_->residual(view(u), result); });
        const bool finite = std::all_of(result.begin(), result.end(), [](double x) { return std::isfinite(x); });
        return flag != 0 ? flag : finite ? 0 : 1;
    }

    static int set_up(N_Vector u, N_Vector, N_Vector, N_Vector, void* self_pointer) {
        Memory& self = *static_cast<Memory*>(self_pointer);
        self.linearised_ = true;
        return self.guarded([&] { self.system_->linearise(view(u)); });
    }

    static int precondition(N_Vector, N_Vector, N_Vector, N_Vector, N_Vector z, void* self_pointer) {
        Memory& self = *static_cast<Memory*>(self_pointer);
        return self.guarded([&] { self.system_->precondition(view(z)); });
    }

    static int times(N_Vector s, N_Vector js, N_Vector u, sunbooleantype* new_u, void* self_pointer) {
        Memory& self = *static_cast<Memory*>(self_pointer);
        return self.guarded([&] {
            if (*new_u && !std::exchange(self.linearised_, false))
                self.system_->linearise(view(u));
            *new_u = SUNFALSE;
            self.system_->jacobian_times(view(s), view(js));
        });
    }

    std::size_t size_;
    bool products_, preconditioned_;
    std::string message_; // of SUNDIALS, which explain() says better
    Context context_;     // first made, last destroyed
    Owner<N_Vector, N_VDestroy> u_, u_scale_, f_scale_;
    Owner<SUNLinearSolver, SUNLinSolFree> linear_;
    Owner<void*, free_solver> solver_;
    const KinsolSystem* system_ = nullptr;
    bool linearised_ = false; // the preconditioner's set-up has done so at this iterate
    std::exception_ptr exception_;
};

KinsolSolver::KinsolSolver(const KinsolOptions& options) : options_(options) {}
KinsolSolver::~KinsolSolver() = default;
KinsolSolver::KinsolSolver(KinsolSolver&&) noexcept = default;
KinsolSolver& KinsolSolver::operator=(KinsolSolver&&) noexcept = default;

KinsolResult KinsolSolver::solve(const KinsolSystem& system, std::span<double> u, double tolerance, double typical_u) {
    if (u.size() != system.size || system.size == 0)
        throw InputError(fmt::format("KINSOL: a guess of {} components was given, the system has {}", u.size(), system.size));
    if (!memory_ || !memory_->fits(system))
        memory_ = std::make_unique<Memory>(options_, system.size, bool(system.jacobian_times), bool(system.precondition));
    return memory_->solve(system, u, tolerance, typical_u);
}

} // namespace ductile::sundials
