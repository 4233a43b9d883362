// SPDX-License-Identifier: GPL-3.0-or-later
// How fine elements must be for an error: against errors that fall as is known.
#include <ductile/base/error.hpp>
#include <ductile/quasistatic/resolution.hpp>

#include <cmath>
#include <doctest/doctest.h>
#include <functional>
#include <string>

namespace resolution_suite {

using namespace ductile;
using namespace ductile::quasistatic;
using doctest::Approx;

namespace {

using ErrorLaw = std::function<double(double)>; // of the rows a unit of height

Field one_value(double value) {
    Field field(1, 1);
    field(0, 0) = value;
    return field;
}

/// A run whose tau is off by error(rows) + 0.02 tolerance, chi by a tenth of that.
EndState made_up(const Options& options, const ErrorLaw& error) {
    EndState end;
    const double off = error(options.cells.y) + 0.02 * tolerance(options);
    for (const double value : {0.0, 0.0, 1.0 + off / std::sqrt(2.0), 0.0})
        end.stress.push_back(one_value(value));
    end.internal.push_back(one_value(0.7 + 0.1 * off));
    end.velocity = {one_value(1.0), one_value(0.0)};
    end.traction = {0.5 + 0.01 * off, 0.1};
    end.speed = 1.0;
    return end;
}

} // namespace

TEST_SUITE_BEGIN("resolution");

TEST_CASE("errors that fall with a power are known, those that fall exponentially not taken for smaller ones") {
    const std::array fineness{1.0, 1.5, 2.3};
    const auto estimate = [&](const ErrorLaw& error) {
        const double e0 = error(fineness[0]), e1 = error(fineness[1]), e2 = error(fineness[2]);
        return Refinement{fineness, {e0 - e1, e1 - e2}}.error_of_last() * (e1 - e2) / e2;
    };
    for (const double power : {0.5, 1.0, 2.0, 3.0, 6.0})
        CHECK(estimate([&](double f) { return std::pow(f, -power); }) == Approx(1.0).epsilon(1e-6));
    for (const double rate : {1.0, 3.0, 6.0}) {
        CAPTURE(rate);
        CHECK(estimate([&](double f) { return std::exp(-rate * f); }) > 1.0);
    }
    CHECK(std::isinf(Refinement{fineness, {0.1, 0.2}}.error_of_last()));
    const Refinement second{{1.0, 2.0, 4.0}, {0.75, 0.1875}};
    CHECK(second.power() == Approx(2.0));
    CHECK(second.refinement_for(16.0) == Approx(4.0));
}

TEST_CASE("elements are as fine as the error that is asked for needs, and not much finer") {
    for (const double asked : {1e-2, 1e-3, 1e-4, 1e-5})
        for (const bool smooth : {true, false}) {
            CAPTURE(asked);
            CAPTURE(smooth);
            const ErrorLaw error = smooth ? ErrorLaw([](double rows) { return std::exp(-rows / 12.0); })
                                          : ErrorLaw([](double rows) { return 50.0 * std::pow(rows, -3.0); });
            Options options;
            options.accuracy = asked;
            int runs = 0;
            const Resolution resolution(
                options,
                [&](const Options& tried) {
                    ++runs;
                    return made_up(tried, error);
                },
                [](const std::string&) {});
            CHECK(options.space.kind == SpaceKind::elements);
            CHECK(options.cells.y % options.space.elements.degree == 0);
            CHECK(options.cells.y > 1.7 * options.cells.x);
            const double delivered = error(options.cells.y) + 0.02 * tolerance(options);
            CHECK(delivered < 1.2 * asked);
            const double needed = smooth ? 12.0 * std::log(2.0 / asked) : std::cbrt(100.0 / asked);
            CHECK(options.cells.y < std::max(1.6 * needed + 8.0, 170.0));
            const EndErrors estimated = resolution.errors(made_up(options, error));
            CHECK(estimated.stress > 0.9 * delivered);
            CHECK(estimated.stress < (smooth ? 30.0 : 1.15) * delivered);
            CHECK(estimated.internal == Approx(0.1 * estimated.stress));
            CHECK(estimated.traction == Approx(0.01 * estimated.stress));
            CHECK(estimated.velocity == 0.0);
            CHECK(runs < 10);
        }
}

TEST_CASE("steps get a tolerance that their errors allow") {
    Options options;
    options.accuracy = 1e-3;
    // errors of steps twenty times the tolerance, not a fiftieth of it
    const auto integrate = [](const Options& tried) {
        Options looser = tried;
        looser.tolerance = fmt::format("{}", 1000.0 * tolerance(tried));
        return made_up(looser, [](double rows) { return std::exp(-rows / 12.0); });
    };
    const Resolution resolution(options, integrate, [](const std::string&) {});
    CHECK(tolerance(options) == Approx(1e-4 / 8.0).epsilon(1e-2));
    CHECK(resolution.errors(integrate(options)).stress > 20.0 * 7.0 / 8.0 * tolerance(options));
}

TEST_CASE("errors of steps are those on the points that show what few points do not") {
    Options options;
    options.accuracy = 1e-3;
    int fewest = 0;
    // a thousand times as large as on the fewest points
    const auto integrate = [&](const Options& tried) {
        if (fewest == 0)
            fewest = tried.cells.y;
        Options looser = tried;
        looser.tolerance = fmt::format("{}", (tried.cells.y > fewest ? 1000.0 : 1.0) * tolerance(tried));
        return made_up(looser, [](double rows) { return std::exp(-rows / 12.0); });
    };
    const Resolution resolution(options, integrate, [](const std::string&) {});
    CHECK(options.cells.y > fewest);
    CHECK(tolerance(options) == Approx(1e-4 / 8.0).epsilon(1e-2));
    CHECK(resolution.errors(integrate(options)).stress > 20.0 * 7.0 / 8.0 * tolerance(options));
}

TEST_CASE("what no grid resolves is refused") {
    Options options;
    options.accuracy = 1e-3;
    CHECK_THROWS_WITH_AS(
        Resolution(
            options, [](const Options& tried) { return made_up(tried, [](double rows) { return 1.0 - 0.1 * std::log(rows); }); },
            [](const std::string&) {}),
        doctest::Contains("the fields are too rough for it"), RunError);
}

TEST_CASE("errors above what was asked for are warned of, with what to ask for") {
    CHECK(missed_accuracy({.stress = 1e-3, .internal = 1e-4}, 1e-3).empty());
    CHECK(missed_accuracy({.stress = 1e-5, .velocity = 2.5e-3}, 1e-3) ==
          "the error at the end is an estimated 2.5e-03, and --accuracy asked for 0.001: ask for 0.0002");
    CHECK(missed_accuracy({.traction = HUGE_VAL}, 1e-3) ==
          "the error at the end is an estimated inf, and --accuracy asked for 0.001: ask for 0.0001");
}

TEST_CASE("differences are root mean squares in the units of their errors") {
    EndState a, b;
    for (const double value : {0.1, 0.2, -0.3, 0.4}) {
        a.stress.push_back(one_value(1.0));
        b.stress.push_back(one_value(1.0 + value));
    }
    a.internal = {one_value(0.5), one_value(1.0)};
    b.internal = {one_value(0.4), one_value(1.2)};
    a.velocity = {one_value(3.0), one_value(0.0)};
    b.velocity = {one_value(3.0), one_value(1.0)};
    a.speed = 3.0;
    b.speed = 4.0;
    a.traction = {0.5, 0.1};
    b.traction = {0.4, 0.4};
    const EndErrors d = difference(a, b);
    CHECK(d.stress == Approx(std::sqrt(3.0 * 0.01 + 2.0 * (0.04 + 0.09) + 6.0 * 0.16)));
    CHECK(d.internal == Approx(0.2));
    CHECK(d.velocity == Approx(0.25));
    CHECK(d.traction == Approx(0.3));
    CHECK(d.largest() == d.stress);
}

TEST_SUITE_END();

} // namespace resolution_suite
