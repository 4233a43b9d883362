// SPDX-License-Identifier: GPL-3.0-or-later
#include "fields.hpp"
#include <ductile/space/gauss.hpp>
#include <ductile/space/periodic_line.hpp>
#include <ductile/space/stencil.hpp>

#include <numeric>
#include <random>

namespace elements_suite {

using namespace ductile;
using namespace ductile::quasistatic;
using std::numbers::pi;

namespace {

const Grid rectangle{.cells_x = 12, .cells_y = 24, .width = 3.0, .height = 2.0};
const std::vector<double> unequal{-0.7, -0.65, 0.4}; ///< edges of four elements between the walls of `rectangle`

struct Choice {
    Grid grid = rectangle;
    int degree = 6;
    std::vector<double> edges = {};
};

std::vector<Choice> choices() {
    Grid odd = rectangle, one = rectangle;
    odd.cells_x = 21;
    one.cells_y = 16;
    return {
        {.degree = 1}, {.degree = 2}, {.degree = 6, .edges = unequal}, {.grid = odd, .degree = 8}, {.grid = one, .degree = 16}};
}

std::unique_ptr<Space> elements_on(const Choice& choice, bool transported = false) {
    return make_element_space(choice.grid, {fields::glass_law, transported}, {.degree = choice.degree, .edges = choice.edges});
}

std::unique_ptr<Space> adaptable(const Grid& grid, int degree) {
    return make_element_space(grid, {fields::glass_law, false}, {.degree = degree, .adapt = true});
}

std::unique_ptr<Space> staggered_on(const Grid& grid) { return make_staggered_space(grid, {fields::glass_law, false}, {}); }

VectorField random_velocity(const Space& space, std::mt19937& engine) {
    VectorField velocity = space.make_velocity();
    fields::fill_randomly(velocity.u, engine, -1.0, 1.0);
    fields::fill_randomly(velocity.v, engine, -1.0, 1.0);
    return velocity;
}

CellState random_cells(const Space& space, std::mt19937& engine) {
    CellState cells = space.make_cells();
    for (Field* field : fields::fields_of(cells))
        fields::fill_randomly(*field, engine, -1.0, 1.0);
    return cells;
}

/// C : D(v)
CellState stress_of(const Space& space, const VectorField& velocity) {
    CellState rate = space.make_cells();
    space.close(velocity, rate);
    rate.wrap();
    return rate;
}

double largest_difference(const Field& a, const Field& b) {
    double largest = 0.0;
    for (int j = 0; j < a.rows(); ++j)
        for (int i = 0; i < a.columns(); ++i)
            largest = std::max(largest, std::abs(a(i, j) - b(i, j)));
    return largest;
}

/// Sum of all inner nodes.
double product(const VectorField& a, const VectorField& b) {
    double sum = 0.0;
    for (const auto component : {&VectorField::u, &VectorField::v})
        for (int j = 1; j + 1 < (a.*component).rows(); ++j)
            for (int i = 0; i < (a.*component).columns(); ++i)
                sum += (a.*component)(i, j) * (b.*component)(i, j);
    return sum;
}

/// value(x, y) at the cells, or the nodes, of a space.
void fill_cells(const Space& space, Field& field, const auto& value) {
    for (int j = 0; j < field.rows(); ++j)
        for (int i = 0; i < field.columns(); ++i)
            field(i, j) = value(space.grid().x(i + 0.5), space.grid().y(space.rows().cell[static_cast<std::size_t>(j)]));
    field.wrap();
}
void fill_nodes(const Space& space, Field& field, const auto& value) {
    for (int j = 0; j < field.rows(); ++j)
        for (int i = 0; i < field.columns(); ++i)
            field(i, j) = value(space.grid().x(i), space.grid().y(space.rows().node[static_cast<std::size_t>(j)]));
    field.wrap();
}

} // namespace

TEST_SUITE("elements") {
    TEST_CASE("Gauss points and matrices of polynomials are those of the tables") {
        const Quadrature three = gauss_legendre(3);
        CHECK(three.points[2] == doctest::Approx(std::sqrt(0.6)).epsilon(1e-15));
        CHECK(three.points[1] == 0.0);
        CHECK(three.weights[0] == doctest::Approx(5.0 / 9.0).epsilon(1e-14));
        CHECK(three.weights[1] == doctest::Approx(8.0 / 9.0).epsilon(1e-14));
        CHECK(gauss_lobatto_points(4)[2] == doctest::Approx(std::sqrt(0.2)).epsilon(1e-15));
        CHECK(gauss_lobatto_points(5)[1] == doctest::Approx(-std::sqrt(3.0 / 7.0)).epsilon(1e-15));
        for (const int n : {1, 2, 5, 16}) {
            const Quadrature rule = gauss_legendre(n);
            for (int power = 0; power < 2 * n; ++power) {
                double sum = 0.0;
                for (std::size_t g = 0; g < rule.points.size(); ++g)
                    sum += rule.weights[g] * std::pow(rule.points[g], power);
                CHECK(sum == doctest::Approx(power % 2 == 0 ? 2.0 / (power + 1.0) : 0.0).epsilon(1e-13));
            }
            const std::vector<double> nodes = gauss_lobatto_points(n + 1);
            const std::vector<double> value = interpolation_matrix(nodes, rule.points), slope = slope_matrix(nodes, rule.points);
            for (std::size_t g = 0; g < rule.points.size(); ++g) {
                CHECK(nodes[g] < rule.points[g]); // one between each two nodes
                CHECK(rule.points[g] < nodes[g + 1]);
                double at = 0.0, rise = 0.0;
                for (std::size_t l = 0; l < nodes.size(); ++l) {
                    at += value[g * nodes.size() + l] * std::pow(nodes[l], n);
                    rise += slope[g * nodes.size() + l] * std::pow(nodes[l], n);
                }
                CHECK(at == doctest::Approx(std::pow(rule.points[g], n)).epsilon(1e-12));
                CHECK(rise == doctest::Approx(n * std::pow(rule.points[g], n - 1)).epsilon(1e-11));
            }
            // the coefficients keep the integral of the square
            const std::vector<double> coefficients = legendre_matrix(rule);
            double square = 0.0;
            for (std::size_t l = 0; l < rule.points.size(); ++l) {
                double c = 0.0;
                for (std::size_t g = 0; g < rule.points.size(); ++g)
                    c += coefficients[l * rule.points.size() + g] * std::exp(rule.points[g]);
                square += c * c;
            }
            double integral = 0.0;
            for (std::size_t g = 0; g < rule.points.size(); ++g)
                integral += rule.weights[g] * std::exp(2.0 * rule.points[g]);
            CHECK(square == doctest::Approx(integral).epsilon(1e-12));
        }
    }

    TEST_CASE("middles of equal parts are where the cells of a snapshot have their values") {
        CHECK(middles(3, 6) == std::vector{1.0, 3.0, 5.0});
        CHECK(middles(4, 2) == std::vector{0.25, 0.75, 1.25, 1.75});
    }

    TEST_CASE("a periodic line differentiates and shifts the waves that it has") {
        for (const int points : {4, 9, 20}) {
            const PeriodicLine line(points, 3.0, LineRule::spectral);
            for (int l = 0; 2 * l < points; ++l) {
                const double k = 2.0 * pi * l / 3.0, dx = line.spacing();
                for (int m = 0; m < points; ++m) {
                    double slope = 0.0, value = 0.0, between = 0.0;
                    for (int i = 0; i < points; ++i) {
                        const auto at = static_cast<std::size_t>(i * line.padded() + m);
                        slope += std::sin(k * i * dx + 0.3) * line.slope_at_cells()[at];
                        value += std::sin(k * i * dx + 0.3) * line.value_at_cells()[at];
                        between += std::sin(k * i * dx + 0.3) * line.slope_between_cells()[at];
                    }
                    CHECK(value == doctest::Approx(std::sin(k * (m + 0.5) * dx + 0.3)).epsilon(1e-12));
                    CHECK(slope == doctest::Approx(k * std::cos(k * (m + 0.5) * dx + 0.3)).epsilon(1e-11));
                    CHECK(between == doctest::Approx(k * std::cos(k * m * dx + 0.3)).epsilon(1e-11));
                }
            }
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "degree 1 on equal edges is the staggered grid to round-off") {
        std::mt19937 engine(1);
        for (const int columns : {12, 21}) {
            Grid grid = rectangle;
            grid.cells_x = columns;
            const auto staggered = staggered_on(grid), elements = elements_on({.grid = grid, .degree = 1});
            const VectorField velocity = random_velocity(*staggered, engine);
            CellState a = stress_of(*staggered, velocity), b = stress_of(*elements, velocity);
            for (int k = 0; k < a.count(); ++k)
                CHECK(largest_difference(a.field(k), b.field(k)) < 1e-12 * 1000.0);
            a = random_cells(*staggered, engine);
            VectorField f = staggered->make_velocity(), g = f;
            staggered->divergence(a.stress, -2.5, f);
            elements->divergence(a.stress, -2.5, g);
            CHECK(largest_difference(f.u, g.u) < 1e-13);
            CHECK(largest_difference(f.v, g.v) < 1e-13);
            CHECK(elements->wall_power(a.stress, {0.7, -0.2}) ==
                  doctest::Approx(staggered->wall_power(a.stress, {0.7, -0.2})).epsilon(1e-12));
            for (const WallData walls : {WallData::zero, WallData::given}) {
                VectorField x = random_velocity(*staggered, engine), y = x;
                staggered->solve(x, walls);
                elements->solve(y, walls);
                CHECK(largest_difference(x.u, y.u) < 1e-12);
                CHECK(largest_difference(x.v, y.v) < 1e-12);
            }
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "B^T is the transposed of B, with the weights of the points") {
        std::mt19937 engine(2);
        const IsotropicElasticity& c = fields::metallic_glass;
        for (const Choice& choice : choices()) {
            const auto space = elements_on(choice);
            VectorField velocity = random_velocity(*space, engine), force = space->make_velocity();
            space->set_walls({}, velocity);
            const CellState strained = stress_of(*space, velocity), cells = random_cells(*space, engine);
            // sum sigma : C^-1 : (C : D(v)) dA
            double power = 0.0;
            for (int j = 0; j < choice.grid.cells_y; ++j)
                for (int i = 0; i < choice.grid.cells_x; ++i) {
                    const StressField &a = cells.stress, &b = strained.stress;
                    power +=
                        choice.grid.cell_area() * space->rows().weight[static_cast<std::size_t>(j)] *
                        (a.p(i, j) * b.p(i, j) / c.bulk_modulus +
                         (a.s(i, j) * b.s(i, j) + a.tau(i, j) * b.tau(i, j) + 3.0 * a.q(i, j) * b.q(i, j)) / c.shear_modulus);
                }
            space->divergence(cells.stress, 1.0, force);
            CHECK(product(velocity, force) == doctest::Approx(power).epsilon(1e-11));
            CHECK(std::accumulate(space->rows().weight.begin(), space->rows().weight.end(), 0.0) ==
                  doctest::Approx(choice.grid.cells_y).epsilon(1e-13));
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "the elliptic solver inverts B^T C B, with data on the walls or none") {
        std::mt19937 engine(3);
        for (const Choice& choice : choices()) {
            const auto space = elements_on(choice);
            for (const WallData walls : {WallData::zero, WallData::given}) {
                VectorField velocity = random_velocity(*space, engine), force = space->make_velocity();
                if (walls == WallData::zero)
                    space->set_walls({}, velocity);
                space->divergence(stress_of(*space, velocity).stress, 1.0, force);
                for (const int wall : {0, choice.grid.cells_y})
                    for (int i = 0; i < choice.grid.cells_x; ++i) {
                        force.u(i, wall) = velocity.u(i, wall);
                        force.v(i, wall) = velocity.v(i, wall);
                    }
                space->solve(force, walls);
                CHECK(largest_difference(force.u, velocity.u) < 1e-10);
                CHECK(largest_difference(force.v, velocity.v) < 1e-10);
                CHECK(force.u(-1, 3) == force.u(choice.grid.cells_x - 1, 3)); // images
            }
            VectorField force = space->make_velocity();
            force.v(2, 3) = std::numeric_limits<double>::quiet_NaN();
            CHECK_THROWS_AS(space->solve(force, WallData::zero), RunError);
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread,
                      "a predicted stress is projected onto equilibrium to round-off, and the walls do its work") {
        std::mt19937 engine(4);
        for (const Choice& choice : choices()) {
            const auto space = elements_on(choice);
            CellState cells = random_cells(*space, engine);
            VectorField force = space->make_velocity();
            space->divergence(cells.stress, -1.0 / 0.3, force);
            space->solve(force, WallData::zero);
            CHECK(space->correct(force, {0.02, -0.01}, 0.3, cells.stress) > 0.0);
            CHECK(space->equilibrium_residual(cells.stress, force) < 1e-12);
            // every velocity with these walls takes the same power out of it: the affine one, and another
            const Velocity upper{0.4, -0.9};
            const MeanTraction mean = space->mean_traction(cells.stress);
            const double power = 2.0 / choice.grid.height * choice.grid.area() * (mean.shear * upper.u + mean.normal * upper.v);
            CHECK(space->wall_power(cells.stress, upper) == doctest::Approx(power).epsilon(1e-10));
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "the strain of a smooth velocity and what it is loaded by are exact in the space") {
        // u = sin(k x) (1 - y^2), v = 0.4 cos(2 k x) y (1 - y^2) between walls at y = -1, 1
        const double k = 2.0 * pi / rectangle.width;
        const auto space = elements_on({.degree = 6, .edges = unequal});
        VectorField velocity = space->make_velocity();
        fill_nodes(*space, velocity.u, [&](double x, double y) { return std::sin(k * x) * (1.0 - y * y); });
        fill_nodes(*space, velocity.v, [&](double x, double y) { return 0.4 * std::cos(2.0 * k * x) * y * (1.0 - y * y); });
        const CellState rate = stress_of(*space, velocity);
        CellState exact = space->make_cells();
        const IsotropicElasticity& c = fields::metallic_glass;
        const auto ux = [&](double x, double y) { return k * std::cos(k * x) * (1.0 - y * y); };
        const auto uy = [&](double x, double y) { return -2.0 * std::sin(k * x) * y; };
        const auto vx = [&](double x, double y) { return -0.8 * k * std::sin(2.0 * k * x) * y * (1.0 - y * y); };
        const auto vy = [&](double x, double y) { return 0.4 * std::cos(2.0 * k * x) * (1.0 - 3.0 * y * y); };
        fill_cells(*space, exact.stress.p, [&](double x, double y) { return -c.bulk_modulus * (ux(x, y) + vy(x, y)); });
        fill_cells(*space, exact.stress.s, [&](double x, double y) { return c.shear_modulus * (ux(x, y) - vy(x, y)); });
        fill_cells(*space, exact.stress.tau, [&](double x, double y) { return c.shear_modulus * (uy(x, y) + vx(x, y)); });
        fill_cells(*space, exact.stress.q, [&](double x, double y) { return -c.shear_modulus / 3.0 * (ux(x, y) + vy(x, y)); });
        for (int f = 0; f < 4; ++f)
            CHECK(largest_difference(rate.field(f), exact.field(f)) < 1e-10);
        Field u(rectangle.cells_y, rectangle.cells_x), v = u, exact_u = u, exact_v = u;
        space->at_points(velocity, u, v);
        fill_cells(*space, exact_u, [&](double x, double y) { return std::sin(k * x) * (1.0 - y * y); });
        fill_cells(*space, exact_v, [&](double x, double y) { return 0.4 * std::cos(2.0 * k * x) * y * (1.0 - y * y); });
        CHECK(largest_difference(u, exact_u) < 1e-12);
        CHECK(largest_difference(v, exact_v) < 1e-12);
    }

    TEST_CASE_FIXTURE(fields::OneThread,
                      "means, norms and energies are integrals, and Courant numbers those of the narrowest rows") {
        const auto space = elements_on({.degree = 6, .edges = unequal});
        CellState cells = space->make_cells();
        fill_cells(*space, cells.stress.tau, [](double, double y) { return y * y; }); // between y = -1 and 1
        const double scale = fields::glass_law->variables()[0].natural_scale();
        fill_cells(*space, cells.internal[0], [&](double, double y) { return scale * 3.0 * y; });
        const CombinationNorm norm = space->norm(std::array{Space::Term{&cells, 1.0}});
        CHECK(norm.stress == doctest::Approx(std::sqrt(2.0 / 5.0)).epsilon(1e-12));
        CHECK(norm.internal == doctest::Approx(3.0 / std::sqrt(3.0)).epsilon(1e-12));
        const Observables seen = space->observe(cells);
        CHECK(seen.wall_traction == doctest::Approx(1.0 / 3.0).epsilon(1e-12));
        CHECK(seen.elastic_energy ==
              doctest::Approx(0.5 / fields::metallic_glass.shear_modulus / 5.0 * rectangle.area()).epsilon(1e-12));
        VectorField velocity = space->make_velocity();
        const VectorField guess = velocity;
        fill_nodes(*space, velocity.v, [](double, double) { return 0.3; });
        double narrowest = 1.0;
        for (std::size_t j = 0; j + 1 < space->rows().node.size(); ++j)
            narrowest = std::min(narrowest, rectangle.dy() * (space->rows().node[j + 1] - space->rows().node[j]));
        CHECK(space->add_affine_and_compare({}, guess, velocity).courant_rate == doctest::Approx(0.3 / narrowest).epsilon(1e-12));
    }

    TEST_CASE_FIXTURE(fields::OneThread, "fields are carried along exactly in the space, and over edges from upwind") {
        // on elements a polynomial that is continuous over the edges has no jumps there
        const auto space = elements_on({.degree = 6, .edges = unequal}, true);
        const double k = 2.0 * pi / rectangle.width;
        VectorField velocity = space->make_velocity();
        fill_nodes(*space, velocity.u, [&](double, double y) { return 0.3 + y; });
        fill_nodes(*space, velocity.v, [&](double x, double y) { return (1.0 - y * y) * (0.5 + 0.2 * std::cos(k * x)); });
        CellState cells = space->make_cells(), rate = space->make_cells(), exact = space->make_cells();
        VectorField room = space->make_velocity();
        fill_cells(*space, cells.internal[0], [&](double x, double y) { return std::sin(k * x) * y * y * y + 0.4 * y; });
        space->transport(cells, velocity, rate, room);
        fill_cells(*space, exact.internal[0], [&](double x, double y) {
            const double u = 0.3 + y, v = (1.0 - y * y) * (0.5 + 0.2 * std::cos(k * x));
            return -u * k * std::cos(k * x) * y * y * y - v * (3.0 * std::sin(k * x) * y * y + 0.4);
        });
        CHECK(largest_difference(rate.internal[0], exact.internal[0]) < 1e-10);

        // a step at the edge y = 0.4: only the element downwind of it sees it, and it takes in what it should
        for (const double direction : {1.0, -1.0}) {
            fill_nodes(*space, velocity.u, [&](double, double) { return 0.0; });
            fill_nodes(*space, velocity.v, [&](double, double) { return direction; });
            fill_cells(*space, cells.internal[0], [&](double, double y) { return y > 0.4 ? 3.0 : 1.0; });
            space->transport(cells, velocity, rate, room);
            double inflow = 0.0;
            for (int j = 0; j < rectangle.cells_y; ++j) {
                const bool downwind = direction > 0.0 ? j >= 18 : j >= 12 && j < 18;
                if (!downwind)
                    CHECK(std::abs(rate.internal[0](5, j)) < 1e-12);
                inflow += rectangle.dy() * space->rows().weight[static_cast<std::size_t>(j)] * rate.internal[0](5, j);
            }
            // d/dt of the integral: |v| times what comes in less what is there
            CHECK(inflow == doctest::Approx(direction > 0.0 ? 1.0 - 3.0 : 3.0 - 1.0).epsilon(1e-12));
        }
    }

    TEST_CASE_FIXTURE(fields::OneThread, "stress turns with the spin of the velocity") {
        const auto space = elements_on({.degree = 6, .edges = unequal}, true);
        CellState cells = space->make_cells(), rate = space->make_cells();
        VectorField velocity = space->make_velocity(), room = velocity;
        fill_nodes(*space, velocity.u, [&](double, double y) { return 0.7 * y; });
        set_all(cells.stress.s, 2.0);
        set_all(cells.stress.tau, -3.0);
        space->transport(cells, velocity, rate, room);
        // ds/dt = (uy - vx) tau, dtau/dt = -(uy - vx) s
        CHECK(rate.stress.s(3, 7) == doctest::Approx(-2.1).epsilon(1e-11));
        CHECK(rate.stress.tau(3, 7) == doctest::Approx(-1.4).epsilon(1e-11));
    }

    TEST_CASE_FIXTURE(fields::OneThread,
                      "values between the points are those of series and polynomials, on the staggered grid linear") {
        const double k = 2.0 * pi / rectangle.width;
        const std::vector<double> x{0.0, 0.2, 5.5, 11.9}, y{0.0, 0.3, 3.7, 12.0, 23.99, 24.0}; // in cells
        const auto space = elements_on({.degree = 6, .edges = unequal});
        const auto value = [&](double at_x, double at_y) {
            return std::sin(k * at_x + 0.2) * std::pow(at_y, 5) + std::cos(3.0 * k * at_x);
        };
        for (const Space::At at : {Space::At::cells, Space::At::nodes}) {
            VectorField velocity = space->make_velocity();
            CellState cells = space->make_cells();
            Field& field = at == Space::At::cells ? cells.stress.tau : velocity.u;
            if (at == Space::At::cells)
                fill_cells(*space, field, value);
            else
                fill_nodes(*space, field, value);
            const Field there = space->interpolation(at, x, y)(field.row(0), field.stride(), field.columns());
            for (std::size_t j = 0; j < y.size(); ++j)
                for (std::size_t i = 0; i < x.size(); ++i)
                    CHECK(there(static_cast<int>(i), static_cast<int>(j)) ==
                          doctest::Approx(value(rectangle.x(x[i]), rectangle.y(y[j]))).epsilon(1e-11));
        }
        const auto staggered = staggered_on(rectangle);
        CellState cells = staggered->make_cells();
        fill_cells(*staggered, cells.stress.tau, [&](double, double at_y) { return 2.0 * at_y - 1.0; });
        cells.stress.tau(2, 7) += 0.8;
        const Field there = staggered->interpolation(Space::At::cells, {3.0, 2.5, 0.1},
                                                     {7.5, 24.0})(cells.stress.tau.row(0), cells.stress.tau.stride(), 12);
        const double linear = 2.0 * rectangle.y(7.5) - 1.0;
        CHECK(there(0, 0) == doctest::Approx(linear + 0.4).epsilon(1e-13)); // between it and its neighbour
        CHECK(there(1, 0) == doctest::Approx(linear + 0.8).epsilon(1e-13));
        CHECK(there(2, 0) == doctest::Approx(linear).epsilon(1e-13));
        CHECK(there(2, 1) == doctest::Approx(1.0).epsilon(1e-13)); // at the wall, beyond the last centre
    }

    TEST_CASE_FIXTURE(fields::OneThread,
                      "what the finest scales hold is nothing of smooth fields, and all of short waves and jumps") {
        const double k = 2.0 * pi / rectangle.width;
        const auto space = elements_on({.degree = 8});
        CellState cells = space->make_cells();
        fill_cells(*space, cells.stress.tau, [&](double x, double y) { return 1.0 + std::cos(2.0 * k * x) * y * y; });
        CHECK(space->unresolved(cells).x < 1e-13);
        CHECK(space->unresolved(cells).y < 1e-12);
        fill_cells(*space, cells.stress.tau,
                   [&](double x, double) { return 0.3 * std::cos(5.0 * k * x); }); // of 12 points: short
        CHECK(space->unresolved(cells).x == doctest::Approx(0.3 / std::sqrt(2.0)).epsilon(1e-12));
        // chi in units of its scale; the Legendre polynomial of degree 7 in the second of three elements, mean square 1/15
        set_all(cells.stress.tau, 0.0);
        const double scale = fields::glass_law->variables()[0].natural_scale();
        fill_cells(*space, cells.internal[0], [&](double, double y) {
            const double t = 3.0 * y;
            return std::abs(t) > 1.0
                       ? 0.0
                       : scale * 0.2 * (429.0 * std::pow(t, 7) - 693.0 * std::pow(t, 5) + 315.0 * t * t * t - 35.0 * t) / 16.0;
        });
        CHECK(space->unresolved(cells).x < 1e-13);
        CHECK(space->unresolved(cells).y == doctest::Approx(0.2).epsilon(1e-11)); // the jump at its edges, P_7(1) = 1, exceeds it
        fill_cells(*space, cells.internal[0], [&](double, double y) { return y > -1.0 / 3.0 ? scale * 0.7 : scale * 0.6; });
        CHECK(space->unresolved(cells).y == doctest::Approx(0.1).epsilon(1e-11));
        fill_cells(*space, cells.internal[0], [&](double, double y) { // and of degree 6, without jumps
            const double t = 3.0 * (y < -1.0 / 3.0 ? y + 2.0 / 3.0 : y > 1.0 / 3.0 ? y - 2.0 / 3.0 : y), s = t * t;
            return scale * 0.2 * (231.0 * s * s * s - 315.0 * s * s + 105.0 * s - 5.0) / 16.0;
        });
        CHECK(space->unresolved(cells).y == doctest::Approx(0.2 / std::sqrt(13.0)).epsilon(1e-11));

        const auto staggered = staggered_on(rectangle);
        CellState rough = staggered->make_cells();
        fill_cells(*staggered, rough.stress.tau, [](double, double y) { return 3.0 * y; });
        CHECK(staggered->unresolved(rough).x < 1e-15);
        CHECK(staggered->unresolved(rough).y < 1e-14);
        for (int j = 0; j < rectangle.cells_y; ++j)
            for (int i = 0; i < rectangle.cells_x; ++i)
                rough.stress.tau(i, j) = i % 2 == 0 ? 0.25 : -0.25;
        rough.stress.tau.wrap();
        CHECK(staggered->unresolved(rough).x == doctest::Approx(0.25).epsilon(1e-14));
        CHECK(staggered->unresolved(rough).y < 1e-14);
        for (int j = 0; j < rectangle.cells_y; ++j)
            std::fill_n(rough.stress.tau.row(j), rectangle.cells_x, j % 2 == 0 ? 0.25 : -0.25);
        rough.stress.tau.wrap();
        CHECK(staggered->unresolved(rough).x < 1e-14);
        CHECK(staggered->unresolved(rough).y == doctest::Approx(0.25).epsilon(1e-14));
        // a wave of four cells is a quarter of itself; a parabola has a second difference, which counts beside the walls alone
        for (int i = 0; i < rectangle.cells_x; ++i)
            for (int j = 0; j < rectangle.cells_y; ++j)
                rough.stress.tau(i, j) = std::cos(0.5 * pi * i) + 0.5 * j * j;
        rough.stress.tau.wrap();
        CHECK(staggered->unresolved(rough).x == doctest::Approx(0.25 / std::sqrt(2.0)).epsilon(1e-12));
        CHECK(staggered->unresolved(rough).y == doctest::Approx(0.25).epsilon(1e-12));
    }

    TEST_CASE_FIXTURE(fields::OneThread, "what the finest scales hold of the plastic strain rate, of the largest there is") {
        // a band that is thin for the space: tau and chi, and with them the rate, are the same along x
        const auto fill = [](const Space& space, CellState& cells) {
            fill_cells(space, cells.stress.tau, [](double, double y) { return 1.2 - 0.1 * y; });
            fill_cells(space, cells.internal[0], [](double, double y) {
                return fields::glass_law->variables()[0].natural_scale() * (0.8 + 0.15 * std::exp(-30.0 * y * y));
            });
        };
        const double k = 2.0 * pi / rectangle.width;
        const auto space = elements_on({.degree = 8});
        CellState cells = space->make_cells();
        fill(*space, cells);
        Field rate(rectangle.cells_y, rectangle.cells_x);
        space->plastic_strain_rate(cells, rate);
        const Quadrature gauss = gauss_legendre(8);
        double largest_tail = 0.0, largest = 0.0;
        for (int e = 0; e < 3;
             ++e) { // (2 l + 1)/2 (integral of P_l f)^2 is what P_l has of the integral of f^2; of 8 the last two
            double tail = 0.0, whole = 0.0;
            for (const unsigned l : {6U, 7U}) {
                double integral = 0.0;
                for (int g = 0; g < 8; ++g)
                    integral += gauss.weights[static_cast<std::size_t>(g)] *
                                std::legendre(l, gauss.points[static_cast<std::size_t>(g)]) * rate(3, 8 * e + g);
                tail += 0.5 * (2.0 * l + 1.0) * 0.5 * integral * integral;
            }
            for (int g = 0; g < 8; ++g)
                whole += 0.5 * gauss.weights[static_cast<std::size_t>(g)] * std::pow(rate(3, 8 * e + g), 2);
            largest_tail = std::max(largest_tail, tail);
            largest = std::max(largest, whole);
        }
        Field room(rectangle.cells_y, rectangle.cells_x);
        const Unresolved flow = space->unresolved_flow(cells, 0.0, room);
        CHECK(flow.y > 0.02);
        CHECK(flow.y == doctest::Approx(std::sqrt(largest_tail / largest)).epsilon(1e-10));
        CHECK(flow.x < 1e-12);
        // what is less than `negligible` counts for less
        CHECK(space->unresolved_flow(cells, 5.0 * std::sqrt(largest), room).y == doctest::Approx(0.2 * flow.y).epsilon(1e-12));

        const auto staggered = staggered_on(rectangle);
        CellState on_cells = staggered->make_cells();
        fill(*staggered, on_cells);
        staggered->plastic_strain_rate(on_cells, rate);
        double difference = 0.0, value = 0.0;
        for (int j = 0; j < rectangle.cells_y; ++j) {
            value = std::max(value, rate(0, j));
            if (j >= 2 && j + 2 < rectangle.cells_y)
                difference = std::max(difference, std::abs(rate(0, j - 2) - 4.0 * rate(0, j - 1) + 6.0 * rate(0, j) -
                                                           4.0 * rate(0, j + 1) + rate(0, j + 2)) /
                                                      16.0);
        }
        CHECK(staggered->unresolved_flow(on_cells, 0.0, room).y == doctest::Approx(difference / value).epsilon(1e-12));
        fill_cells(*staggered, on_cells.stress.tau, [&](double x, double) { return 1.2 + 0.1 * std::cos(3.0 * k * x); });
        CHECK(staggered->unresolved_flow(on_cells, 0.0, room).x > 0.02); // four cells a wave
        set_all(on_cells.stress.tau, 0.5);                               // below yield nothing flows
        CHECK(staggered->unresolved_flow(on_cells, 1e-9, room).y == 0.0);
    }

    TEST_CASE_FIXTURE(fields::OneThread, "fields keep their integrals and their polynomials where edges move") {
        std::mt19937 engine(11);
        const auto space = adaptable(rectangle, 6); // four elements
        CHECK(space->movable_edges() == std::vector{0.0, 0.5, 1.0, 1.5, 2.0});
        const double k = 2.0 * pi / rectangle.width;
        const auto smooth = [&](double x, double y) { return std::cos(k * x) * (1.0 + y - 3.0 * y * y + std::pow(y, 5)) + 0.3; };
        const auto smoother = [&](double x, double y) { return smooth(x, y) + std::sin(k * x) * std::pow(y, 6); };
        Field polynomial(24, 12, 2), rough(24, 12), at_nodes(25, 12);
        fields::fill_randomly(rough, engine, -1.0, 1.0);
        fill_cells(*space, polynomial, smooth);
        fill_nodes(*space, at_nodes, smoother);
        const auto integral = [&](const Field& field, int column) {
            double sum = 0.0;
            for (int j = 0; j < field.rows(); ++j)
                sum += space->rows().weight[static_cast<std::size_t>(j)] * field(column, j);
            return sum;
        };
        const auto square = [&](const Field& field) {
            double sum = 0.0;
            for (int j = 0; j < field.rows(); ++j)
                sum += space->rows().weight[static_cast<std::size_t>(j)] * field(4, j) * field(4, j);
            return sum;
        };
        const Field before = rough;
        const double of_column = integral(rough, 4), of_square = square(rough);
        // the first is halved, the last two are one: nothing is lost of the first two
        space->move_edges({0.0, 0.25, 0.5, 1.0, 2.0}, std::array{&polynomial, &rough, &at_nodes});
        CHECK(space->movable_edges() == std::vector{0.0, 0.25, 0.5, 1.0, 2.0});
        CHECK(space->rows().node[6] == doctest::Approx(3.0).epsilon(1e-14));
        Field expected = polynomial, expected_at_nodes = at_nodes;
        fill_cells(*space, expected, smooth);
        fill_nodes(*space, expected_at_nodes, smoother);
        CHECK(largest_difference(polynomial, expected) < 1e-12);
        CHECK(largest_difference(at_nodes, expected_at_nodes) < 1e-12);
        CHECK(polynomial(-1, 3) == polynomial(11, 3));
        CHECK(at_nodes(12, 24) == at_nodes(0, 24));
        CHECK(integral(rough, 4) == doctest::Approx(of_column).epsilon(1e-12));
        CHECK(square(rough) < 0.99 * of_square);
        // what had been one element comes back from its halves
        space->move_edges({0.0, 0.5, 1.0, 1.5, 2.0}, std::array{&rough});
        double difference = 0.0;
        for (int j = 0; j < 12; ++j)
            difference = std::max(difference, std::abs(rough(4, j) - before(4, j)));
        CHECK(difference < 1e-12);
        CHECK(integral(rough, 4) == doctest::Approx(of_column).epsilon(1e-12));
        // any edges: a velocity of the new space still meets the stiffness of the new space
        space->move_edges({0.0, 0.3, 0.35, 1.4, 2.0}, {});
        const VectorField velocity = random_velocity(*space, engine);
        VectorField force = space->make_velocity();
        space->divergence(stress_of(*space, velocity).stress, 1.0, force);
        for (const int wall : {0, rectangle.cells_y})
            for (auto [from, to] : {std::pair{&velocity.u, &force.u}, {&velocity.v, &force.v}})
                std::copy_n(from->row(wall), rectangle.cells_x, to->row(wall));
        space->solve(force, WallData::given);
        CHECK(largest_difference(force.u, velocity.u) < 1e-9);
        CHECK(largest_difference(force.v, velocity.v) < 1e-9);
    }

    TEST_CASE_FIXTURE(fields::OneThread, "edges go to where fields are fine, until all elements show about as much") {
        Grid tall = rectangle;
        tall.cells_y = 96;
        const auto space = adaptable(tall, 8); // twelve elements
        CellState cells = space->make_cells();
        const double scale = fields::glass_law->variables()[0].natural_scale();
        const auto fill = [&](double width) {
            fill_cells(*space, cells.internal[0],
                       [&](double, double y) { return scale * (0.5 + 0.1 * std::tanh((y - 0.37) / width)); });
        };
        // the tail of a Legendre series, element by element, in the mean square over the height
        const auto worst = [&] { return space->unresolved(cells).y; };
        fill(2.0);
        CHECK(space->better_edges(cells).empty());
        const double width = 0.04;
        fill(width);
        const double uniform = worst();
        int rounds = 0;
        for (std::vector<double> edges; !(edges = space->better_edges(cells)).empty() && rounds < 20; ++rounds) {
            CHECK(edges.size() == 13);
            CHECK(edges.front() == 0.0);
            CHECK(edges.back() == 2.0);
            space->move_edges(edges, {});
            fill(width);
        }
        CHECK(rounds > 0);
        CHECK(rounds < 10);
        CHECK(worst() < 0.01 * uniform);
        const std::vector<double> edges = space->movable_edges();
        double narrowest = 2.0, where = 0.0;
        for (std::size_t e = 0; e + 1 < edges.size(); ++e)
            if (edges[e + 1] - edges[e] < narrowest) {
                narrowest = edges[e + 1] - edges[e];
                where = 0.5 * (edges[e + 1] + edges[e]) - 1.0;
            }
        CHECK(narrowest < 0.5 * 2.0 / 12.0);
        CHECK(std::abs(where - 0.37) < 0.1);
        // also by the stress, and away from there again
        set_all(cells.internal[0], scale * 0.5);
        fill_cells(*space, cells.stress.tau, [&](double, double y) { return 0.8 + 0.1 * std::tanh((y + 0.6) / width); });
        const std::vector<double> moved = space->better_edges(cells);
        REQUIRE_FALSE(moved.empty());
        const auto elements_about = [&](const std::vector<double>& of, double y) {
            return std::ranges::count_if(of, [&](double edge) { return std::abs(edge - 1.0 - y) < 0.15; });
        };
        CHECK(elements_about(moved, -0.6) > elements_about(edges, -0.6));
        CHECK(elements_about(moved, 0.37) < elements_about(edges, 0.37));
        // of fields that are round-off, nothing
        set_all(cells.stress.tau, 0.8);
        CHECK(space->better_edges(cells).empty());
        // elements that must not move do not
        const auto fixed = elements_on({.grid = tall, .degree = 8});
        CHECK(fixed->movable_edges().empty());
        fill_cells(*fixed, cells.internal[0], [&](double, double y) { return scale * (0.5 + 0.1 * std::tanh(y / width)); });
        CHECK(fixed->better_edges(cells).empty());
        CHECK_THROWS_AS(fixed->move_edges(edges, {}), InputError);
        CHECK_THROWS_AS(staggered_on(tall)->move_edges(edges, {}), InputError);
        CHECK_THROWS_AS(space->move_edges({0.0, 1.0, 2.0}, {}), InputError);
    }

    TEST_CASE("what cannot be is refused with a way out") {
        const auto message = [&](const Grid& grid, bool transported, const ElementOptions& options) -> std::string {
            try {
                (void)make_element_space(grid, {fields::glass_law, transported}, options);
            } catch (const InputError& error) {
                return error.what();
            }
            return "";
        };
        const auto contains = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
        CHECK(contains(message(rectangle, false, {.degree = 7}), "take 21 or 28 rows"));
        CHECK(contains(message(rectangle, false, {.degree = 17}), "1 to 16"));
        CHECK(contains(message(rectangle, true, {.degree = 1}), "staggered"));
        CHECK(contains(message(rectangle, false, {.degree = 6, .edges = {0.0}}), "make 4"));
        CHECK(contains(message(rectangle, false, {.degree = 6, .edges = {0.5, 0.2, 0.9}}), "rise"));
        CHECK(contains(message(rectangle, false, {.degree = 6, .edges = {-1.5, 0.2, 0.9}}), "rise"));
        CHECK(contains(message(rectangle, false, {.degree = 12, .adapt = true}), "2 elements of degree 12 cannot be adapted"));
        CHECK(contains(message(rectangle, false, {.degree = 3, .adapt = true}), "three of degree 4 or more"));
    }
}

} // namespace elements_suite
