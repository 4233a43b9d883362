// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/sundials/ida.hpp>
#include <ductile/sundials/integration.hpp>

#include <ida/ida.h>
#include <sunlinsol/sunlinsol_spgmr.h>

#include <algorithm>
#include <utility>

namespace ductile::sundials {

namespace {

constexpr const char* who = "IDA integrator";

void free_solver(void* solver) { IDAFree(&solver); }

} // namespace

class IdaIntegrator::Memory {
public:
    Memory(DifferentialAlgebraicSystem system, const IdaOptions& options)
        : integration_(who, &IDAGetReturnFlagName, {}, system.components), system_(std::move(system)), options_(options) {
        check_tolerances(who, 0.0, options.absolute_tolerance);
        const N_Vector state = integration_.state();
        rate_.reset(made(N_VClone(state), "vector"));
        N_VConst(0.0, rate_.get());
        const Owner<N_Vector, N_VDestroy> kinds(made(N_VClone(state), "vector"));
        const std::span<double> kind = view(kinds.get());
        for (std::size_t i = 0; i < kind.size(); ++i)
            kind[i] = i < system_.differential ? 1.0 : 0.0;
        solver_.reset(made(IDACreate(integration_.context()), "differential-algebraic integrator"));
        void* const solver = solver_.get();
        call(DUCTILE_KEEP_MESSAGES(IDA, solver, integration_.note()), "keep its messages");
        call(IDAInit(solver, &Memory::residual, 0.0, state, rate_.get()), "take the system");
        call(IDASetUserData(solver, this), "take its user data");
        call(IDASStolerances(solver, 0.0, options.absolute_tolerance), "take the tolerance");
        call(IDASetId(solver, kinds.get()), "take the kinds of the components");
        call(IDASetSuppressAlg(solver, SUNTRUE), "leave algebraic components out of the error test");
        set_limits();
        constexpr int vectors = 30;
        linear_solver_.reset(made(SUNLinSol_SPGMR(state, SUN_PREC_LEFT, vectors, integration_.context()), "linear solver"));
        call(SUNLinSol_SPGMRSetMaxRestarts(linear_solver_.get(), 0), "take the number of restarts");
        call(SUNLinSol_SPGMRSetGSType(linear_solver_.get(), SUN_MODIFIED_GS), "take the orthogonalisation");
        call(IDASetLinearSolver(solver, linear_solver_.get(), nullptr), "take the linear solver");
        call(IDASetEpsLin(solver, 0.05), "take the linear tolerance");
        call(IDASetIncrementFactor(solver, 1.0), "take the increment of difference quotients");
        call(IDASetPreconditioner(solver, nullptr, &Memory::precondition), "take the preconditioner");
    }
    Memory(const Memory&) = delete; // its address is the user data
    Memory& operator=(const Memory&) = delete;

    void integrate(std::span<double> y, std::span<double> rate, double t0, double t1, const DenseOutput& dense) {
        integration_.begin(y, t0, t1);
        std::ranges::copy(rate, view(rate_.get()).begin());
        earlier_ = counts();
        void* const solver = solver_.get();
        call(IDAReInit(solver, t0, integration_.state(), rate_.get()), "start at the given state");
        call(IDASetStopTime(solver, t1), "take the end of the interval");
        double t = t0;
        std::size_t shown = 0;
        for (long long n = 0;; ++n) {
            if (n >= options_.largest_step_count)
                integration_.give_up(options_.largest_step_count, t);
            const double start = t;
            const int flag = IDASolve(solver, t1, &t, integration_.state(), rate_.get(), IDA_ONE_STEP);
            integration_.check_step(flag, start);
            integration_.show(dense, shown, t, solver, &IDAGetDky);
            if (flag == IDA_TSTOP_RETURN)
                break;
        }
        std::ranges::copy(integration_.values(), y.begin());
        std::ranges::copy(view(rate_.get()), rate.begin());
    }

    /// ReInit sets the counters of SUNDIALS to zero.
    [[nodiscard]] Counts counts() {
        long steps = 0, rejected = 0, residuals = 0, for_products = 0;
        void* const solver = solver_.get();
        call(IDAGetNumSteps(solver, &steps), "count steps");
        call(IDAGetNumErrTestFails(solver, &rejected), "count rejections");
        call(IDAGetNumResEvals(solver, &residuals), "count residuals");
        call(IDAGetNumLinResEvals(solver, &for_products), "count residuals");
        return {earlier_.steps + steps, earlier_.rejected + rejected, earlier_.evaluations + residuals + for_products};
    }

private:
    void call(int flag, const char* what) { integration_.call(flag, what); }

    /// Every number that decides about steps and orders: defaults may change from release to release.
    void set_limits() {
        void* const solver = solver_.get();
        call(IDASetMaxOrd(solver, 5), "take the highest order");
        call(IDASetMaxErrTestFails(solver, 50), "take the number of rejections");
        call(IDASetMaxNonlinIters(solver, 4), "take the number of iterations");
        call(IDASetMaxConvFails(solver, 10), "take the number of failed iterations");
        call(IDASetNonlinConvCoef(solver, 0.33), "take the tolerance of the iterations");
        call(IDASetDeltaCjLSetup(solver, 0.25), "take the change of the step that renews the preconditioner");
        call(IDASetEtaFixedStepBounds(solver, 1.0, 2.0), "take the bounds of a step that is kept");
        call(IDASetEtaMax(solver, 2.0), "take the largest growth of a step");
        call(IDASetEtaMin(solver, 0.5), "take the largest reduction of a step");
        call(IDASetEtaLow(solver, 0.9), "take the smallest reduction of a step");
        call(IDASetEtaMinErrFail(solver, 0.25), "take the largest reduction after a rejection");
        call(IDASetEtaConvFail(solver, 0.25), "take the reduction after failed iterations");
    }

    static int residual(sunrealtype t, N_Vector y, N_Vector rate, N_Vector result, void* memory) {
        Memory& self = *static_cast<Memory*>(memory);
        return self.integration_.guarded(view(result), [&] { self.system_.residual(t, view(y), view(rate), view(result)); });
    }

    static int precondition(sunrealtype, N_Vector, N_Vector, N_Vector, N_Vector r, N_Vector z, sunrealtype derivative_factor,
                            sunrealtype, void* memory) {
        Memory& self = *static_cast<Memory*>(memory);
        return self.integration_.guarded(view(z), [&] { self.system_.precondition(derivative_factor, view(r), view(z)); });
    }

    Integration integration_; // first made, last destroyed
    DifferentialAlgebraicSystem system_;
    IdaOptions options_;
    Owner<N_Vector, N_VDestroy> rate_;
    Owner<SUNLinearSolver, SUNLinSolFree> linear_solver_;
    Owner<void*, free_solver> solver_;
    Counts earlier_; ///< before the last ReInit
};

IdaIntegrator::IdaIntegrator(DifferentialAlgebraicSystem system, const IdaOptions& options)
    : memory_(std::make_unique<Memory>(std::move(system), options)) {}
IdaIntegrator::~IdaIntegrator() = default;

void IdaIntegrator::integrate(std::span<double> y, std::span<double> rate, double t0, double t1, const DenseOutput& dense) {
    memory_->integrate(y, rate, t0, t1, dense);
}

Counts IdaIntegrator::counts() const { return memory_->counts(); }

} // namespace ductile::sundials
