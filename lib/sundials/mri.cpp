// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/sundials/integration.hpp>
#include <ductile/sundials/mri.hpp>

#include <arkode/arkode_mristep.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace ductile::sundials {

namespace {

constexpr const char* who = "MRI integrator";

void free_stepper(void* stepper) { DUCTILE_MRI(Free)(&stepper); }
void free_inner_stepper(MRIStepInnerStepper stepper) { MRIStepInnerStepper_Free(&stepper); }

} // namespace

class MriIntegrator::Memory {
public:
    explicit Memory(MultirateSystem system)
        : integration_(who, &DUCTILE_MRI(GetReturnFlagName), std::move(system.slow), system.components),
          system_(std::move(system)) {
        MRIStepInnerStepper inner = nullptr;
        call(MRIStepInnerStepper_Create(integration_.context(), &inner), "create the stepper of the fast rate");
        inner_stepper_.reset(inner);
        call(MRIStepInnerStepper_SetContent(inner, this), "take its content");
        call(MRIStepInnerStepper_SetEvolveFn(inner, &Memory::evolve_fast), "take its step");
        call(MRIStepInnerStepper_SetFullRhsFn(inner, &Memory::fast_rate), "take its rate");
        stepper_.reset(made(MRIStepCreate(&Integration::rate, nullptr, 0.0, integration_.state(), inner, integration_.context()),
                            "multirate integrator"));
        void* const stepper = stepper_.get();
        call(DUCTILE_KEEP_MESSAGES(MRIStep, stepper, integration_.note()), "keep its messages");
        call(DUCTILE_MRI(SetUserData)(stepper, &integration_), "take its user data");
        const Owner<MRIStepCoupling, MRIStepCoupling_Free> coupling(made(MRIStepCoupling_LoadTable(ARKODE_MIS_KW3), "coupling"));
        call(MRIStepSetCoupling(stepper, coupling.get()), "take the method");
    }
    Memory(const Memory&) = delete; // its address is the content of the stepper
    Memory& operator=(const Memory&) = delete;

    void integrate(std::span<double> y, double t0, double t1) {
        integration_.begin(y, t0, t1);
        earlier_ = counts();
        void* const stepper = stepper_.get();
        call(MRIStepReInit(stepper, &Integration::rate, nullptr, t0, integration_.state()), "start at the given state");
        call(DUCTILE_MRI(SetFixedStep)(stepper, t1 - t0), "take the step");
        double t = t0;
        // one step, without a stop time, which would return an interpolated state
        const int flag = DUCTILE_MRI(Evolve)(stepper, t0 + 2.0 * (t1 - t0), integration_.state(), &t, ARK_ONE_STEP);
        integration_.check_step(flag, t0);
        std::ranges::copy(integration_.values(), y.begin());
    }

    /// ReInit sets the counters of SUNDIALS to zero.
    [[nodiscard]] Counts counts() {
        long steps = 0;
        call(DUCTILE_MRI(GetNumSteps)(stepper_.get(), &steps), "count steps");
        return {earlier_.steps + steps, 0, integration_.evaluations()};
    }

private:
    void call(int flag, const char* what) { integration_.call(flag, what); }

    static Memory& owner(MRIStepInnerStepper stepper) {
        void* content = nullptr;
        MRIStepInnerStepper_GetContent(stepper, &content);
        return *static_cast<Memory*>(content);
    }

    static int evolve_fast(MRIStepInnerStepper stepper, sunrealtype t0, sunrealtype t1, N_Vector y) {
        Memory& self = owner(stepper);
        sunrealtype shift = 0.0, scale = 0.0;
        N_Vector* forcing = nullptr;
        int terms = 0;
        const int flag = MRIStepInnerStepper_GetForcingData(stepper, &shift, &scale, &forcing, &terms);
        if (flag != 0 || terms != 1) // the method has one coupling matrix: the forcing is constant
            return -1;
        return self.integration_.guarded(view(y), [&] { self.system_.advance_fast(t1 - t0, view(forcing[0]), view(y)); });
    }

    static int fast_rate(MRIStepInnerStepper stepper, sunrealtype t, N_Vector y, N_Vector rate, int) {
        Memory& self = owner(stepper);
        return self.integration_.guarded(view(rate), [&] { self.system_.fast(t, view(y), view(rate)); });
    }

    Integration integration_; // first made, last destroyed
    MultirateSystem system_;
    Owner<MRIStepInnerStepper, free_inner_stepper> inner_stepper_;
    Owner<void*, free_stepper> stepper_;
    Counts earlier_; ///< before the last ReInit
};

MriIntegrator::MriIntegrator(MultirateSystem system) : memory_(std::make_unique<Memory>(std::move(system))) {}
MriIntegrator::~MriIntegrator() = default;

void MriIntegrator::integrate(std::span<double> y, double t0, double t1) { memory_->integrate(y, t0, t1); }

Counts MriIntegrator::counts() const { return memory_->counts(); }

} // namespace ductile::sundials
