// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/space/element_adaptation.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
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

/// rows of `to` += matrix times rows of `from`, both [p][columns].
void add_product(const std::vector<double>& matrix, std::size_t p, std::size_t columns, const double* from, double* to) {
    for (std::size_t g = 0; g < p; ++g)
        for (std::size_t l = 0; l < p; ++l)
            for (std::size_t i = 0; i < columns; ++i)
                to[g * columns + i] += matrix[g * p + l] * from[l * columns + i];
}

/// An element as it might become.
struct Candidate {
    Interval at;
    std::vector<double> values = {}; ///< [fields][p][columns], in their units
    double eta = 0.0;
};

class Exchange {
public:
    Exchange(const ElementLine& line, std::span<const ScaledField> fields)
        : line_(line), p_(size(line.degree)), columns_(size(fields.front().field->columns())), count_(fields.size()),
          height_(line.edges.back() - line.edges.front()) {
        for (int e = 0; e < line.elements(); ++e) {
            Candidate here{.at = element(line, e)};
            here.values.reserve(count_ * p_ * columns_);
            for (const auto& [field, unit] : fields)
                for (int l = 0; l < line.degree; ++l)
                    std::transform(field->row(e * line.degree + l), field->row(e * line.degree + l) + columns_,
                                   std::back_inserter(here.values), [by = unit](double value) { return value / by; });
            here.eta = std::sqrt(tail(here));
            elements_.push_back(std::move(here));
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
            if (Candidate joined = join(elements_[e], elements_[e + 1]); joined.eta < best.eta) {
                best = std::move(joined);
                pair = e;
            }
        }
        if (pair == elements_.size())
            return false;
        std::array halves{half(elements_[worst], 0), half(elements_[worst], 1)};
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

    [[nodiscard]] Candidate carried(std::span<const Candidate* const> from, const Interval& to) const {
        Candidate result{.at = to, .values = std::vector<double>(count_ * p_ * columns_, 0.0)};
        for (const Candidate* part : from) {
            const std::vector<double> share = best_share(line_.gauss, part->at, to);
            for (std::size_t k = 0; k < count_; ++k)
                add_product(share, p_, columns_, part->values.data() + k * p_ * columns_,
                            result.values.data() + k * p_ * columns_);
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
        for (std::size_t at = 0; at < a.values.size(); ++at) {
            const double difference = a.values[at] - b.values[at];
            sum += line_.gauss.weights[at / columns_ % p_] * difference * difference;
        }
        return 0.5 * sum / static_cast<double>(columns_) * a.at.height() / height_;
    }

    [[nodiscard]] double tail(const Candidate& here) const {
        const std::size_t first = p_ - std::max<std::size_t>(1, p_ / 4);
        std::vector<double> coefficient(columns_);
        double sum = 0.0;
        for (std::size_t k = 0; k < count_; ++k)
            for (std::size_t l = first; l < p_; ++l) {
                std::ranges::fill(coefficient, 0.0);
                for (std::size_t g = 0; g < p_; ++g)
                    for (std::size_t i = 0; i < columns_; ++i)
                        coefficient[i] += line_.legendre[l * p_ + g] * here.values[(k * p_ + g) * columns_ + i];
                for (const double c : coefficient)
                    sum += c * c;
            }
        return 0.5 * sum / static_cast<double>(columns_) * here.at.height() / height_;
    }

    const ElementLine& line_;
    std::size_t p_, columns_, count_;
    double height_;
    std::vector<Candidate> elements_;
};

/// Row after row, from rows of the old element that begins with row `first`.
void add_rows(const std::vector<double>& matrix, int inner, const Field& from, int first, Field& to, int begin, int rows) {
    for (int r = 0; r < rows; ++r)
        for (int l = 0; l < inner; ++l) {
            const double weight = matrix[size(r * inner + l)];
            const double* const source = from.row(first + l);
            double* const target = to.row(begin + r);
            for (int i = 0; i < to.columns(); ++i)
                target[i] += weight * source[i];
        }
}

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
                add_rows(interpolation_matrix(from.nodes, std::array{seen}), p + 1, field, source * p, result, e * p + l, 1);
            }
        else
            for (int source = 0; source < from.elements(); ++source)
                if (const std::vector<double> share = best_share(from.gauss, element(from, source), here); !share.empty())
                    add_rows(share, p, field, source * p, result, e * p, p);
    }
    for (int j = 0; j < result.rows(); ++j)
        std::copy_n(result.row(j), result.columns(), field.row(j));
    field.wrap();
}

} // namespace ductile
