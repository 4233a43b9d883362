// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/sundials/cvode.hpp>
#include <ductile/sundials/integration.hpp>

#include <cvode/cvode.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunlinsol/sunlinsol_spgmr.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace ductile::sundials {

namespace {

constexpr const char* who = "CVODE integrator";

void free_stepper(void* stepper) { CVodeFree(&stepper); }

} // namespace

class CvodeIntegrator::Memory {
public:
    Memory(RightHandSide f, std::size_t components, const CvodeOptions& options)
        : integration_(who, &CVodeGetReturnFlagName, std::move(f), components), options_(options) {
        check_tolerances(who, options.relative_tolerance, options.absolute_tolerance);
        if (!(options.absolute_tolerance > 0.0 && (options.relative_tolerance > 0.0 || options.solver != CvodeSolver::dense)))
            throw InputError(fmt::format("{}: both tolerances must be positive", who));
        if (options.projection && options.method != CvodeMethod::bdf)
            throw InputError(fmt::format("{}: CVODE projects the steps of backward differentiation only", who));
        if (options.largest_step_count <= 0)
            throw InputError(fmt::format("{}: the largest number of steps must be positive", who));
        const N_Vector state = integration_.state();
        stepper_.reset(made(CVodeCreate(options.method == CvodeMethod::bdf ? CV_BDF : CV_ADAMS, integration_.context()),
                            "multistep integrator"));
        void* const stepper = stepper_.get();
        call(DUCTILE_KEEP_MESSAGES(CVode, stepper, integration_.note()), "keep its messages");
        call(CVodeInit(stepper, &Memory::rate, 0.0, state), "take the system");
        call(CVodeSetUserData(stepper, this), "take its user data");
        call(CVodeSStolerances(stepper, options.relative_tolerance, options.absolute_tolerance), "take the tolerances");
        set_solver();
        if (options.projection)
            set_projection();
        set_limits();
    }

    Memory(const Memory&) = delete; // its address is the user data
    Memory& operator=(const Memory&) = delete;

    void integrate(std::span<double> y, double t0, double t1, const StepObserver& observe, const DenseOutput& dense) {
        integration_.begin(y, t0, t1);
        earlier_ = counts();
        void* const stepper = stepper_.get();
        call(CVodeReInit(stepper, t0, integration_.state()), "start at the given state");
        call(CVodeSetStopTime(stepper, t1), "take the end of the interval");
        double t = t0;
        std::size_t shown = 0;
        for (long long n = 0; evolve(t1, t, observe, dense, shown) != CV_TSTOP_RETURN;)
            if (++n >= options_.largest_step_count)
                integration_.give_up(options_.largest_step_count, t);
        std::ranges::copy(integration_.values(), y.begin());
    }

    /// ReInit sets the counters of SUNDIALS to zero.
    [[nodiscard]] Counts counts() {
        long steps = 0, rejected = 0;
        void* const stepper = stepper_.get();
        call(CVodeGetNumSteps(stepper, &steps), "count steps");
        call(CVodeGetNumErrTestFails(stepper, &rejected), "count rejections");
        return {earlier_.steps + steps, earlier_.rejected + rejected, integration_.evaluations()};
    }

private:
    void call(int flag, const char* what) { integration_.call(flag, what); }

    /// Every number that decides about steps and orders: defaults may change from release to release.
    void set_limits() {
        void* const stepper = stepper_.get();
        call(CVodeSetMaxOrd(stepper, options_.method == CvodeMethod::bdf ? 5 : 12), "take the highest order");
        // Seven, the default, is too few where a step of high order meets the corner of a rate at yield.
        call(CVodeSetMaxErrTestFails(stepper, 50), "take the number of rejections");
        call(CVodeSetStabLimDet(stepper, SUNFALSE), "leave the orders to the error test");
        call(CVodeSetMaxNonlinIters(stepper, 3), "take the number of iterations");
        call(CVodeSetMaxConvFails(stepper, 10), "take the number of failed iterations");
        call(CVodeSetNonlinConvCoef(stepper, 0.1), "take the tolerance of the iterations");
        call(CVodeSetLSetupFrequency(stepper, 20), "take the age of the matrix");
        call(CVodeSetDeltaGammaMaxLSetup(stepper, 0.3), "take the change of the step that renews the matrix");
        call(CVodeSetEtaFixedStepBounds(stepper, 0.0, 1.5), "take the bounds of a step that is kept");
        call(CVodeSetEtaMaxFirstStep(stepper, 1e4), "take the largest growth of the first step");
        call(CVodeSetEtaMaxEarlyStep(stepper, 10.0), "take the largest growth of early steps");
        call(CVodeSetNumStepsEtaMaxEarlyStep(stepper, 10), "take the number of early steps");
        call(CVodeSetEtaMax(stepper, 10.0), "take the largest growth of a step");
        call(CVodeSetEtaMin(stepper, 0.1), "take the largest reduction of a step");
        call(CVodeSetEtaMinErrFail(stepper, 0.1), "take the largest reduction after a rejection");
        call(CVodeSetEtaMaxErrFail(stepper, 0.2), "take the smallest reduction after rejections");
        call(CVodeSetNumFailsEtaMaxErrFail(stepper, 2), "take the number of rejections before that reduction");
        call(CVodeSetEtaConvFail(stepper, 0.25), "take the reduction after failed iterations");
    }

    void set_projection() {
        void* const stepper = stepper_.get();
        call(CVodeSetProjFn(stepper, &Memory::project), "take the projection");
        call(CVodeSetProjFrequency(stepper, 1), "project every step");
        call(CVodeSetProjErrEst(stepper, SUNTRUE), "show the projection the error");
        call(CVodeSetMaxNumProjFails(stepper, 10), "take the number of failed projections");
        call(CVodeSetEpsProj(stepper, 0.1), "take the tolerance of the projection");
        call(CVodeSetProjFailEta(stepper, 0.25), "take the reduction after a failed projection");
    }

    void set_solver() {
        void* const stepper = stepper_.get();
        const N_Vector state = integration_.state();
        const SUNContext context = integration_.context();
        switch (options_.solver) {
        case CvodeSolver::dense: {
            const sunindextype size = N_VGetLength(state);
            matrix_.reset(made(SUNDenseMatrix(size, size, context), "dense matrix"));
            linear_solver_.reset(made(SUNLinSol_Dense(state, matrix_.get(), context), "dense linear solver"));
            call(CVodeSetLinearSolver(stepper, linear_solver_.get(), matrix_.get()), "take the linear solver");
            call(CVodeSetJacFn(stepper, &Memory::jacobian), "take the matrix of difference quotients");
            call(CVodeSetJacEvalFrequency(stepper, 51), "take the age of the difference quotients");
            call(CVodeSetDeltaGammaMaxBadJac(stepper, 0.2), "take the change of the step that renews them");
            if (options_.method == CvodeMethod::bdf)
                call(CVodeSetLinearSolutionScaling(stepper, SUNTRUE), "scale the correction");
            break;
        }
        case CvodeSolver::krylov: {
            constexpr int vectors = 20;
            linear_solver_.reset(made(SUNLinSol_SPGMR(state, SUN_PREC_NONE, vectors, context), "linear solver"));
            call(SUNLinSol_SPGMRSetMaxRestarts(linear_solver_.get(), 0), "take the number of restarts");
            call(SUNLinSol_SPGMRSetGSType(linear_solver_.get(), SUN_MODIFIED_GS), "take the orthogonalisation");
            call(CVodeSetLinearSolver(stepper, linear_solver_.get(), nullptr), "take the linear solver");
            call(CVodeSetEpsLin(stepper, 0.05), "take the linear tolerance");
            break;
        }
        case CvodeSolver::fixed_point: {
            constexpr int vectors = 3;
            nonlinear_solver_.reset(made(SUNNonlinSol_FixedPoint(state, vectors, context), "fixed-point iteration"));
            call(CVodeSetNonlinearSolver(stepper, nonlinear_solver_.get()), "take the fixed-point iteration");
            break;
        }
        }
    }

    /// One step; `t` becomes the time reached. Returns the flag, which is not an error.
    int evolve(double towards, double& t, const StepObserver& observe, const DenseOutput& dense, std::size_t& shown) {
        const double start = t;
        const int flag = CVode(stepper_.get(), towards, integration_.state(), &t, CV_ONE_STEP);
        integration_.check_step(flag, start);
        integration_.show(dense, shown, t, stepper_.get(), &CVodeGetDky);
        if (observe)
            observe(t, integration_.values());
        return flag;
    }

    static int rate(sunrealtype t, N_Vector y, N_Vector rate, void* memory) {
        return Integration::rate(t, y, rate, &static_cast<Memory*>(memory)->integration_);
    }

    /// The estimate of the error stays that of the step.
    static int project(sunrealtype t, N_Vector y, N_Vector correction, sunrealtype, N_Vector, void* memory) {
        Memory& self = *static_cast<Memory*>(memory);
        return self.integration_.guarded(view(correction), [&] { self.options_.projection(t, view(y), view(correction)); });
    }

    /// Difference quotients over increments that suit the state. Those of CVODE grow with the rate: where it is enormous, far
    /// beyond yield, they leave the range where a quotient means anything, the matrix becomes so large that Newton's correction
    /// vanishes, and the step is accepted without one.
    static int jacobian(sunrealtype t, N_Vector y, N_Vector f, SUNMatrix matrix, void* memory, N_Vector moved, N_Vector f_moved,
                        N_Vector) {
        Memory& self = *static_cast<Memory*>(memory);
        const double small = self.options_.absolute_tolerance / self.options_.relative_tolerance;
        const double *const state = N_VGetArrayPointer(y), *const rate_there = N_VGetArrayPointer(f);
        double *const moved_state = N_VGetArrayPointer(moved), *const moved_rate = N_VGetArrayPointer(f_moved);
        const sunindextype size = N_VGetLength(y);
        N_VScale(1.0, y, moved);
        for (sunindextype j = 0; j < size; ++j) {
            moved_state[j] = state[j] + 1.5e-8 * std::max(std::abs(state[j]), small); // square root of the rounding unit
            const double increment = moved_state[j] - state[j];
            if (const int status = rate(t, moved, f_moved, memory); status != 0)
                return status;
            double* const column = SUNDenseMatrix_Column(matrix, j);
            for (sunindextype i = 0; i < size; ++i)
                column[i] = (moved_rate[i] - rate_there[i]) / increment;
            moved_state[j] = state[j];
        }
        return 0;
    }

    Integration integration_; // first made, last destroyed
    CvodeOptions options_;
    Owner<SUNMatrix, SUNMatDestroy> matrix_;
    Owner<SUNLinearSolver, SUNLinSolFree> linear_solver_;
    Owner<SUNNonlinearSolver, SUNNonlinSolFree> nonlinear_solver_;
    Owner<void*, free_stepper> stepper_;
    Counts earlier_; ///< before the last ReInit
};

CvodeIntegrator::CvodeIntegrator(RightHandSide f, std::size_t components, const CvodeOptions& options)
    : memory_(std::make_unique<Memory>(std::move(f), components, options)) {}
CvodeIntegrator::~CvodeIntegrator() = default;
CvodeIntegrator::CvodeIntegrator(CvodeIntegrator&&) noexcept = default;
CvodeIntegrator& CvodeIntegrator::operator=(CvodeIntegrator&&) noexcept = default;

void CvodeIntegrator::integrate(std::span<double> y, double t0, double t1, const StepObserver& observe,
                                const DenseOutput& dense) {
    memory_->integrate(y, t0, t1, observe, dense);
}

Counts CvodeIntegrator::counts() const { return memory_->counts(); }

} // namespace ductile::sundials
