// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/quasistatic/initial.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <random>
#include <vector>

namespace ductile::quasistatic {

namespace {

using std::numbers::pi;

double square(double x) { return x * x; }

/// The periodic image of x closest to zero.
double nearest_image(double x, double period) { return x - period * std::round(x / period); }

template <class F> void fill(const Grid& grid, const RowSpacing& rows, Field& field, F&& value) {
    for (int j = 0; j < grid.cells_y; ++j) {
        const double y = grid.y(rows.cell[static_cast<std::size_t>(j)]);
        for (int i = 0; i < grid.cells_x; ++i)
            field(i, j) = value(grid.x(i + 0.5), y);
        field.wrap_row(j);
    }
}

void fill(const Grid& grid, const RowSpacing& rows, Field& field, const PaperPattern& pattern) {
    constexpr double centres[5][2] = {{0.6, 0.65}, {0.3, 0.3}, {-0.2, -0.4}, {-0.4, 0.0}, {-0.7, -0.6}}; // x_i, s_i of Table C.6
    fill(grid, rows, field, [&](double x, double y) {
        const double xi = 2.0 * x / grid.width, eta = 2.0 * y / grid.height;
        double sum = std::exp(-20.0 * square(0.5 * std::sin(pi * xi) - eta));
        for (const auto& [centre, s] : centres)
            sum += std::exp(-20.0 * (square(nearest_image(xi - centre, 2.0)) + square(eta + s)));
        return pattern.base + pattern.amplitude * sum;
    });
}

void fill(const Grid& grid, const RowSpacing& rows, Field& field, const Uniform& uniform) {
    fill(grid, rows, field, [&](double, double) { return uniform.value; });
}

void fill(const Grid& grid, const RowSpacing& rows, Field& field, const GaussianInclusion& inclusion) {
    if (!(inclusion.radius > 0.0))
        throw InputError(fmt::format("initial field 'gaussian': radius {}: it must be positive", inclusion.radius));
    fill(grid, rows, field, [&](double x, double y) {
        const double r2 = square(nearest_image(x - inclusion.x, grid.width)) + square(y - inclusion.y);
        return inclusion.background + inclusion.amplitude * std::exp(-0.5 * r2 / square(inclusion.radius));
    });
}

/// Standard normal numbers by Box and Muller, the same on every platform (std::normal_distribution is not).
class NormalNumbers {
public:
    explicit NormalNumbers(std::uint64_t seed) : engine_(seed) {}
    double operator()() {
        const auto uniform = [&] { return (static_cast<double>(engine_() >> 11) + 0.5) * 0x1p-53; };
        const double radius = std::sqrt(-2.0 * std::log(uniform()));
        return radius * std::cos(2.0 * pi * uniform());
    }

private:
    std::mt19937_64 engine_;
};

void fill(const Grid& grid, const RowSpacing& rows, Field& field, const SoftDisc& disc) {
    if (!(disc.radius > 0.0) || !(disc.transition > 0.0))
        throw InputError(
            fmt::format("initial field 'disc': radius {}, transition {}: they must be positive", disc.radius, disc.transition));
    fill(grid, rows, field, [&](double x, double y) {
        const double r = std::hypot(nearest_image(x - disc.x, grid.width), y - disc.y);
        return disc.background + 0.5 * disc.amplitude * (1.0 - std::tanh((r - disc.radius) / disc.transition));
    });
}

void fill(const Grid& grid, const RowSpacing& rows, Field& field, const RandomBlocks& blocks) {
    const auto count = [&](double extent) { return static_cast<int>(std::lround(extent / blocks.length)); };
    if (!(blocks.length > 0.0) || !(grid.area() / (blocks.length * blocks.length) < 1e6) || count(grid.width) < 1 ||
        count(grid.height) < 1)
        throw InputError(
            fmt::format("initial field 'blocks': a length of {:.3g} of the length unit: from one to a million blocks must "
                        "fit into the domain",
                        blocks.length));
    const int across = count(grid.width), up = count(grid.height);
    NormalNumbers normal(blocks.seed);
    std::vector<double> values;
    for (int k = 0; k < across * up; ++k)
        values.push_back(blocks.mean + blocks.deviation * normal());
    fill(grid, rows, field, [&](double x, double y) {
        const auto number = [](double position, double extent, int blocks_along) {
            return std::clamp(static_cast<int>((position / extent + 0.5) * blocks_along), 0, blocks_along - 1);
        };
        return values[static_cast<std::size_t>(number(y, grid.height, up) * across + number(x, grid.width, across))];
    });
}

/// f = mean + deviation sum_{k,l} a_k b_l (A_kl cos(K_k x) + B_kl sin(K_k x)) cos(L_l (y - y_wall)), with
/// a_k^2 ~ exp(-K_k^2 length^2/2): the spectrum of the Gaussian correlation; a and b normalised to unit variance (away from
/// walls).
void fill(const Grid& grid, const RowSpacing& rows, Field& field, const RandomField& random) {
    const double length = random.correlation_length;
    if (!(random.deviation >= 0.0))
        throw InputError(fmt::format("initial field 'random': deviation {}: it must not be negative", random.deviation));
    if (!(length >= std::max(grid.width, grid.height) / 500.0))
        throw InputError(
            fmt::format("initial field 'random': correlation length {:.3g} of the length unit: it must be at least 1/500 of the "
                        "domain",
                        length));
    const auto spectrum = [&](double fundamental) {
        std::vector<double> a;
        double sum = 0.0;
        for (int k = 0;; ++k) {
            const double power = (k == 0 ? 0.5 : 1.0) * std::exp(-0.5 * square(fundamental * k * length));
            if (power < 1e-14 && k > 0)
                break;
            a.push_back(power);
            sum += power;
        }
        for (double& power : a)
            power = std::sqrt(power / sum);
        return a;
    };
    const double fundamental_x = 2.0 * pi / grid.width, fundamental_y = pi / grid.height;
    const std::vector<double> a = spectrum(fundamental_x), b = spectrum(fundamental_y);
    NormalNumbers normal(random.seed);
    // cosine and sine amplitudes, [l][k]
    std::vector<double> cosine(a.size() * b.size()), sine(a.size() * b.size());
    for (std::size_t l = 0; l < b.size(); ++l)
        for (std::size_t k = 0; k < a.size(); ++k) {
            // a cosine in y has mean square 1/2, the constant 1: the factor sqrt(2) restores unit variance
            const double amplitude = a[k] * b[l] * (l == 0 ? 1.0 : std::numbers::sqrt2);
            cosine[l * a.size() + k] = amplitude * normal();
            sine[l * a.size() + k] = amplitude * normal();
        }
    std::vector<double> row_cosine(a.size()), row_sine(a.size());
    for (int j = 0; j < grid.cells_y; ++j) {
        std::fill(row_cosine.begin(), row_cosine.end(), 0.0);
        std::fill(row_sine.begin(), row_sine.end(), 0.0);
        for (std::size_t l = 0; l < b.size(); ++l) {
            const double y = grid.y(rows.cell[static_cast<std::size_t>(j)]);
            const double factor = std::cos(static_cast<double>(l) * fundamental_y * (y + 0.5 * grid.height));
            for (std::size_t k = 0; k < a.size(); ++k) {
                row_cosine[k] += factor * cosine[l * a.size() + k];
                row_sine[k] += factor * sine[l * a.size() + k];
            }
        }
        for (int i = 0; i < grid.cells_x; ++i) {
            double sum = 0.0;
            for (std::size_t k = 0; k < a.size(); ++k) {
                const double phase = static_cast<double>(k) * fundamental_x * grid.x(i + 0.5);
                sum += row_cosine[k] * std::cos(phase) + row_sine[k] * std::sin(phase);
            }
            field(i, j) = random.mean + random.deviation * sum;
        }
        field.wrap_row(j);
    }
}

} // namespace

Field initial_internal(const Grid& grid, const RowSpacing& rows, const InitialInternal& initial,
                       const InternalVariable& variable) {
    Field field(grid.cells_y, grid.cells_x);
    std::visit([&](const auto& pattern) { fill(grid, rows, field, pattern); }, initial);
    for (int j = 0; j < grid.cells_y; ++j)
        for (int i = 0; i < grid.cells_x; ++i)
            if (!variable.can_start_at(field(i, j)))
                throw InputError(fmt::format("the initial {} is {:.6g} at cell ({}, {}): it must be {}", spoken_name(variable),
                                             field(i, j) * variable.natural_unit, i, j, describe_range(variable)));
    return field;
}

Field initial_internal(const Grid& grid, const InitialInternal& initial, const InternalVariable& variable) {
    return initial_internal(grid, uniform_rows(grid), initial, variable);
}

Field random_field(const Grid& grid, const RowSpacing& rows, const RandomField& random) {
    Field field(grid.cells_y, grid.cells_x);
    fill(grid, rows, field, random);
    return field;
}

} // namespace ductile::quasistatic
