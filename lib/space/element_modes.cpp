// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/base/simd.hpp>
#include <ductile/base/threads.hpp>
#include <ductile/space/element_modes.hpp>
#include <ductile/space/small_products.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace ductile {

namespace {

constexpr int register_modes = Pack::register_size;

/// The same for real and imaginary parts.
[[gnu::DUCTILE_ALWAYS_INLINE]] inline Pack load_twice(const double* p) {
    const Pack::Register x(p, std::experimental::element_aligned);
    return {x, x};
}

/// K of one element and mode.
class ElementStiffness {
public:
    ElementStiffness(const PeriodicLine& x, const ElementLine& y, const IsotropicElasticity& c, int mode, int element)
        : n_(y.nodes.size()), mass_(n_ * n_), stiffness_(mass_), cross_(mass_) {
        const double h = y.height(element), kappa = x.kappa(mode), iota = x.iota(mode), dx = x.spacing();
        for (std::size_t a = 0; a < n_; ++a)
            for (std::size_t b = 0; b < n_; ++b)
                for (std::size_t g = 0; g < y.gauss.points.size(); ++g) {
                    const double weight = dx * y.gauss.weights[g];
                    mass_[a * n_ + b] += weight * 0.5 * h * kappa * kappa * y.value[g * n_ + a] * y.value[g * n_ + b];
                    stiffness_[a * n_ + b] += weight * 2.0 / h * iota * iota * y.slope[g * n_ + a] * y.slope[g * n_ + b];
                    cross_[a * n_ + b] += weight * kappa * iota * y.value[g * n_ + a] * y.slope[g * n_ + b];
                }
        alpha_ = c.alpha();
        beta_ = c.beta();
        mu_ = c.shear_modulus;
    }

    /// Of component `c` (0: u, 1: w) of node a with component d of node b.
    [[nodiscard]] double operator()(std::size_t a, int c, std::size_t b, int d) const {
        if (c == d)
            return (c == 0 ? alpha_ : mu_) * mass_[a * n_ + b] + (c == 0 ? mu_ : alpha_) * stiffness_[a * n_ + b];
        if (c == 1)
            std::swap(a, b);
        return mu_ * cross_[b * n_ + a] - beta_ * cross_[a * n_ + b];
    }

private:
    std::size_t n_;
    std::vector<double> mass_, stiffness_, cross_;
    double alpha_, beta_, mu_;
};

} // namespace

ElementModes::ElementModes(const PeriodicLine& x, const ElementLine& y, const IsotropicElasticity& elasticity)
    : points_(x.points()), padded_(x.padded()), rows_(y.elements() * y.degree), degree_(y.degree),
      blocks_((x.modes() + register_modes - 1) / register_modes) {
    const auto m = static_cast<std::size_t>(points_), n = static_cast<std::size_t>(padded_);
    const auto width = static_cast<std::size_t>(blocks_) * pack_size;
    for (auto* matrix : {&u_to_modes_, &w_to_modes_})
        matrix->assign(m * width, 0.0);
    for (auto* matrix : {&u_to_nodes_, &w_to_nodes_})
        matrix->assign(width * n, 0.0);
    // (re u, im u) and, for w = i v, (re w, im w) = (-im v, re v)
    for (std::size_t i = 0; i < n; ++i)
        for (int mode = 0; mode < x.modes(); ++mode) {
            const double angle =
                2.0 * std::numbers::pi * static_cast<double>(i % m * static_cast<std::size_t>(mode) % m) / points_;
            const double cosine = std::cos(angle), sine = std::sin(angle);
            const double share = (mode == 0 || 2 * mode == points_ ? 1.0 : 2.0) / points_;
            const auto re = static_cast<std::size_t>(mode / register_modes * pack_size + mode % register_modes),
                       im = re + register_modes;
            u_to_nodes_[re * n + i] = w_to_nodes_[im * n + i] = share * cosine;
            u_to_nodes_[im * n + i] = -share * sine;
            w_to_nodes_[re * n + i] = share * sine;
            if (i >= m)
                continue;
            u_to_modes_[i * width + re] = w_to_modes_[i * width + im] = cosine;
            u_to_modes_[i * width + im] = -sine;
            w_to_modes_[i * width + re] = sine;
        }
    for (int row = 0; row < unknowns(); ++row)
        entries_ += static_cast<std::size_t>(row - first(row) + 1);
    // unused lanes divide by nothing
    factors_.assign(static_cast<std::size_t>(blocks_) * entries_ * register_modes, 0.0);
    wall_couplings_.assign(static_cast<std::size_t>(2 * blocks_) * static_cast<std::size_t>(degree_ * 4 * register_modes), 0.0);
    values_.assign(static_cast<std::size_t>(blocks_) * static_cast<std::size_t>(unknowns() * pack_size), 0.0);
    wall_values_.assign(static_cast<std::size_t>(2 * blocks_ * 2 * pack_size), 0.0);
    for_each_task(blocks_, [&](int block) { factorise(x, y, elasticity, block); });
}

int ElementModes::first(int row) const {
    const int node = row / 2 + 1, edge = (node - 1) / degree_ * degree_;
    return std::max(0, 2 * (edge - 1));
}

void ElementModes::factorise(const PeriodicLine& x, const ElementLine& y, const IsotropicElasticity& elasticity, int block) {
    const int n = unknowns();
    std::vector<std::size_t> start; // of the rows' entries
    for (int row = 0; row < n; ++row)
        start.push_back(row == 0 ? 0 : start.back() + static_cast<std::size_t>(row - first(row - 1)));
    const auto size = static_cast<std::size_t>(degree_);
    for (int lane = 0; lane < register_modes && block * register_modes + lane < x.modes(); ++lane) {
        std::vector<double> a(entries_, 0.0); // the lower triangle, then L and D
        const auto at = [&](int row, int column) -> double& {
            return a[start[static_cast<std::size_t>(row)] + static_cast<std::size_t>(column - first(row))];
        };
        for (int e = 0; e < y.elements(); ++e) {
            const ElementStiffness k(x, y, elasticity, block * register_modes + lane, e);
            for (std::size_t l = 0; l <= size; ++l)
                for (std::size_t other = 0; other <= l; ++other)
                    for (const int c : {0, 1})
                        for (const int d : {0, 1}) {
                            const int row = 2 * (e * degree_ + static_cast<int>(l) - 1) + c;
                            const int column = 2 * (e * degree_ + static_cast<int>(other) - 1) + d;
                            if (column >= 0 && row < n && column <= row)
                                at(row, column) += k(l, c, other, d);
                        }
            for (const int wall : {0, 1}) {
                if (e != (wall == 0 ? 0 : y.elements() - 1))
                    continue;
                for (std::size_t l = 0; l < size; ++l) // counted from the node next to the lower wall, or from the lower edge on
                    for (const int c : {0, 1})
                        for (const int d : {0, 1}) {
                            const std::size_t node = wall == 0 ? l + 1 : l, beyond = wall == 0 ? 0 : size;
                            const std::size_t to = ((static_cast<std::size_t>(wall * blocks_ + block) * size + l) * 4 +
                                                    static_cast<std::size_t>(2 * c + d)) *
                                                       register_modes +
                                                   static_cast<std::size_t>(lane);
                            wall_couplings_[to] = k(node, c, beyond, d);
                        }
            }
        }
        for (int row = 0; row < n; ++row) {
            for (int column = first(row); column < row; ++column) {
                double sum = at(row, column);
                for (int k = std::max(first(row), first(column)); k < column; ++k)
                    sum -= at(row, k) * at(column, k);
                at(row, column) = sum; // L D still
            }
            double pivot = at(row, row);
            for (int column = first(row); column < row; ++column) {
                const double scaled = at(row, column) / at(column, column);
                pivot -= at(row, column) * scaled;
                at(row, column) = scaled;
            }
            at(row, row) = pivot;
        }
        double* const target = factors_.data() + static_cast<std::size_t>(block) * entries_ * register_modes + lane;
        for (int row = 0; row < n; ++row)
            for (int column = first(row); column <= row; ++column) {
                const std::size_t entry = start[static_cast<std::size_t>(row)] + static_cast<std::size_t>(column - first(row));
                target[entry * register_modes] = column == row ? 1.0 / a[entry] : a[entry];
            }
    }
}

double* ElementModes::modes_of(int block, int node) {
    return values_.data() + (static_cast<std::ptrdiff_t>(block) * unknowns() + 2 * (node - 1)) * pack_size;
}

void ElementModes::to_modes(const VectorField& field, int begin, int end) {
    const std::ptrdiff_t width = static_cast<std::ptrdiff_t>(blocks_) * pack_size, stride = field.u.stride();
    for (int block = 0; block < blocks_; ++block) {
        double* const target = modes_of(block, begin);
        multiply(end - begin, points_, pack_size, {field.u.row(begin), stride}, {u_to_modes_.data() + block * pack_size, width},
                 {target, 2 * pack_size});
        multiply(end - begin, points_, pack_size, {field.v.row(begin), stride}, {w_to_modes_.data() + block * pack_size, width},
                 {target + pack_size, 2 * pack_size});
    }
}

/// Takes what the walls' data load the nodes of their elements with to the right-hand side.
void ElementModes::apply_walls(const VectorField& field) {
    const std::ptrdiff_t width = static_cast<std::ptrdiff_t>(blocks_) * pack_size;
    for (const int wall : {0, 1})
        for (int block = 0; block < blocks_; ++block) {
            const int row = wall == 0 ? 0 : rows_;
            double* const data = wall_values_.data() + static_cast<std::ptrdiff_t>(wall * blocks_ + block) * 2 * pack_size;
            multiply(1, points_, pack_size, {field.u.row(row), 0}, {u_to_modes_.data() + block * pack_size, width}, {data, 0});
            multiply(1, points_, pack_size, {field.v.row(row), 0}, {w_to_modes_.data() + block * pack_size, width},
                     {data + pack_size, 0});
            const Pack u = load(data), w = load(data + pack_size);
            for (int l = 0; l < degree_; ++l) {
                const int node = wall == 0 ? l + 1 : rows_ - degree_ + l;
                if (node < 1 || node >= rows_)
                    continue; // the other wall
                const double* const k =
                    wall_couplings_.data() +
                    static_cast<std::ptrdiff_t>(((wall * blocks_ + block) * degree_ + l) * 4) * register_modes;
                double* const x = modes_of(block, node);
                store(load(x) - load_twice(k) * u - load_twice(k + register_modes) * w, x);
                store(load(x + pack_size) - load_twice(k + 2 * register_modes) * u - load_twice(k + 3 * register_modes) * w,
                      x + pack_size);
            }
        }
}

void ElementModes::substitute(int block) {
    double* const x = modes_of(block, 1);
    const double* const begin = factors_.data() + static_cast<std::size_t>(block) * entries_ * register_modes;
    const double* entry = begin;
    for (int row = 0; row < unknowns(); ++row) {
        // four sums, so that they need not wait for each other
        Pack sum[4] = {load(x + row * pack_size), Pack(0.0), Pack(0.0), Pack(0.0)};
        const int length = row - first(row);
        const double* known = x + static_cast<std::ptrdiff_t>(first(row)) * pack_size;
        int k = 0;
        for (; k + 4 <= length; k += 4)
            for (int s = 0; s < 4; ++s)
                sum[s] = sum[s] - load_twice(entry + (k + s) * register_modes) * load(known + (k + s) * pack_size);
        for (; k < length; ++k)
            sum[0] = sum[0] - load_twice(entry + k * register_modes) * load(known + k * pack_size);
        store((sum[0] + sum[1]) + (sum[2] + sum[3]), x + row * pack_size);
        entry += (length + 1) * register_modes;
    }
    const double* diagonal = begin;
    for (int row = 0; row < unknowns(); ++row) {
        diagonal += (row - first(row)) * register_modes;
        store(load_twice(diagonal) * load(x + row * pack_size), x + row * pack_size);
        diagonal += register_modes;
    }
    for (int row = unknowns() - 1; row >= 0; --row) {
        const int length = row - first(row);
        entry -= (length + 1) * register_modes;
        const Pack solved = load(x + row * pack_size);
        double* const waiting = x + static_cast<std::ptrdiff_t>(first(row)) * pack_size;
        for (int k = 0; k < length; ++k)
            store(load(waiting + k * pack_size) - load_twice(entry + k * register_modes) * solved, waiting + k * pack_size);
    }
}

/// Returns the sum of all values, which is finite only if they are.
double ElementModes::to_nodes(int begin, int end, VectorField& field) {
    const std::ptrdiff_t stride = field.u.stride();
    const auto product = [&](int block, int component, const aligned_vector<double>& matrix, Field& f) {
        const RowsOf<const double> a{modes_of(block, begin) + component * pack_size, 2 * pack_size},
            b{matrix.data() + static_cast<std::ptrdiff_t>(block) * pack_size * padded_, padded_};
        const RowsOf<double> c{f.row(begin), stride};
        if (block == 0)
            multiply(end - begin, pack_size, padded_, a, b, c);
        else
            multiply<true>(end - begin, pack_size, padded_, a, b, c);
    };
    for (int block = 0; block < blocks_; ++block) {
        product(block, 0, u_to_nodes_, field.u);
        product(block, 1, w_to_nodes_, field.v);
    }
    Pack sum(0.0);
    for (int j = begin; j < end; ++j) {
        for (int i = 0; i < points_; i += pack_size)
            sum = sum + load(field.u.row(j) + i) + load(field.v.row(j) + i);
        field.u.wrap_row(j);
        field.v.wrap_row(j);
    }
    return sum_of(sum);
}

void ElementModes::solve(VectorField& field, WallData walls) {
    const Rows inside{rows_ - 1, points_};
    const int shares = inside.shares();
    const auto for_each_share = [&](const auto& visit) {
        for_each_task(shares, [&](int share) {
            const auto [begin, end] = share_of_rows(rows_ - 1, share, shares);
            visit(share, begin + 1, end + 1);
        });
    };
    for_each_share([&](int, int begin, int end) { to_modes(field, begin, end); });
    if (walls == WallData::given)
        apply_walls(field);
    for_each_row(Rows{blocks_, unknowns() * pack_size}, [&](int block) { substitute(block); });
    checksums_.resize(static_cast<std::size_t>(shares));
    for_each_share(
        [&](int share, int begin, int end) { checksums_[static_cast<std::size_t>(share)] = to_nodes(begin, end, field); });
    for (const int j : {0, rows_})
        for (Field* f : {&field.u, &field.v}) {
            if (walls == WallData::zero)
                std::fill_n(f->row(j), points_, 0.0);
            f->wrap_row(j);
        }
    if (!std::ranges::all_of(checksums_, [](double sum) { return std::isfinite(sum); }))
        throw RunError("equilibrium: the solution is not finite because the nodal force or the wall data is not");
}

std::size_t ElementModes::memory_bytes() const {
    std::size_t numbers = 0;
    for (const auto* part :
         {&u_to_modes_, &w_to_modes_, &u_to_nodes_, &w_to_nodes_, &factors_, &wall_couplings_, &values_, &wall_values_})
        numbers += part->size();
    return numbers * sizeof(double);
}

} // namespace ductile
