// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/base/threads.hpp>
#include <ductile/space/element_adaptation.hpp>
#include <ductile/space/element_line.hpp>
#include <ductile/space/element_modes.hpp>
#include <ductile/space/periodic_line.hpp>
#include <ductile/space/row_kernels.hpp>
#include <ductile/space/small_products.hpp>

#include <algorithm>
#include <array>
#include <fmt/format.h>

namespace ductile {

namespace {

/// From 0 to the height.
void check_edges(const Grid& grid, int degree, const std::vector<double>& edges) {
    const std::size_t elements = static_cast<std::size_t>(grid.cells_y / degree);
    if (edges.size() != elements + 1)
        throw InputError(fmt::format("{} edges make {} elements, and {} rows of points in elements of degree {} make {}",
                                     edges.size() - 2, edges.size() - 1, grid.cells_y, degree, elements));
    for (std::size_t e = 0; e < elements; ++e)
        if (!(edges[e + 1] - edges[e] > 1e-6 * grid.height))
            throw InputError("the edges of elements must rise between the walls, by a millionth of their distance or more");
}

std::vector<double> edges_of(const Grid& grid, const ElementOptions& options) {
    if (options.edges.empty())
        return equal_elements(grid.cells_y / options.degree, grid.height);
    std::vector<double> edges{0.0};
    for (const double y : options.edges)
        edges.push_back(y + 0.5 * grid.height);
    edges.push_back(grid.height);
    check_edges(grid, options.degree, edges);
    return edges;
}

/// The padded rows of an element that a thread works on.
class ElementScratch {
public:
    ElementScratch(int rows, int padded)
        : size_(static_cast<std::size_t>(rows) * static_cast<std::size_t>(padded)), padded_(padded) {
        thread_local aligned_vector<double> numbers;
        if (numbers.size() < arrays * size_)
            numbers.resize(arrays * size_);
        first_ = numbers.data();
    }

    [[nodiscard]] double* array(int k) const { return first_ + static_cast<std::size_t>(k) * size_; }
    [[nodiscard]] double* row(int k, int l) const { return array(k) + static_cast<std::ptrdiff_t>(l) * padded_; }
    [[nodiscard]] RowsOf<double> rows(int k, int l = 0) const { return {row(k, l), padded_}; }
    [[nodiscard]] RowsOf<const double> from(int k, int l = 0) const { return {row(k, l), padded_}; }

private:
    static constexpr std::size_t arrays = 10;
    std::size_t size_;
    int padded_;
    double* first_;
};

/// Numbers of the arrays in a ElementScratch.
namespace array {
constexpr int ux = 0, uy = 1, vx = 2, vy = 3, u = 4, v = 5;       // at stress points
constexpr int u_slope = 6, u_value = 7, v_slope = 8, v_value = 9; // at nodes and, in x, cells
} // namespace array

/// Fourier series in x and elements in y.
///
/// B: from nodes to cells in x (PeriodicLine), from nodes to stress points in y (ElementLine). B^T is the same matrices
/// transposed with the weights of the points, so that sum sigma : D(v) dA = v . B^T sigma, and K = B^T C B (ElementModes) makes
/// the projection exact to round-off on any edges.
///
/// Transport: v . grad f by the slopes of the polynomial in y and of the Fourier series in x, and at the edges between elements
/// what comes in from the neighbour, weakly:
///   sum_g W_g l_g (df/dt + v f_y)_g = -l(bottom) max(v, 0) (f - f_below) - l(top) min(v, 0) (f_above - f)
/// for the polynomials l through the stress points, that is, for each of them divided by its weight. Nothing comes in at walls.
class ElementSpace final : public Space {
public:
    ElementSpace(const Grid& grid, const Medium& medium, const ElementOptions& options, std::vector<double> edges)
        : Space(grid, medium, ElementLine(options.degree, edges).rows()),
          x_(grid.cells_x, grid.width, options.degree == 1 ? LineRule::staggered : LineRule::spectral),
          y_(options.degree, std::move(edges)), adapt_(options.adapt), modes_(x_, y_, medium.law->elasticity()),
          edges_(static_cast<std::size_t>(4 * y_.elements() * x_.padded())) {
        for (const double weight : y_.at_top)
            minus_at_top_.push_back(-weight);
    }

    void prepare_transport(CellState& cells) const override;
    void solve(VectorField& force, WallData walls) override { modes_.solve(force, walls); }
    void divergence(const StressField& stress, double factor, VectorField& force) const override;
    void close(const VectorField& velocity, CellState& rate) const override;
    void combine(std::span<const Term> terms, const OpenRate& open, CellState& out) const override;
    using Space::combine;
    [[nodiscard]] double wall_power(const StressField& stress, const Velocity& upper) const override;
    double correct(const VectorField& phi, const Velocity& wall, double dt, StressField& stress) override;
    void at_points(const VectorField& velocity, Field& u, Field& v) const override;
    void advect(std::span<Field> fields, const VectorField& velocity, std::span<Field> rates) const override;
    [[nodiscard]] Interpolation interpolation(At at, const std::vector<double>& x, const std::vector<double>& y) const override;
    [[nodiscard]] std::vector<double> movable_edges() const override { return adapt_ ? y_.edges : std::vector<double>{}; }
    [[nodiscard]] std::vector<double> better_edges(const CellState& cells) const override;
    void move_edges(const std::vector<double>& edges, std::span<Field* const> fields) override;
    [[nodiscard]] std::size_t memory_bytes() const override {
        std::size_t numbers = edges_.size();
        for (const auto& [x, y, jumps] : slopes_)
            numbers += x.storage().size() + y.storage().size() + jumps.storage().size();
        return modes_.memory_bytes() + x_.memory_bytes() + numbers * sizeof(double);
    }

protected:
    using Space::unresolved;
    [[nodiscard]] Unresolved unresolved(const Field& field) const override;
    void sweep(const CellState& cells, const VectorField& velocity, bool elastic, CellState& sources, RowKernel kernel,
               double factor, VectorField& force) override;

private:
    /// visit(element, scratch)
    void for_each_element(const auto& visit) const {
        for_each_row(Rows{y_.elements(), y_.degree * x_.points()},
                     [&](int e) { visit(e, ElementScratch(y_.degree + 1, x_.padded())); });
    }
    /// Of the velocity gradient at the stress points of an element, where velocity is wanted, too, what find_velocity() finds.
    void find_gradients(const VectorField& velocity, int e, bool with_velocity, const ElementScratch& scratch) const;
    /// At the stress points of an element, and at its nodes in y.
    void find_velocity(const VectorField& velocity, int e, const ElementScratch& scratch) const;
    /// gradient_at(i) of stress row l of the element.
    [[nodiscard]] auto gradients_of_row(int e, int l, const ElementScratch& scratch) const {
        const double *ux = scratch.row(array::ux, l), *uy = scratch.row(array::uy, l), *vx = scratch.row(array::vx, l),
                     *vy = scratch.row(array::vy, l);
        return [ =, by_height = 2.0 / y_.height(e) ](int i) __attribute__((DUCTILE_ALWAYS_INLINE)) {
            return VelocityGradient<Pack>{load(ux + i), Pack(by_height) * load(uy + i), load(vx + i),
                                          Pack(by_height) * load(vy + i)};
        };
    }
    /// What carry() takes from the fields number 0 to count - 1.
    void find_slopes(int count, FunctionRef<const Field&(int k)> field) const;
    /// rate = -(v . grad) f on the element's rows of field k, as prepared.
    void carry(int k, int e, const ElementScratch& scratch, Field& rate) const;
    /// f at the lower edge of an element less f of the element below there.
    void jump(const Field& f, int e, double* row) const {
        const int p = y_.degree;
        multiply(1, p, x_.padded(), {y_.at_bottom.data(), p}, {f.row(e * p), f.stride()}, {row, 0});
        multiply<true>(1, p, x_.padded(), {minus_at_top_.data(), p}, {f.row((e - 1) * p), f.stride()}, {row, 0});
    }
    /// Forces on the nodes within the element; those at its edges wait for join_edges().
    void find_forces(const StressField& stress, double factor, int e, const ElementScratch& scratch, VectorField& force) const;
    void join_edges(VectorField& force) const;
    /// Force at the lower (0) or upper (1) edge of an element.
    [[nodiscard]] double* edge_force(int e, int edge, int component) const {
        return edges_.data() + static_cast<std::ptrdiff_t>((2 * e + edge) * 2 + component) * x_.padded();
    }

    PeriodicLine x_;
    ElementLine y_;
    bool adapt_;
    std::vector<double> minus_at_top_;
    ElementModes modes_;
    /// What transport takes from the fields alone, so that all velocities of a right-hand side share it: slopes in x and in y at
    /// the stress points, and at the lower edge of each element the difference to the one below.
    struct Slopes {
        Field x, y, jumps;
    };
    mutable std::vector<Slopes> slopes_;
    mutable aligned_vector<double> edges_; ///< [elements][lower, upper][u, v][padded], room to work in
};

void ElementSpace::find_gradients(const VectorField& velocity, int e, bool with_velocity, const ElementScratch& s) const {
    const int p = y_.degree, n = p + 1, m = x_.points(), padded = x_.padded();
    const RowsOf<const double> slope{x_.slope_at_cells(), padded}, value{x_.value_at_cells(), padded};
    const RowsOf<const double> u{velocity.u.row(e * p), velocity.u.stride()}, v{velocity.v.row(e * p), velocity.v.stride()};
    multiply(n, m, padded, u, slope, s.rows(array::u_slope));
    multiply(n, m, padded, u, value, s.rows(array::u_value));
    multiply(n, m, padded, v, slope, s.rows(array::v_slope));
    multiply(n, m, padded, v, value, s.rows(array::v_value));
    const RowsOf<const double> value_y{y_.value.data(), n}, slope_y{y_.slope.data(), n};
    multiply(p, n, padded, value_y, s.from(array::u_slope), s.rows(array::ux));
    multiply(p, n, padded, slope_y, s.from(array::u_value), s.rows(array::uy));
    multiply(p, n, padded, value_y, s.from(array::v_slope), s.rows(array::vx));
    multiply(p, n, padded, slope_y, s.from(array::v_value), s.rows(array::vy));
    if (with_velocity) {
        multiply(p, n, padded, value_y, s.from(array::u_value), s.rows(array::u));
        multiply(p, n, padded, value_y, s.from(array::v_value), s.rows(array::v));
    }
}

void ElementSpace::find_velocity(const VectorField& velocity, int e, const ElementScratch& s) const {
    const int p = y_.degree, n = p + 1, m = x_.points(), padded = x_.padded();
    const RowsOf<const double> value{x_.value_at_cells(), padded}, value_y{y_.value.data(), n};
    multiply(n, m, padded, {velocity.u.row(e * p), velocity.u.stride()}, value, s.rows(array::u_value));
    multiply(n, m, padded, {velocity.v.row(e * p), velocity.v.stride()}, value, s.rows(array::v_value));
    multiply(p, n, padded, value_y, s.from(array::u_value), s.rows(array::u));
    multiply(p, n, padded, value_y, s.from(array::v_value), s.rows(array::v));
}

void ElementSpace::prepare_transport(CellState& cells) const {
    find_slopes(cells.count(), [&](int k) -> const Field& { return cells.field(k); });
}

std::vector<double> ElementSpace::better_edges(const CellState& cells) const {
    if (!adapt_)
        return {};
    std::vector<ScaledField> fields{{&cells.stress.tau}};
    const auto variables = medium().law->variables();
    for (std::size_t k = 0; k < variables.size(); ++k)
        fields.push_back({&cells.internal[k], variables[k].natural_scale()});
    return adapted_edges(y_, fields);
}

void ElementSpace::move_edges(const std::vector<double>& edges, std::span<Field* const> fields) {
    if (!adapt_)
        return Space::move_edges(edges, fields);
    check_edges(grid(), y_.degree, edges);
    ElementLine moved(y_.degree, edges);
    for (Field* field : fields)
        carry_over(y_, moved, *field);
    y_ = std::move(moved);
    modes_ = ElementModes(x_, y_, medium().law->elasticity());
    set_rows(y_.rows());
}

void ElementSpace::find_slopes(int count, FunctionRef<const Field&(int k)> field) const {
    const int p = y_.degree, padded = x_.padded();
    slopes_.resize(std::max(slopes_.size(), static_cast<std::size_t>(count)));
    for (Slopes& of_field : slopes_)
        if (of_field.x.rows() == 0)
            of_field = {Field(grid().cells_y, grid().cells_x), Field(grid().cells_y, grid().cells_x),
                        Field(y_.elements(), grid().cells_x)};
    for_each_element([&](int e, const ElementScratch&) {
        for (int k = 0; k < count; ++k) {
            const Field& f = field(k);
            auto& [x, y, jumps] = slopes_[static_cast<std::size_t>(k)];
            const RowsOf<const double> rows{f.row(e * p), f.stride()};
            multiply(p, x_.points(), padded, rows, {x_.slope_between_cells(), padded}, {x.row(e * p), x.stride()});
            multiply(p, p, padded, {y_.slope_of_stress.data(), p}, rows, {y.row(e * p), y.stride()});
            if (e > 0)
                jump(f, e, jumps.row(e));
        }
    });
}

void ElementSpace::carry(int k, int e, const ElementScratch& s, Field& rate) const {
    const int p = y_.degree;
    const auto& [x, y, jumps] = slopes_[static_cast<std::size_t>(k)];
    const bool has_lower = e > 0, has_upper = e + 1 < y_.elements();
    const double *v_lower = s.row(array::v_value, 0), *v_upper = s.row(array::v_value, p);
    const double *lower = jumps.row(e), *upper = jumps.row(has_upper ? e + 1 : e);
    const double by_height = 2.0 / y_.height(e);
    for (int l = 0; l < p; ++l) {
        const auto g = static_cast<std::size_t>(l);
        const Pack from_lower(has_lower ? by_height * y_.at_bottom[g] / y_.gauss.weights[g] : 0.0);
        const Pack from_upper(has_upper ? by_height * y_.at_top[g] / y_.gauss.weights[g] : 0.0);
        const int j = e * p + l;
        const double *f_x = x.row(j), *f_y = y.row(j), *u = s.row(array::u, l), *v = s.row(array::v, l);
        double* const target = rate.row(j);
        for (int i = 0; i < x_.points(); i += pack_size) {
            const Pack within = load(u + i) * load(f_x + i) + Pack(by_height) * load(v + i) * load(f_y + i);
            const Pack comes_in = from_lower * maximum(load(v_lower + i), Pack(0.0)) * load(lower + i) +
                                  from_upper * minimum(load(v_upper + i), Pack(0.0)) * load(upper + i);
            store(-(within + comes_in), target + i);
        }
    }
}

void ElementSpace::sweep(const CellState& cells, const VectorField& velocity, bool elastic, CellState& sources, RowKernel kernel,
                         double factor, VectorField& force) {
    const IsotropicElasticity& elasticity = medium().law->elasticity();
    const bool transported = medium().transported;
    const Pack by_bulk_modulus(1.0 / elasticity.bulk_modulus), by_shear_modulus(1.0 / elasticity.shear_modulus);
    const int p = y_.degree, columns = x_.points();
    for_each_element([&](int e, const ElementScratch& scratch) {
        if (elastic || transported)
            find_gradients(velocity, e, transported, scratch);
        for (int k = 0; k < sources.count(); ++k)
            if (transported)
                carry(k, e, scratch, sources.field(k));
            else
                for (int l = 0; l < p; ++l)
                    std::fill_n(sources.field(k).row(e * p + l), x_.padded(), 0.0);
        for (int l = 0; l < p; ++l) {
            const int j = e * p + l;
            const auto gradient_at = gradients_of_row(e, l, scratch);
            const StressField& now = cells.stress;
            StressField& rate = sources.stress;
            Pack power(0.0);
            if (transported)
                for (int i = 0; i < columns; i += pack_size) {
                    const VelocityGradient<Pack> gradient = gradient_at(i);
                    const Pack turn = gradient.uy - gradient.vx;
                    const Pack s = load(now.s.row(j) + i), tau = load(now.tau.row(j) + i);
                    const Pack s_rate = load(rate.s.row(j) + i), tau_rate = load(rate.tau.row(j) + i);
                    Pack here = by_bulk_modulus * (load(now.p.row(j) + i) * load(rate.p.row(j) + i)) +
                                by_shear_modulus * (s * s_rate + tau * tau_rate +
                                                    Pack(3.0) * (load(now.q.row(j) + i) * load(rate.q.row(j) + i)));
                    if (i + pack_size > columns) // lanes beyond the last column hold copies
                        here = select(Pack::counting_from(i) < Pack(static_cast<double>(columns)), here, Pack(0.0));
                    power = power + here;
                    store(s_rate + turn * tau, rate.s.row(j) + i);
                    store(tau_rate - turn * s, rate.tau.row(j) + i);
                }
            if (elastic)
                close_row(elasticity, gradient_at, j, sources);
            kernel(j, sum_of(power));
        }
        if (factor != 0.0)
            find_forces(sources.stress, factor, e, scratch, force);
    });
    if (factor != 0.0)
        join_edges(force);
}

void ElementSpace::find_forces(const StressField& stress, double factor, int e, const ElementScratch& s,
                               VectorField& force) const {
    using namespace array;
    // of the stress, with the weights of points, what meets values (ux, vx) and slopes (uy, vy) of a velocity
    const int p = y_.degree, n = p + 1, m = x_.points(), padded = x_.padded();
    for (int l = 0; l < p; ++l) {
        const int j = e * p + l;
        const double weight = factor * x_.spacing() * y_.gauss.weights[static_cast<std::size_t>(l)];
        const Pack with_slope(weight), with_value(0.5 * y_.height(e) * weight);
        for (int i = 0; i < padded; i += pack_size) {
            const Pack mean = load(stress.p.row(j) + i) + load(stress.q.row(j) + i), deviator = load(stress.s.row(j) + i);
            const Pack tau = load(stress.tau.row(j) + i);
            store(with_value * (deviator - mean), s.row(ux, l) + i);
            store(with_slope * tau, s.row(uy, l) + i);
            store(with_value * tau, s.row(vx, l) + i);
            store(with_slope * -(deviator + mean), s.row(vy, l) + i);
        }
    }
    const RowsOf<const double> value_y{y_.value_transposed.data(), p}, slope_y{y_.slope_transposed.data(), p};
    multiply(n, p, padded, value_y, s.from(ux), s.rows(u_slope));
    multiply(n, p, padded, slope_y, s.from(uy), s.rows(u_value));
    multiply(n, p, padded, value_y, s.from(vx), s.rows(v_slope));
    multiply(n, p, padded, slope_y, s.from(vy), s.rows(v_value));
    const RowsOf<const double> slope_x{x_.slope_transposed(), padded}, value_x{x_.value_transposed(), padded};
    const auto collect = [&](int first, int count, RowsOf<double> fu, RowsOf<double> fv) {
        multiply(count, m, padded, s.from(u_slope, first), slope_x, fu);
        multiply<true>(count, m, padded, s.from(u_value, first), value_x, fu);
        multiply(count, m, padded, s.from(v_slope, first), slope_x, fv);
        multiply<true>(count, m, padded, s.from(v_value, first), value_x, fv);
    };
    collect(0, 1, {edge_force(e, 0, 0), 0}, {edge_force(e, 0, 1), 0});
    if (p > 1)
        collect(1, p - 1, {force.u.row(e * p + 1), force.u.stride()}, {force.v.row(e * p + 1), force.v.stride()});
    collect(p, 1, {edge_force(e, 1, 0), 0}, {edge_force(e, 1, 1), 0});
}

void ElementSpace::join_edges(VectorField& force) const {
    for (const auto& [component, field] : {std::pair{0, &force.u}, std::pair{1, &force.v}}) {
        for (const int wall : {0, grid().cells_y})
            std::fill_n(field->row(wall), x_.padded(), 0.0);
        for (int e = 1; e < y_.elements(); ++e) {
            const double *below = edge_force(e - 1, 1, component), *above = edge_force(e, 0, component);
            double* const row = field->row(e * y_.degree);
            for (int i = 0; i < x_.padded(); i += pack_size)
                store(load(below + i) + load(above + i), row + i);
        }
    }
}

void ElementSpace::divergence(const StressField& stress, double factor, VectorField& force) const {
    for_each_element([&](int e, const ElementScratch& scratch) { find_forces(stress, factor, e, scratch, force); });
    join_edges(force);
}

void ElementSpace::close(const VectorField& velocity, CellState& rate) const {
    for_each_element([&](int e, const ElementScratch& scratch) {
        find_gradients(velocity, e, false, scratch);
        for (int l = 0; l < y_.degree; ++l)
            close_row(medium().law->elasticity(), gradients_of_row(e, l, scratch), e * y_.degree + l, rate);
    });
}

void ElementSpace::combine(std::span<const Term> terms, const OpenRate& open, CellState& out) const {
    const OpenTerms all(terms, open);
    for_each_element([&](int e, const ElementScratch& scratch) {
        find_gradients(*open.velocity, e, false, scratch);
        for (int l = 0; l < y_.degree; ++l)
            all.combine_row(medium().law->elasticity(), gradients_of_row(e, l, scratch), e * y_.degree + l, out);
    });
    combine_numbers(all.terms(), out);
}

double ElementSpace::correct(const VectorField& phi, const Velocity& wall, double dt, StressField& stress) {
    for_each_element([&](int e, const ElementScratch& scratch) {
        find_gradients(phi, e, false, scratch);
        for (int l = 0; l < y_.degree; ++l)
            row_sums()[static_cast<std::size_t>(e * y_.degree + l)] = correct_row(
                medium().law->elasticity(), gradients_of_row(e, l, scratch), wall_rate(wall), dt, e * y_.degree + l, stress);
    });
    return root_mean_of_row_sums();
}

Unresolved ElementSpace::unresolved(const Field& field) const {
    const int p = y_.degree, padded = x_.padded(), points = x_.points();
    const auto visit = [&](int e, Unresolved& largest) {
        const ElementScratch scratch(p + 1, padded);
        const RowsOf<const double> rows{field.row(e * p), field.stride()};
        // of the waves in x the square is integrated over y, of the polynomials in y it is the sum of the coefficients'
        multiply(p, points, padded, rows, {x_.short_waves(), padded}, scratch.rows(0));
        const auto mean_square = [&](const double* row) {
            double sum = 0.0;
            for (int i = 0; i < points; ++i)
                sum += row[i] * row[i];
            return 0.5 * sum / points;
        };
        Unresolved here;
        for (int l = 0; l < p; ++l) {
            here.x += y_.gauss.weights[static_cast<std::size_t>(l)] * mean_square(scratch.row(0, l));
            here.whole += y_.gauss.weights[static_cast<std::size_t>(l)] * mean_square(field.row(e * p + l));
        }
        here.y = y_.mean_square_of_tail(field, e * p);
        if (e > 0) {
            jump(field, e, scratch.row(1, 0));
            here.jump = 2.0 * mean_square(scratch.row(1, 0));
        }
        largest.take(here);
    };
    const Unresolved squares = gather_rows(Rows{y_.elements(), p * points}, Unresolved{}, visit,
                                           [](Unresolved& total, const Unresolved& part) { total.take(part); });
    return {std::sqrt(squares.x), std::sqrt(squares.y), std::sqrt(squares.jump), std::sqrt(squares.whole)};
}

void ElementSpace::at_points(const VectorField& velocity, Field& u, Field& v) const {
    for_each_element([&](int e, const ElementScratch& scratch) {
        find_velocity(velocity, e, scratch);
        for (int l = 0; l < y_.degree; ++l)
            for (const auto& [array, field] : {std::pair{array::u, &u}, std::pair{array::v, &v}})
                std::copy_n(scratch.row(array, l), x_.points(), field->row(e * y_.degree + l));
    });
}

void ElementSpace::advect(std::span<Field> fields, const VectorField& velocity, std::span<Field> rates) const {
    const int count = static_cast<int>(fields.size());
    find_slopes(count, [&](int k) -> const Field& { return fields[static_cast<std::size_t>(k)]; });
    for_each_element([&](int e, const ElementScratch& scratch) {
        find_velocity(velocity, e, scratch);
        for (int k = 0; k < count; ++k)
            carry(k, e, scratch, rates[static_cast<std::size_t>(k)]);
    });
}

/// The series in x and the polynomials in y.
Interpolation ElementSpace::interpolation(At at, const std::vector<double>& x, const std::vector<double>& y) const {
    std::vector<Interpolation::Weights> along_x, along_y;
    for (const double place : x) {
        along_x.emplace_back();
        for (int i = 0; i < x_.points(); ++i)
            along_x.back().emplace_back(i, x_.value_between(place - i - (at == At::cells ? 0.5 : 0.0)));
    }
    for (const double place : y) {
        const double height = place * grid().dy();
        const auto above = std::upper_bound(y_.edges.begin() + 1, y_.edges.end() - 1, height);
        const int e = static_cast<int>(above - y_.edges.begin()) - 1;
        const double within = 2.0 * (height - y_.edges[static_cast<std::size_t>(e)]) / y_.height(e) - 1.0;
        const std::vector<double> weights =
            interpolation_matrix(at == At::cells ? y_.gauss.points : y_.nodes, std::array{within});
        along_y.emplace_back();
        for (std::size_t l = 0; l < weights.size(); ++l)
            along_y.back().emplace_back(e * y_.degree + static_cast<int>(l), weights[l]);
    }
    return {std::move(along_x), std::move(along_y)};
}

double ElementSpace::wall_power(const StressField& stress, const Velocity& upper) const {
    // the walls' rows of B^T sigma: of the sum over x values count alone, and a wave that is not constant has none
    double force_x = 0.0, force_y = 0.0; // of both walls, on either side
    const auto n = static_cast<std::size_t>(y_.degree + 1);
    for (const auto& [e, node, side] : {std::tuple{0, std::size_t{0}, -1.0}, std::tuple{y_.elements() - 1, n - 1, 1.0}})
        for (std::size_t g = 0; g + 1 < n; ++g) {
            const int j = e * y_.degree + static_cast<int>(g);
            const double weight = side * y_.gauss.weights[g] * y_.slope[g * n + node];
            for (int i = 0; i < x_.points(); ++i) {
                force_x += weight * stress.tau(i, j);
                force_y -= weight * (stress.p(i, j) + stress.s(i, j) + stress.q(i, j));
            }
        }
    return x_.spacing() * (force_x * upper.u + force_y * upper.v);
}

} // namespace

std::unique_ptr<Space> make_element_space(const Grid& grid, const Medium& medium, const ElementOptions& options) {
    check(grid);
    check(medium.law->elasticity());
    const int degree = options.degree;
    if (degree < 1 || degree > 16)
        throw InputError(fmt::format("elements of degree {}: from 1 to 16 there are", degree));
    if (grid.cells_y % degree != 0)
        throw InputError(fmt::format("{} rows of points do not make elements of degree {}: take {} or {} rows", grid.cells_y,
                                     degree, grid.cells_y / degree * degree, (grid.cells_y / degree + 1) * degree));
    if (degree == 1 && medium.transported)
        throw InputError("elements of degree 1 carry fields along with first order only: take the staggered space, the reduced "
                         "model, or a degree of 2 or more");
    if (options.adapt && (degree < 4 || grid.cells_y / degree < 3))
        throw InputError(fmt::format("{} elements of degree {} cannot be adapted: that takes three of degree 4 or more",
                                     grid.cells_y / degree, degree));
    return std::make_unique<ElementSpace>(grid, medium, options, edges_of(grid, options));
}

} // namespace ductile
