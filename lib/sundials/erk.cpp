#include <ductile/base/error.hpp>
#include <ductile/sundials/erk.hpp>

#include <arkode/arkode_erkstep.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <fmt/format.h>
#include <string>
#include <type_traits>
#include <utility>

namespace ductile::sundials {

namespace {

template <auto release> struct Deleter {
    template <class T> void operator()(T* p) const { release(p); }
};
template <class Handle, auto release> using Owner = std::unique_ptr<std::remove_pointer_t<Handle>, Deleter<release>>;

using Context = Owner<SUNContext, [](SUNContext c) { SUNContext_Free(&c); }>;
using Vector = Owner<N_Vector, [](N_Vector v) { N_VDestroy(v); }>;
using Table = Owner<ARKodeButcherTable, [](ARKodeButcherTable t) { ARKodeButcherTable_Free(t); }>;
using Stepper = Owner<void*, [](void* memory) { ERKStepFree(&memory); }>;

template <class Handle> auto* made(Handle* handle, const char* what) {
    if (handle == nullptr)
        throw RunError(fmt::format("SUNDIALS could not create its {}: memory is short or its arguments are wrong", what));
    return handle;
}

void check(const ErkOptions& o, std::size_t components) {
    const auto require = [](bool holds, const char* what) {
        if (!holds)
            throw InputError(fmt::format("ERK integrator: {}", what));
    };
    require(components > 0, "a system needs at least one component");
    require(o.relative_tolerance >= 0.0 && o.absolute_tolerance >= 0.0 && o.relative_tolerance + o.absolute_tolerance > 0.0,
            "tolerances must not be negative, and one of them must be positive");
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

/// ARKODE's names of its flags with advice in place of the number.
std::string explain(int flag) {
    switch (flag) {
    case ARK_TOO_MUCH_WORK:
        return "too many steps between two outputs";
    case ARK_TOO_MUCH_ACC:
        return "the tolerances ask for more than double precision has: loosen them";
    case ARK_ERR_FAILURE:
        return "the error test failed again and again, or the step shrank to its minimum: the right-hand side may be "
               "discontinuous";
    case ARK_RHSFUNC_FAIL:
    case ARK_FIRST_RHSFUNC_ERR:
    case ARK_REPTD_RHSFUNC_ERR:
    case ARK_UNREC_RHSFUNC_ERR:
        return "the right-hand side is not finite (at a stage of the step; a largest step may help)";
    default:
        break;
    }
    char* const name = ERKStepGetReturnFlagName(flag);
    std::string text = name != nullptr ? name : "no name";
    std::free(name);
    return text;
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
        : f_(std::move(f)), options_(options), components_(static_cast<sunindextype>(components)) {
        check(options, components);
        SUNContext context = nullptr;
        if (SUNContext_Create(nullptr, &context) != 0)
            throw RunError("SUNDIALS could not create its context");
        context_.reset(context);
        y_.reset(made(N_VNew_Serial(components_, context), "vector"));
        N_VConst(0.0, y_.get());
        stepper_.reset(made(ERKStepCreate(&Memory::rate, 0.0, y_.get(), context), "explicit Runge-Kutta integrator"));
        void* const stepper = stepper_.get();
        call(ERKStepSetErrHandlerFn(stepper, &Memory::note, this), "install its error handler");
        call(ERKStepSetUserData(stepper, this), "take its user data");
        call(ERKStepSStolerances(stepper, options.relative_tolerance, options.absolute_tolerance), "take the tolerances");
        set_table();
    }
    Memory(const Memory&) = delete;
    Memory& operator=(const Memory&) = delete;

    void integrate(std::span<double> y, double t0, double t1) {
        if (static_cast<sunindextype>(y.size()) != components_)
            throw InputError(fmt::format("ERK integrator: a state of {} components was given, the system has {}", y.size(),
                                         static_cast<long long>(components_)));
        if (!(t1 > t0) || !std::isfinite(t1 - t0))
            throw InputError(fmt::format("ERK integrator: the interval from {} to {} is empty or not finite", t0, t1));
        std::copy(y.begin(), y.end(), N_VGetArrayPointer(y_.get()));
        void* const stepper = stepper_.get();
        collect_counts();
        call(ERKStepReInit(stepper, &Memory::rate, t0, y_.get()), "start at the given state");
        current_ = {}; // it set the counters of SUNDIALS to zero
        if (options_.fixed_step > 0.0)
            fixed_steps(t0, t1);
        else
            adaptive_steps(t0, t1);
        const double* const result = N_VGetArrayPointer(y_.get());
        std::copy_n(result, y.size(), y.begin());
    }

    [[nodiscard]] ErkCounts counts() {
        collect_counts();
        return total_;
    }

private:
    void set_table() {
        if (!options_.table) {
            call(ERKStepSetTableNum(stepper_.get(), ARKODE_DORMAND_PRINCE_7_4_5), "take the method of Dormand and Prince");
            return;
        }
        ErkTable t = *options_.table; // a copy: the C interface wants pointers to non-const
        const Table table(made(ARKodeButcherTable_Create(static_cast<int>(t.c.size()), t.order, t.embedded_order, t.c.data(),
                                                         t.a.data(), t.b.data(), t.d.data()),
                               "Butcher table"));
        call(ERKStepSetTable(stepper_.get(), table.get()), "take the Butcher table");
    }

    /// One by one and without a stop time, which would return an interpolated state.
    void fixed_steps(double t0, double t1) {
        const double steps = std::max(1.0, std::round((t1 - t0) / options_.fixed_step));
        if (steps > static_cast<double>(options_.largest_step_count))
            give_up(t0);
        call(ERKStepSetFixedStep(stepper_.get(), (t1 - t0) / steps), "take the fixed step");
        double t = t0;
        for (long long n = 0; n < static_cast<long long>(steps); ++n)
            evolve(t0 + (t1 - t0) * 2.0, t);
    }

    void adaptive_steps(double t0, double t1) {
        void* const stepper = stepper_.get();
        call(ERKStepSetFixedStep(stepper, 0.0), "switch error control on");
        call(ERKStepSetInitStep(stepper, std::min(options_.first_step, t1 - t0)), "take the first step");
        call(ERKStepSetMaxStep(stepper, options_.largest_step), "take the largest step");
        call(ERKStepSetStopTime(stepper, t1), "take the end of the interval");
        double t = t0;
        for (long long n = 0; evolve(t1, t) != ARK_TSTOP_RETURN;)
            if (++n >= options_.largest_step_count)
                give_up(t);
    }

    [[noreturn]] void give_up(double t) const {
        throw RunError(fmt::format("ERK integrator: more than {} steps are needed (at t = {:.6g}): loosen the tolerances or "
                                   "allow more",
                                   options_.largest_step_count, t));
    }

    /// One step; `t` becomes the time reached. Returns the flag, which is not an error.
    int evolve(double towards, double& t) {
        const int flag = ERKStepEvolve(stepper_.get(), towards, y_.get(), &t, ARK_ONE_STEP);
        if (exception_)
            std::rethrow_exception(std::exchange(exception_, nullptr));
        call(flag, fmt::format("step from t = {:.6g}", t));
        return flag;
    }

    void call(int flag, std::string_view what) {
        const std::string note = std::exchange(note_, {});
        if (flag < 0)
            throw RunError(fmt::format("SUNDIALS could not {}: {}{}{}", what, explain(flag), note.empty() ? "" : "; ", note));
    }

    void collect_counts() {
        long steps = 0, rejected = 0, evaluations = 0;
        call(ERKStepGetNumSteps(stepper_.get(), &steps), "count steps");
        call(ERKStepGetNumErrTestFails(stepper_.get(), &rejected), "count rejections");
        call(ERKStepGetNumRhsEvals(stepper_.get(), &evaluations), "count evaluations");
        total_.steps += steps - current_.steps;
        total_.rejected += rejected - current_.rejected;
        total_.evaluations += evaluations - current_.evaluations;
        current_ = {steps, rejected, evaluations};
    }

    static int rate(sunrealtype t, N_Vector y, N_Vector rate, void* self_pointer) {
        Memory& self = *static_cast<Memory*>(self_pointer);
        const auto size = static_cast<std::size_t>(self.components_);
        const std::span<double> result(N_VGetArrayPointer(rate), size);
        try { // an exception must not cross the frames of a C library
            self.f_(t, std::span<const double>(N_VGetArrayPointer(y), size), result);
        } catch (...) {
            self.exception_ = std::current_exception();
            return -1;
        }
        return std::all_of(result.begin(), result.end(), [](double x) { return std::isfinite(x); }) ? 0 : 1;
    }

    /// Keeps what ARKODE would print.
    static void note(int, const char*, const char*, char* message, void* self_pointer) {
        static_cast<Memory*>(self_pointer)->note_ = message;
    }

    RightHandSide f_;
    ErkOptions options_;
    sunindextype components_;
    Context context_; // first made, last destroyed
    Vector y_;
    Stepper stepper_;
    ErkCounts total_, current_;
    std::exception_ptr exception_;
    std::string note_;
};

ErkIntegrator::ErkIntegrator(RightHandSide f, std::size_t components, const ErkOptions& options)
    : memory_(std::make_unique<Memory>(std::move(f), components, options)) {}
ErkIntegrator::~ErkIntegrator() = default;
ErkIntegrator::ErkIntegrator(ErkIntegrator&&) noexcept = default;
ErkIntegrator& ErkIntegrator::operator=(ErkIntegrator&&) noexcept = default;

void ErkIntegrator::integrate(std::span<double> y, double t0, double t1) { memory_->integrate(y, t0, t1); }

ErkCounts ErkIntegrator::counts() const { return memory_->counts(); }

} // namespace ductile::sundials
