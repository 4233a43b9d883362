// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/sundials/erk.hpp>
#include <ductile/sundials/integration.hpp>

#include <arkode/arkode_erkstep.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace ductile::sundials {

namespace {

constexpr const char* who = "ERK integrator";

void free_stepper(void* stepper) { DUCTILE_ERK(Free)(&stepper); }

void check(const ErkOptions& o) {
    const auto require = [](bool holds, const char* what) {
        if (!holds)
            throw InputError(fmt::format("{}: {}", who, what));
    };
    check_tolerances(who, o.relative_tolerance, o.absolute_tolerance);
    require(o.fixed_step >= 0.0 && std::isfinite(o.fixed_step), "the fixed step must be finite, and zero or positive");
    require(o.first_step >= 0.0 && std::isfinite(o.first_step), "the first step must be finite, and zero or positive");
    require(o.largest_step >= 0.0, "the largest step must be zero or positive");
    require(o.largest_step_count > 0, "the largest number of steps must be positive");
    if (o.table) {
        const std::size_t stages = o.table->c.size();
        require(stages > 0 && o.table->a.size() == stages * stages && o.table->b.size() == stages && o.table->d.size() == stages,
                "the table must have as many weights b and d as nodes c, and a square matrix a");
        require(o.table->order > 0 && o.table->embedded_order > 0, "the orders of the table must be positive");
    }
}

ARKODE_ERKTableID table_of(ErkMethod method) {
    switch (method) {
    case ErkMethod::bogacki_shampine:
        return ARKODE_BOGACKI_SHAMPINE_4_2_3;
    case ErkMethod::zonneveld:
        return ARKODE_ZONNEVELD_5_3_4;
    case ErkMethod::cash_karp:
        return ARKODE_CASH_KARP_6_4_5;
    case ErkMethod::dormand_prince:
        break;
    }
    return ARKODE_DORMAND_PRINCE_7_4_5;
}

} // namespace

ErkTable paper_rk21() {
    return {.order = 2,
            .embedded_order = 1,
            .c = {0.0, 2.0 / 3.0, 1.0},
            .a = {0.0, 0.0, 0.0, 2.0 / 3.0, 0.0, 0.0, 1.0 / 4.0, 3.0 / 4.0, 0.0},
            .b = {1.0 / 4.0, 3.0 / 4.0, 0.0},
            .d = {1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0}};
}

class ErkIntegrator::Memory {
public:
    Memory(RightHandSide f, std::size_t components, const ErkOptions& options)
        : integration_(who, &DUCTILE_ERK(GetReturnFlagName), std::move(f), components), options_(options) {
        check(options);
        stepper_.reset(made(ERKStepCreate(&Memory::rate, 0.0, integration_.state(), integration_.context()),
                            "explicit Runge-Kutta integrator"));
        void* const stepper = stepper_.get();
        call(DUCTILE_KEEP_MESSAGES(ERKStep, stepper, integration_.note()), "keep its messages");
        call(DUCTILE_ERK(SetUserData)(stepper, this), "take its user data");
        call(DUCTILE_ERK(SStolerances)(stepper, options.relative_tolerance, options.absolute_tolerance), "take the tolerances");
        // Those of a higher degree would ask for rates within the step.
        call(DUCTILE_ERK(SetInterpolantDegree)(stepper, 3), "take the degree of the interpolant");
        // Seven, the default, is too few where a long step meets the corner of a rate at yield.
        call(DUCTILE_ERK(SetMaxErrTestFails)(stepper, 50), "take the number of rejections");
        set_table();
        set_step_control();
    }

    Memory(const Memory&) = delete; // its address is the user data
    Memory& operator=(const Memory&) = delete;

    void integrate(std::span<double> y, double t0, double t1, const StepObserver& observe, const DenseOutput& dense) {
        integration_.begin(y, t0, t1);
        dense_ = &dense;
        shown_ = 0;
        earlier_ = counts();
        call(ERKStepReInit(stepper_.get(), &Memory::rate, t0, integration_.state()), "start at the given state");
        if (options_.fixed_step > 0.0)
            fixed_steps(t0, t1, observe);
        else
            adaptive_steps(t0, t1, observe);
        std::ranges::copy(integration_.values(), y.begin());
    }

    /// ReInit sets the counters of SUNDIALS to zero.
    [[nodiscard]] Counts counts() {
        long steps = 0, rejected = 0;
        call(DUCTILE_ERK(GetNumSteps)(stepper_.get(), &steps), "count steps");
        call(DUCTILE_ERK(GetNumErrTestFails)(stepper_.get(), &rejected), "count rejections");
        return {earlier_.steps + steps, earlier_.rejected + rejected, integration_.evaluations()};
    }

private:
    void call(int flag, const char* what) { integration_.call(flag, what); }

    void set_table() {
        if (!options_.table) {
            call(ERKStepSetTableNum(stepper_.get(), table_of(options_.method)), "take the method");
            return;
        }
        ErkTable t = *options_.table; // a copy: the C interface wants pointers to non-const
        const Owner<ARKodeButcherTable, ARKodeButcherTable_Free> table(
            made(ARKodeButcherTable_Create(static_cast<int>(t.c.size()), t.order, t.embedded_order, t.c.data(), t.a.data(),
                                           t.b.data(), t.d.data()),
                 "Butcher table"));
        call(ERKStepSetTable(stepper_.get(), table.get()), "take the Butcher table");
    }

    /// Every number that the step control uses: defaults may change from release to release.
    struct Factors {
        StepController controller;
        double safety, growth, first_growth, reduction, growth_after_rejections, keep_above, keep_below;
    };

    void set_step_control() {
        const bool ours = options_.step_control == StepControl::lu_rycroft;
        const int orders_apart = options_.table ? options_.table->order - options_.table->embedded_order : 1;
        const Factors f = ours ? Factors{.controller = {.k1 = 1.0, .order_above_embedded = orders_apart},
                                         .safety = 0.9,
                                         .growth = 3.0,
                                         .first_growth = 3.0,
                                         .reduction = 1.0 / 3.0,
                                         .growth_after_rejections = 1.0,
                                         .keep_above = 1.0,
                                         .keep_below = 1.0}
                               : Factors{.controller = {.k1 = 0.8, .k2 = 0.31, .bias = 1.2},
                                         .safety = 0.99,
                                         .growth = 25.0,
                                         .first_growth = 1e4,
                                         .reduction = 0.1,
                                         .growth_after_rejections = 0.3,
                                         .keep_above = 1.0,
                                         .keep_below = 1.5};
        void* const stepper = stepper_.get();
        call(set_controller(stepper, integration_.context(), controller_, f.controller), "take the step control");
        call(DUCTILE_ERK(SetSafetyFactor)(stepper, f.safety), "take the safety factor");
        call(DUCTILE_ERK(SetMaxGrowth)(stepper, f.growth), "take the largest growth of a step");
        call(DUCTILE_ERK(SetMaxFirstGrowth)(stepper, f.first_growth), "take the largest growth of the first step");
        call(DUCTILE_ERK(SetMinReduction)(stepper, f.reduction), "take the largest reduction of a step");
        call(DUCTILE_ERK(SetMaxEFailGrowth)(stepper, f.growth_after_rejections), "take the factor after rejections");
        call(DUCTILE_ERK(SetSmallNumEFails)(stepper, 2), "take the number of rejections before that factor");
        call(DUCTILE_ERK(SetFixedStepBounds)(stepper, f.keep_above, f.keep_below), "take the bounds of a step that is kept");
    }

    /// One by one and without a stop time, which would return an interpolated state.
    void fixed_steps(double t0, double t1, const StepObserver& observe) {
        const double steps = std::max(1.0, std::round((t1 - t0) / options_.fixed_step));
        if (steps > static_cast<double>(options_.largest_step_count))
            integration_.give_up(options_.largest_step_count, t0);
        call(DUCTILE_ERK(SetFixedStep)(stepper_.get(), (t1 - t0) / steps), "take the fixed step");
        double t = t0;
        for (long long n = 0; n < static_cast<long long>(steps); ++n)
            evolve(t0 + (t1 - t0) * 2.0, t, observe);
    }

    void adaptive_steps(double t0, double t1, const StepObserver& observe) {
        void* const stepper = stepper_.get();
        call(DUCTILE_ERK(SetFixedStep)(stepper, 0.0), "switch error control on");
        const bool whole_interval = options_.step_control == StepControl::lu_rycroft && options_.first_step == 0.0;
        const double first_step = whole_interval ? t1 - t0 : std::min(options_.first_step, t1 - t0);
        call(DUCTILE_ERK(SetInitStep)(stepper, first_step), "take the first step");
        call(DUCTILE_ERK(SetMaxStep)(stepper, options_.largest_step), "take the largest step");
        call(DUCTILE_ERK(SetStopTime)(stepper, t1), "take the end of the interval");
        double t = t0;
        for (long long n = 0; evolve(t1, t, observe) != ARK_TSTOP_RETURN;)
            if (++n >= options_.largest_step_count)
                integration_.give_up(options_.largest_step_count, t);
    }

    /// One step; `t` becomes the time reached. Returns the flag, which is not an error.
    int evolve(double towards, double& t, const StepObserver& observe) {
        step_start_ = t;
        const int flag = DUCTILE_ERK(Evolve)(stepper_.get(), towards, integration_.state(), &t, ARK_ONE_STEP);
        integration_.check_step(flag, step_start_);
        if (!last_rate_finite_) // that of the state reached
            integration_.check_step(ARK_UNREC_RHSFUNC_ERR, t);
        integration_.show(*dense_, shown_, t, stepper_.get(), &DUCTILE_ERK(GetDky));
        if (observe)
            observe(t, integration_.values());
        return flag;
    }

    /// ERKStep ends when the rate of a stage fails. A rate beyond all bounds makes its error test reject the step
    /// instead; at the beginning of a step, where no shorter one helps, and without an error test it remains a failure.
    static int rate(sunrealtype t, N_Vector y, N_Vector rate, void* memory) {
        Memory& self = *static_cast<Memory*>(memory);
        const int status = Integration::rate(t, y, rate, &self.integration_);
        self.last_rate_finite_ = status == 0;
        if (status <= 0 || self.options_.fixed_step > 0.0 || t == self.step_start_)
            return status;
        N_VConst(1e150, rate);
        return 0;
    }

    Integration integration_; // first made, last destroyed
    ErkOptions options_;
    ControllerMemory controller_;
    Owner<void*, free_stepper> stepper_;
    Counts earlier_;                     ///< before the last ReInit
    const DenseOutput* dense_ = nullptr; ///< of the current interval
    std::size_t shown_ = 0;              ///< of its times
    double step_start_ = 0.0;
    bool last_rate_finite_ = true;
};

ErkIntegrator::ErkIntegrator(RightHandSide f, std::size_t components, const ErkOptions& options)
    : memory_(std::make_unique<Memory>(std::move(f), components, options)) {}
ErkIntegrator::~ErkIntegrator() = default;
ErkIntegrator::ErkIntegrator(ErkIntegrator&&) noexcept = default;
ErkIntegrator& ErkIntegrator::operator=(ErkIntegrator&&) noexcept = default;

void ErkIntegrator::integrate(std::span<double> y, double t0, double t1, const StepObserver& observe, const DenseOutput& dense) {
    memory_->integrate(y, t0, t1, observe, dense);
}

Counts ErkIntegrator::counts() const { return memory_->counts(); }

} // namespace ductile::sundials
