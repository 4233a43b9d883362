// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/quasistatic/index_reduced.hpp>
#include <ductile/quasistatic/schemes.hpp>
#include <ductile/time/arkode.hpp>
#include <ductile/time/chebyshev.hpp>
#include <ductile/time/runge_kutta.hpp>
#include <ductile/time/switching.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <map>

namespace ductile::quasistatic {

namespace {

using Method = std::unique_ptr<CellMethod>;
using MakeMethod = std::function<Method(RateSystem&, const SchemeOptions&)>;

Method runge_kutta(RateSystem& system, std::string_view table) {
    return std::make_unique<time::RungeKutta<CellState>>(system, time::butcher_table(table));
}

Method chebyshev(RateSystem& system) { return std::make_unique<time::Chebyshev<CellState>>(system); }

/// Bogacki and Shampine's, and where the plastic flow is so stiff that it holds the steps far below what the tolerance allows for
/// long, Runge-Kutta-Chebyshev until it no longer does.
Method automatic(RateSystem& system, double tolerance) {
    using Switching = time::Switching<CellState>;
    return std::make_unique<Switching>(Switching::Named{"bogacki-shampine", runge_kutta(system, "bogacki-shampine")},
                                       Switching::Named{"chebyshev", chebyshev(system)}, tolerance);
}

/// A scheme on the index-reduced method of lines.
Scheme by_rates(Scheme scheme, const MakeMethod& make_method) {
    scheme.make = [name = scheme.name, make_method](const Scene& scene, std::unique_ptr<Space> space,
                                                    const SchemeOptions& options) {
        return std::make_unique<IndexReducedStepper>(name, scene, std::move(space), options.passes,
                                                     [&](RateSystem& system) { return make_method(system, options); });
    };
    return scheme;
}

Scheme by_arkode(std::string name, const std::string& method, double fields, const sundials::ErkOptions& erk) {
    return by_rates({std::move(name), "index-reduced, ARKODE with " + method, SchemeKind::sundials, fields},
                    [erk](RateSystem& system, const SchemeOptions& o) {
                        return std::make_unique<time::Arkode<CellState>>(
                            system,
                            time::InnerSteps{.tolerance = o.tolerance, .fixed = o.fixed_steps, .poll = end_if_interrupted}, erk);
                    });
}

Scheme by_projection(std::string name, std::string meaning, double fields, Predictor predictor,
                     Transport transport = Transport::frozen) {
    Scheme scheme{std::move(name), std::move(meaning), SchemeKind::projection, fields};
    scheme.make = [=](const Scene& scene, std::unique_ptr<Space> space, const SchemeOptions& o) {
        return std::make_unique<ProjectionStepper>(scene, predictor, o.pointwise, std::move(space), transport);
    };
    return scheme;
}

std::vector<Scheme> make_schemes() {
    using enum SchemeKind;
    using enum Scheme::Steps;
    using sundials::ErkMethod;
    std::vector<Scheme> all{
        by_rates({"auto", "bogacki-shampine, and chebyshev where plastic flow is stiff", index_reduced, 47.0, 3},
                 [](RateSystem& system, const SchemeOptions& o) { return automatic(system, o.tolerance); }),
        by_projection("euler", "first-order projection, forward Euler", 26.0, Predictor::euler),
        by_projection("substepped", "first-order projection, substepped plasticity", 21.0, Predictor::substepped),
        by_projection("incremental", "second-order incremental projection", 21.0, Predictor::incremental),
        by_projection("extrapolated", "second-order incremental projection, spin and advection extrapolated", 28.0,
                      Predictor::incremental, Transport::extrapolated)};
    for (const time::ButcherTable& t : time::butcher_tables())
        all.push_back(by_rates(
            {std::string(t.name), "index-reduced " + std::string(t.meaning), index_reduced,
             22.0 + 5.0 * static_cast<double>(t.stages()), t.estimate_order},
            [&t](RateSystem& system, const SchemeOptions&) { return std::make_unique<time::RungeKutta<CellState>>(system, t); }));
    all.push_back(by_rates({"chebyshev", "index-reduced Runge-Kutta-Chebyshev (order 2)", index_reduced, 37.0, 3, any, 2},
                           [](RateSystem& system, const SchemeOptions&) { return chebyshev(system); }));
    all.push_back(by_arkode("arkode-2", "Ralston's pair (order 2)", 80.0, {.table = sundials::paper_rk21()}));
    all.push_back(by_arkode("arkode-3", "Bogacki-Shampine (order 3)", 80.0, {.method = ErkMethod::bogacki_shampine}));
    all.push_back(by_arkode("arkode-4", "Zonneveld (order 4)", 90.0, {.method = ErkMethod::zonneveld}));
    all.push_back(by_arkode("arkode-5", "Dormand-Prince (order 5)", 100.0, {.method = ErkMethod::dormand_prince}));
    all.push_back(by_rates(
        {"cvode-adams", "index-reduced, CVODE with Adams-Moulton formulas", SchemeKind::sundials, 170.0, 0, adaptive},
        [](RateSystem& system, const SchemeOptions& o) { return make_cvode(system, CvodeFormulas::adams, o.tolerance); }));
    all.push_back(by_rates({"cvode-bdf", "index-reduced, CVODE with backward differentiation and projected steps",
                            SchemeKind::sundials, 220.0, 0, adaptive},
                           [](RateSystem& system, const SchemeOptions& o) {
                               return make_cvode(system, CvodeFormulas::bdf_projected, o.tolerance);
                           }));
    all.push_back(by_rates({"ida", "system of index 1, IDA", SchemeKind::sundials, 280.0, 0, adaptive},
                           [](RateSystem& system, const SchemeOptions& o) { return make_ida(system, o.tolerance); }));
    all.push_back(
        by_rates({"mri", "ARKODE's MRIStep: plastic flow fast, the rest slow (order 3)", SchemeKind::sundials, 110.0, 0, fixed},
                 [](RateSystem& system, const SchemeOptions& o) { return make_mri(system, o.tolerance); }));
    const std::map<std::string_view, double> kept{{"dormand-prince", 1e-5}, {"arkode-5", 1e-6}, {"cvode-bdf", 1e-4}};
    for (Scheme& scheme : all)
        if (const auto found = kept.find(scheme.name); found != kept.end())
            scheme.kept_tolerance = found->second;
    return all;
}

} // namespace

std::span<const Scheme> schemes() {
    static const std::vector<Scheme> all = make_schemes();
    return all;
}

double step_tolerance(const Scheme& scheme, double tolerance) {
    constexpr double loose = 1e-3;
    if (scheme.order == 0 || tolerance >= loose)
        return tolerance;
    return loose * std::pow(tolerance / loose, static_cast<double>(scheme.estimate_order) / scheme.order);
}

const Scheme& scheme_named(std::string_view name) {
    const auto all = schemes();
    const auto found = std::ranges::find(all, name, &Scheme::name);
    if (found == all.end())
        throw InputError(fmt::format("there is no scheme '{}'", name));
    return *found;
}

std::unique_ptr<TimeStepper> make_stepper(std::string_view name, const Scene& scene, std::unique_ptr<Space> space,
                                          const SchemeOptions& options) {
    const Scheme& scheme = scheme_named(name);
    if (options.fixed_steps && scheme.steps == Scheme::Steps::adaptive)
        throw InputError(fmt::format("--step fixed: {} chooses its steps: use --step adaptive", name));
    if (!options.fixed_steps && scheme.steps == Scheme::Steps::fixed)
        throw InputError(fmt::format("--step adaptive: {} has fixed steps only: use --step fixed and --dt", name));
    return scheme.make(scene, std::move(space), options);
}

} // namespace ductile::quasistatic
