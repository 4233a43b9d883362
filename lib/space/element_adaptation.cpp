// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/space/element_adaptation.hpp>
#include <ductile/space/small_products.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace ductile {

namespace {

constexpr double gain = 4.0;
constexpr double negligible = 1e-10; ///< of eta: what is below is round-off
constexpr double narrowest = 32.0;

struct Interval {
    double low = 0.0, high = 0.0;

    [[nodiscard]] double height() const { return high - low; }
};

std::size_t size(int number) { return static_cast<std::size_t>(number); }

Interval element(const ElementLine& line, int e) { return {line.edges[size(e)], line.edges[size(e) + 1]}; }

/// Places of [-1, 1] of one interval, in [-1, 1] of another.
std::vector<double> seen_from(const Interval& other, const Interval& own, std::span<const double> places) {
    std::vector<double> seen;
    for (const double place : places)
        seen.push_back(2.0 * (own.low + 0.5 * own.height() * (1.0 + place) - other.low) / other.height() - 1.0);
    return seen;
}

/// The share of the polynomial on `from` in the best one on `to`: the values at the Gauss points are
///   f_g = 1/W_g integral of l_g f d xi
/// over what both have in common, where p Gauss points integrate degree 2 p - 2 exactly. [p][p], or nothing.
std::vector<double> best_share(const Quadrature& gauss, const Interval& from, const Interval& to) {
    const Interval common{std::max(from.low, to.low), std::min(from.high, to.high)};
    if (!(common.height() > 0.0))
        return {};
    const std::size_t p = gauss.points.size();
    const std::vector<double> source = interpolation_matrix(gauss.points, seen_from(from, common, gauss.points));
    const std::vector<double> target = interpolation_matrix(gauss.points, seen_from(to, common, gauss.points));
    std::vector<double> share(p * p, 0.0);
    for (std::size_t g = 0; g < p; ++g)
        for (std::size_t k = 0; k < p; ++k) {
            const double weight = gauss.weights[k] * common.height() / to.height() / gauss.weights[g] * target[k * p + g];
            for (std::size_t l = 0; l < p; ++l)
                share[g * p + l] += weight * source[k * p + l];
        }
    return share;
}

/// Rows of `to` from `begin` on += matrix [rows][inner] times rows of `from` from `first` on.
void add_product(const std::vector<double>& matrix, int rows, int inner, const Field& from, int first, Field& to, int begin) {
    multiply<true>(rows, inner, to.padded_columns(), {matrix.data(), inner}, {from.row(first), from.stride()},
                   {to.row(begin), to.stride()});
}

/// An element as it might become.
struct Candidate {
    Interval at;
    int source = -1;                ///< the element that it is, or -1
    std::vector<Field> values = {}; ///< of p rows, in their units; of an element that is, once they are wanted
    double eta = 0.0;
};

class Exchange {
public:
    Exchange(const ElementLine& line, std::span<const ScaledField> fields)
        : line_(line), fields_(fields), height_(line.edges.back() - line.edges.front()) {
        for (int e = 0; e < line.elements(); ++e) {
            double square = 0.0;
            for (const auto& [field, unit] : fields)
                square += line.mean_square_of_tail(*field, e * line.degree) / (unit * unit);
            const Interval at = element(line, e);
            elements_.push_back({.at = at, .source = e, .eta = std::sqrt(square * at.height() / height_)});
        }
    }

    /// Until nothing is gained; whether anything was.
    bool run() {
        bool moved = false;
        while (exchange())
            moved = true;
        return moved;
    }

    [[nodiscard]] std::vector<double> edges() const {
        std::vector<double> edges{line_.edges.front()};
        for (const Candidate& here : elements_)
            edges.push_back(here.at.high);
        return edges;
    }

private:
    bool exchange() {
        const double limit = height_ / (narrowest * static_cast<double>(elements_.size()));
        std::size_t worst = elements_.size();
        for (std::size_t e = 0; e < elements_.size(); ++e)
            if (elements_[e].at.height() >= 2.0 * limit && (worst == elements_.size() || elements_[e].eta > elements_[worst].eta))
                worst = e;
        if (worst == elements_.size() || elements_[worst].eta < negligible)
            return false;
        const double allowed = elements_[worst].eta / gain;
        std::size_t pair = elements_.size();
        Candidate best{.at = {}, .eta = allowed};
        for (std::size_t e = 0; e + 1 < elements_.size(); ++e) {
            if (e == worst || e + 1 == worst || std::max(elements_[e].eta, elements_[e + 1].eta) >= best.eta)
                continue;
            if (Candidate joined = join(with_values(e), with_values(e + 1)); joined.eta < best.eta) {
                best = std::move(joined);
                pair = e;
            }
        }
        if (pair == elements_.size())
            return false;
        std::array halves{half(with_values(worst), 0), half(with_values(worst), 1)};
        const auto at = [&](std::size_t e) { return elements_.begin() + static_cast<std::ptrdiff_t>(e); };
        const auto replace_pair = [&] {
            *at(pair) = std::move(best);
            elements_.erase(at(pair + 1));
        };
        const auto replace_worst = [&] {
            *at(worst) = std::move(halves[0]);
            elements_.insert(at(worst + 1), std::move(halves[1]));
        };
        // the later one first, so that the place of the other stays
        if (pair > worst) {
            replace_pair();
            replace_worst();
        } else {
            replace_worst();
            replace_pair();
        }
        return true;
    }

    const Candidate& with_values(std::size_t e) {
        Candidate& here = elements_[e];
        for (std::size_t k = here.values.size(); k < fields_.size(); ++k) {
            const auto& [field, unit] = fields_[k];
            Field& values = here.values.emplace_back(line_.degree, field->columns());
            for (int l = 0; l < line_.degree; ++l)
                std::transform(field->row(here.source * line_.degree + l),
                               field->row(here.source * line_.degree + l) + field->columns(), values.row(l),
                               [by = unit](double value) { return value / by; });
        }
        return here;
    }

    [[nodiscard]] Candidate carried(std::span<const Candidate* const> from, const Interval& to) const {
        Candidate result{.at = to,
                         .values = std::vector<Field>(fields_.size(), Field(line_.degree, fields_[0].field->columns()))};
        for (const Candidate* part : from) {
            const std::vector<double> share = best_share(line_.gauss, part->at, to);
            for (std::size_t k = 0; k < fields_.size(); ++k)
                add_product(share, line_.degree, line_.degree, part->values[k], 0, result.values[k], 0);
        }
        return result;
    }

    [[nodiscard]] Candidate half(const Candidate& whole, int which) const {
        const double middle = 0.5 * (whole.at.low + whole.at.high);
        const std::array parts{&whole};
        Candidate result = carried(parts, which == 0 ? Interval{whole.at.low, middle} : Interval{middle, whole.at.high});
        result.eta = std::sqrt(tail(result));
        return result;
    }

    [[nodiscard]] Candidate join(const Candidate& lower, const Candidate& upper) const {
        const std::array parts{&lower, &upper};
        Candidate result = carried(parts, {lower.at.low, upper.at.high});
        double square = tail(result);
        for (const Candidate* part : parts) {
            const std::array whole{&std::as_const(result)};
            square += mean_square(carried(whole, part->at), *part);
        }
        result.eta = std::sqrt(square);
        return result;
    }

    /// h/H times the sum over fields of the mean square difference.
    [[nodiscard]] double mean_square(const Candidate& a, const Candidate& b) const {
        double sum = 0.0;
        for (std::size_t k = 0; k < fields_.size(); ++k)
            for (int g = 0; g < line_.degree; ++g)
                for (int i = 0; i < a.values[k].columns(); ++i) {
                    const double difference = a.values[k](i, g) - b.values[k](i, g);
                    sum += line_.gauss.weights[size(g)] * difference * difference;
                }
        return 0.5 * sum / a.values[0].columns() * a.at.height() / height_;
    }

    [[nodiscard]] double tail(const Candidate& here) const {
        double sum = 0.0;
        for (const Field& values : here.values)
            sum += line_.mean_square_of_tail(values, 0);
        return sum * here.at.height() / height_;
    }

    const ElementLine& line_;
    std::span<const ScaledField> fields_;
    double height_;
    std::vector<Candidate> elements_;
};

} // namespace

std::vector<double> adapted_edges(const ElementLine& line, std::span<const ScaledField> fields) {
    Exchange exchange(line, fields);
    return exchange.run() ? exchange.edges() : std::vector<double>{};
}

void carry_over(const ElementLine& from, const ElementLine& to, Field& field) {
    const int p = from.degree;
    const bool at_nodes = field.rows() == from.elements() * p + 1;
    Field result(field.rows(), field.columns(), field.ghost_rows());
    for (int e = 0; e < to.elements(); ++e) {
        const Interval here = element(to, e);
        if (at_nodes)
            for (int l = e == 0 ? 0 : 1; l <= p; ++l) {
                const double y = here.low + 0.5 * here.height() * (1.0 + to.nodes[size(l)]);
                const auto above = std::upper_bound(from.edges.begin() + 1, from.edges.end() - 1, y);
                const int source = static_cast<int>(above - from.edges.begin()) - 1;
                const double seen = seen_from(element(from, source), here, std::array{to.nodes[size(l)]}).front();
                add_product(interpolation_matrix(from.nodes, std::array{seen}), 1, p + 1, field, source * p, result, e * p + l);
            }
        else
            for (int source = 0; source < from.elements(); ++source)
                if (const std::vector<double> share = best_share(from.gauss, element(from, source), here); !share.empty())
                    add_product(share, p, p, field, source * p, result, e * p);
    }
    for (int j = 0; j < result.rows(); ++j)
        std::copy_n(result.row(j), result.columns(), field.row(j));
    field.wrap();
}

} // namespace ductile
