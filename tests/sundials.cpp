// SPDX-License-Identifier: GPL-3.0-or-later
#include "messages.hpp"
#include <ductile/base/error.hpp>
#include <ductile/sundials/cvode.hpp>
#include <ductile/sundials/erk.hpp>

#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace sundials_suite {

using namespace ductile;
using namespace ductile::sundials;

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// x' = x cos t from x(0) = 1: exp(sin t). Time is passed on.
void driven(double t, std::span<const double> x, std::span<double> rate) { rate[0] = x[0] * std::cos(t); }

/// Its error at t = 2 after equal steps.
double error_of(ErkOptions options, double step) {
    options.fixed_step = step;
    ErkIntegrator integrator(driven, 1, options);
    std::vector<double> x{1.0};
    integrator.integrate(x, 0.0, 2.0);
    CHECK(integrator.counts().steps == std::lround(2.0 / step));
    return std::abs(x[0] - std::exp(std::sin(2.0)));
}

/// What an integrator says when it fails; the state must then be as it was.
template <class Integrator, class Options> std::string failure(RightHandSide f, const Options& options) {
    Integrator integrator(std::move(f), 1, options);
    std::vector<double> x{1.0};
    try {
        integrator.integrate(x, 0.0, 1.0);
    } catch (const RunError& error) {
        CHECK(x[0] == 1.0);
        return error.what();
    } catch (const std::logic_error& error) {
        CHECK(x[0] == 1.0);
        return std::string("passed through: ") + error.what();
    }
    return "nothing";
}

} // namespace

TEST_SUITE("sundials") {
    TEST_CASE_TEMPLATE("circles, again and again", Integrator, ErkIntegrator, CvodeIntegrator) {
        int calls = 0;
        Integrator circle(
            [&](double, std::span<const double> y, std::span<double> rate) {
                ++calls;
                rate[0] = -y[1];
                rate[1] = y[0];
            },
            2);
        std::vector<double> y{1.0, 0.0}, times;
        double radius = 1.0;
        for (int turn = 0; turn < 3; ++turn) {
            circle.integrate(y, turn, turn + 1.0, [&](double t, std::span<const double> x) {
                times.push_back(t);
                radius = std::hypot(x[0], x[1]);
            });
            CHECK(std::abs(y[0] - std::cos(turn + 1.0)) < 1e-7);
            CHECK(std::abs(y[1] - std::sin(turn + 1.0)) < 1e-7);
            CHECK(std::abs(radius - 1.0) < 1e-7);
            CHECK(times.back() == turn + 1.0);
        }
        CHECK(circle.counts().evaluations == calls);
        CHECK(circle.counts().steps == static_cast<long long>(times.size()));
        CHECK(std::is_sorted(times.begin(), times.end()));
        CHECK(times.size() > 10);
    }

    TEST_CASE("every explicit method has its order") {
        const auto order = [](const ErkOptions& options, double step) {
            return std::log2(error_of(options, step) / error_of(options, 0.5 * step));
        };
        CHECK(order({.table = paper_rk21()}, 0.02) == doctest::Approx(2.0).epsilon(0.05).scale(0.0));
        CHECK(order({.method = ErkMethod::bogacki_shampine}, 0.05) == doctest::Approx(3.0).epsilon(0.05).scale(0.0));
        CHECK(order({.method = ErkMethod::zonneveld}, 0.05) == doctest::Approx(4.0).epsilon(0.05).scale(0.0));
        CHECK(order({.method = ErkMethod::cash_karp}, 0.1) == doctest::Approx(5.0).epsilon(0.1).scale(0.0));
        CHECK(order({.method = ErkMethod::dormand_prince}, 0.1) == doctest::Approx(5.0).epsilon(0.1).scale(0.0));
        CHECK(error_of({}, 0.1) == error_of({.method = ErkMethod::dormand_prince}, 0.1));
    }

    TEST_CASE("adaptive errors follow the tolerance") {
        const auto check = [](auto&& integrator, double tolerance) {
            std::vector<double> x{1.0};
            integrator.integrate(x, 0.0, 2.0);
            CHECK(std::abs(x[0] - std::exp(std::sin(2.0))) < 500.0 * tolerance);
        };
        for (const double tolerance : {1e-5, 1e-8, 1e-11}) {
            CAPTURE(tolerance);
            for (const auto method :
                 {ErkMethod::bogacki_shampine, ErkMethod::zonneveld, ErkMethod::cash_karp, ErkMethod::dormand_prince})
                for (const auto control : {StepControl::arkode, StepControl::lu_rycroft})
                    check(ErkIntegrator(driven, 1,
                                        {.relative_tolerance = tolerance,
                                         .absolute_tolerance = tolerance,
                                         .method = method,
                                         .step_control = control}),
                          tolerance);
            for (const auto method : {CvodeMethod::adams, CvodeMethod::bdf})
                check(CvodeIntegrator(driven, 1,
                                      {.method = method, .relative_tolerance = tolerance, .absolute_tolerance = tolerance}),
                      tolerance);
        }
    }

    TEST_CASE("a stiff decay costs the implicit method few steps") {
        CvodeIntegrator integrator(
            [](double t, std::span<const double> y, std::span<double> rate) { rate[0] = -1e6 * (y[0] - std::cos(t)); }, 1,
            {.relative_tolerance = 1e-6, .absolute_tolerance = 1e-6});
        std::vector<double> y{3.0};
        integrator.integrate(y, 0.0, 10.0);
        CHECK(std::abs(y[0] - std::cos(10.0)) < 1e-4);
        CHECK(integrator.counts().steps < 1000); // an explicit method needs 10^7/3 at least
    }

    TEST_CASE("the step control of Lu and Rycroft tries the whole interval first") {
        double first = 0.0;
        ErkIntegrator integrator([](double, std::span<const double>, std::span<double> rate) { rate[0] = 1.0; }, 1,
                                 {.table = paper_rk21(), .step_control = StepControl::lu_rycroft});
        std::vector<double> y{0.0};
        integrator.integrate(y, 0.0, 5.0, [&](double t, std::span<const double>) { first = t; });
        CHECK(first == 5.0);
        CHECK(integrator.counts().steps == 1);
        CHECK(integrator.counts().evaluations == 3);
    }

    TEST_CASE_TEMPLATE("what goes wrong is said, and exceptions pass through", Integrator, ErkIntegrator, CvodeIntegrator) {
        using Options = std::conditional_t<std::is_same_v<Integrator, ErkIntegrator>, ErkOptions, CvodeOptions>;
        const auto failed = [](RightHandSide f) { return failure<Integrator>(std::move(f), Options{}); };
        CHECK(failed([](double t, auto, auto rate) {
                  if (t > 0.5)
                      throw std::logic_error("mine");
                  rate[0] = 1.0;
              }) == "passed through: mine");
        CHECK(contains(failed([](double, auto, auto rate) { rate[0] = not_a_number; }), "not finite"));
        CHECK(contains(failed([](double, auto x, auto rate) { rate[0] = x[0] * x[0] * 2.0; }),
                       "SUNDIALS could not step from t = "));
        CHECK(contains(failure<Integrator>([](double t, auto, auto rate) { rate[0] = std::cos(50.0 * t); },
                                           Options{.largest_step_count = 7}),
                       "more than 7 steps"));

        const auto build = [](std::size_t components, const Options& options) {
            return message_of<InputError>([&] { Integrator([](double, auto, auto) {}, components, options); });
        };
        CHECK(contains(build(0, {}), "at least one component"));
        CHECK(contains(build(1, {.relative_tolerance = -1.0}), "tolerances must not be negative"));
        CHECK(contains(build(1, {.relative_tolerance = 0.0, .absolute_tolerance = 0.0}), "tolerances"));
        CHECK(contains(build(1, {.relative_tolerance = not_a_number}), "tolerances"));
        CHECK(contains(build(1, {.largest_step_count = 0}), "number of steps must be positive"));

        Integrator integrator([](double, auto, auto rate) { rate[0] = rate[1] = 1.0; }, 2);
        std::vector<double> two{1.0, 2.0}, three{1.0, 2.0, 3.0};
        CHECK(contains(message_of<InputError>([&] { integrator.integrate(three, 0.0, 1.0); }),
                       "a state of 3 components was given, the system has 2"));
        CHECK(
            contains(message_of<InputError>([&] { integrator.integrate(two, 1.0, 1.0); }), "the interval from 1 to 1 is empty"));
        CHECK(contains(message_of<InputError>([&] { integrator.integrate(two, 0.0, not_a_number); }), "not finite"));
        integrator.integrate(two, 0.0, 1.0); // and still works
        CHECK(two[1] == doctest::Approx(3.0));
    }

    TEST_CASE("the difference quotients of the implicit methods need both tolerances") {
        const auto build = [](const CvodeOptions& options) {
            return message_of<InputError>([&] { CvodeIntegrator([](double, auto, auto) {}, 1, options); });
        };
        CHECK(contains(build({.relative_tolerance = 0.0}), "CVODE integrator: both tolerances must be positive"));
        CHECK(contains(build({.absolute_tolerance = 0.0}), "both tolerances must be positive"));
    }

    TEST_CASE("impossible options of explicit methods are refused") {
        const auto build = [](const ErkOptions& options) {
            return message_of<InputError>([&] { ErkIntegrator([](double, auto, auto) {}, 1, options); });
        };
        CHECK(contains(build({.fixed_step = -1.0}), "the fixed step must be"));
        CHECK(contains(build({.first_step = not_a_number}), "the first step must be"));
        CHECK(contains(build({.largest_step = -1.0}), "the largest step must be"));
        CHECK(contains(build({.table = ErkTable{.order = 2, .embedded_order = 1, .c = {0.0, 1.0}}}), "a square matrix a"));
        CHECK(contains(failure<ErkIntegrator>([](double, auto, auto rate) { rate[0] = 1.0; },
                                              ErkOptions{.fixed_step = 0.01, .largest_step_count = 7}),
                       "more than 7 steps"));
    }
}

} // namespace sundials_suite
