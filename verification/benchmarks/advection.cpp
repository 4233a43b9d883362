// SPDX-License-Identifier: GPL-3.0-or-later
// What the differences of the advection are worth, each by itself: order on smooth data, what becomes of a hat and of noise that
// are carried around the domain once, how far their rate jumps, and what they cost. Prints a table; it takes a few seconds.
#include <ductile/space/field.hpp>
#include <ductile/space/transport.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <random>
#include <vector>

using namespace ductile;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double smallest_bend = 1e-6; // as for fields whose unit is 1

/// A line of cells on [-1, 1], periodic; the rows of a field, four of them, are all this line.
class Line {
public:
    explicit Line(int cells) : cells_(cells), f_(4, cells, 2), wind_(4, cells), still_(4, cells) {
        for (int j = 0; j < 4; ++j) {
            std::fill_n(wind_.row(j), cells, 1.0);
            std::fill_n(still_.row(j), cells, 0.0);
        }
    }
    [[nodiscard]] double x(int i) const { return -1.0 + 2.0 * (i + 0.5) / cells_; }

    /// df/dt for wind 1 along x.
    template <Advection advection> [[nodiscard]] std::vector<double> rate(const std::vector<double>& f) {
        for (int j = 0; j < 4; ++j)
            std::copy(f.begin(), f.end(), f_.row(j));
        f_.wrap();
        extrapolate_to_ghost_rows(f_);
        std::vector<double> result(static_cast<std::size_t>(cells_ + pack_size));
        for (int i = 0; i < cells_; i += pack_size)
            store(advection_rate<advection>(f_.row(1) + i, f_.stride(), load(wind_.row(1) + i), load(still_.row(1) + i),
                                            0.25 * cells_, 1.0, smallest_bend),
                  result.data() + i);
        result.resize(static_cast<std::size_t>(cells_));
        return result;
    }

    /// Carries f around once by Shu and Osher's method of third order at Courant number 1/4; `watch` sees every step.
    template <Advection advection, class Watch> [[nodiscard]] std::vector<double> around(std::vector<double> f, Watch watch) {
        const int steps = 4 * cells_;
        const double dt = 2.0 / steps;
        const auto euler = [&](const std::vector<double>& y) {
            std::vector<double> next = rate<advection>(y);
            for (std::size_t i = 0; i < next.size(); ++i)
                next[i] = y[i] + dt * next[i];
            return next;
        };
        for (int n = 0; n < steps; ++n) {
            std::vector<double> stage = euler(euler(f));
            for (std::size_t i = 0; i < f.size(); ++i)
                stage[i] = 0.75 * f[i] + 0.25 * stage[i];
            stage = euler(stage);
            for (std::size_t i = 0; i < f.size(); ++i)
                f[i] = (f[i] + 2.0 * stage[i]) / 3.0;
            watch(f);
        }
        return f;
    }

private:
    int cells_;
    Field f_, wind_, still_;
};

template <class F> std::vector<double> sampled(const Line& line, int cells, const F& function) {
    std::vector<double> f(static_cast<std::size_t>(cells));
    for (int i = 0; i < cells; ++i)
        f[static_cast<std::size_t>(i)] = function(line.x(i));
    return f;
}

double mean_distance(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i)
        sum += std::abs(a[i] - b[i]) / static_cast<double>(a.size());
    return sum;
}

template <Advection advection> void report(const char* name) {
    fmt::print("{:6}", name);
    // order: exp(sin(pi x)) after one turn
    double previous = 0.0;
    for (const int cells : {40, 80, 160, 320}) {
        Line line(cells);
        const auto start = sampled(line, cells, [](double x) { return std::exp(std::sin(pi * x)); });
        const double error = mean_distance(line.around<advection>(start, [](const auto&) {}), start);
        fmt::print(" | {:.1e}{}", error, previous > 0.0 ? fmt::format(" ({:.2f})", std::log2(previous / error)) : "");
        previous = error;
    }
    // bounds: a hat and a step
    for (const bool step : {false, true}) {
        Line line(80);
        const auto start = sampled(
            line, 80, [&](double x) { return step ? (std::abs(x) < 0.4 ? 1.0 : 0.0) : std::max(0.0, 1.0 - 2.5 * std::abs(x)); });
        double beyond = 0.0, variation = 0.0;
        const auto end = line.around<advection>(start, [&](const std::vector<double>& f) {
            const auto [low, high] = std::ranges::minmax(f);
            beyond = std::max({beyond, -low, high - 1.0});
            double sum = 0.0;
            for (std::size_t i = 0; i < f.size(); ++i)
                sum += std::abs(f[(i + 1) % f.size()] - f[i]);
            variation = std::max(variation, sum - 2.0);
        });
        fmt::print(" | {:.1e}, {:.1e}, {:.1e}", mean_distance(end, start), beyond, std::max(variation, 0.0));
    }
    // noise of cell to cell: what is left of its root mean square after one turn
    Line line(80);
    std::mt19937 engine(1);
    std::normal_distribution<double> normal(0.0, 0.02);
    const auto noise = sampled(line, 80, [&](double) { return normal(engine); });
    const auto root_mean_square = [](const std::vector<double>& f) {
        double sum = 0.0;
        for (const double value : f)
            sum += value * value;
        return std::sqrt(sum / static_cast<double>(f.size()));
    };
    fmt::print(" | {:.2f}", root_mean_square(line.around<advection>(noise, [](const auto&) {})) / root_mean_square(noise));
    // jumps: the largest change of h df/dt when one value of rough data moves on by 1e-4, over 1e-4
    double jump = 0.0;
    for (int repeat = 0; repeat < 20; ++repeat) {
        auto f = sampled(line, 80, [&](double) { return 50.0 * normal(engine); });
        std::vector<double> before;
        for (int k = 0; k < 2000; ++k) {
            f[40] = 1e-4 * (k - 1000);
            const auto after = line.rate<advection>(f);
            for (std::size_t i = 0; i < before.size(); ++i)
                jump = std::max(jump, std::abs(after[i] - before[i]) * (2.0 / 80) / 1e-4);
            before = after;
        }
    }
    fmt::print(" | {:.1e}", jump);
    // cost
    Line row(504);
    const auto f = sampled(row, 504, [](double x) { return std::sin(5.0 * pi * x); });
    Field field(512, 504, 2), u(512, 504), rate(512, 504);
    for (int j = 0; j < 512; ++j) {
        std::copy(f.begin(), f.end(), field.row(j));
        std::fill_n(u.row(j), 504, 0.3);
    }
    field.wrap();
    extrapolate_to_ghost_rows(field);
    double best = 1e300;
    for (int repeat = 0; repeat < 40; ++repeat) {
        const auto begin = std::chrono::steady_clock::now();
        for (int j = 0; j < 512; ++j)
            for (int i = 0; i < 504; i += pack_size)
                store(advection_rate<advection>(field.row(j) + i, field.stride(), load(u.row(j) + i), load(u.row(j) + i), 1.0,
                                                1.0, smallest_bend),
                      rate.row(j) + i);
        best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    }
    fmt::print(" | {:.2f} |\n", 1e9 * best / (512.0 * 504.0));
}

} // namespace

int main() {
    fmt::print(
        "Carried around a periodic line once: mean error of exp(sin(pi x)) on 40, 80, 160, 320 cells (order); of a hat and of\n"
        "a step on 80 cells the mean error, what is beyond their bounds, and what is added to their variation; what is left\n"
        "of noise from cell to cell. Jump: the largest change of h df/dt over that of a value of rough data, 1e-4. Cost: ns\n"
        "a cell and field.\n\n"
        "| differences | 40 | 80 | 160 | 320 | hat | step | noise | jump | ns |\n|---|---|---|---|---|---|---|---|---|---|\n");
    fmt::print("| ");
    report<Advection::eno2>("eno2");
    fmt::print("| ");
    report<Advection::weno3>("weno3");
}
