// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/linear/sparse_cholesky.hpp>
#include <ductile/mpm/preconditioner.hpp>
#include <ductile/mpm/stencil_matrix.hpp>

#include <vector>

namespace ductile::mpm {

/// The factorised Jacobian. The order of elimination is kept from step to step as long as the same nodes are active and
/// prescribed.
class Preconditioner::Tangent {
public:
    /// Throws RunError where the velocity form's matrix is not positive definite.
    void factorise(const MomentumBalance& balance) {
        const ActiveNodes& nodes = balance.nodes();
        const bool momentum = balance.scheme().form == Form::momentum;
        const bool same_entries =
            factor_ && momentum == momentum_ && lattice_ == nodes.lattice && prescribed_ == nodes.prescribed;
        momentum_ = momentum;
        lattice_ = nodes.lattice;
        prescribed_ = nodes.prescribed;
        mass_ = nodes.mass;

        const Discretisation& discretisation = balance.discretisation();
        StencilMatrix stiffness(nodes, discretisation.reach(), 2);
        discretisation.stiffness_blocks([&](auto of, auto matrix) { stiffness.add(of, matrix); });
        const Eigen::Index size = static_cast<Eigen::Index>(nodes.components()) * (momentum_ ? 2 : 1);
        lower_.resize(size, size);
        lower_.reserve(entries_);
        if (momentum_) {
            StencilMatrix consistent_mass(nodes, discretisation.reach(), 1);
            discretisation.consistent_mass_blocks(balance.particles(),
                                                  [&](auto of, auto matrix) { consistent_mass.add(of, matrix); });
            assemble_momentum_form(stiffness, consistent_mass, balance.stiffness_factor());
        } else {
            const bool inertia = balance.scheme().method != ImplicitMethod::quasi_static;
            assemble_velocity_form(stiffness, balance.stiffness_factor(), inertia);
        }
        lower_.finalize();
        entries_ = lower_.nonZeros();
        if (same_entries)
            return factor_->factorise(lower_);
        factor_.reset();
        factor_ = std::make_unique<SparseCholesky>(lower_, momentum_ ? SparseCholesky::Kind::indefinite
                                                                     : SparseCholesky::Kind::simplicial);
    }

    void apply(std::span<double> z) {
        const Eigen::Index stride = momentum_ ? 4 : 2, answer = momentum_ ? 2 : 0;
        x_.setZero(lower_.rows());
        for (std::size_t c = 0; c < z.size(); ++c)
            x_[static_cast<Eigen::Index>(c / 2) * stride + static_cast<Eigen::Index>(c % 2)] = z[c];
        factor_->solve(x_);
        for (std::size_t c = 0; c < z.size(); ++c) {
            const double x = x_[static_cast<Eigen::Index>(c / 2) * stride + static_cast<Eigen::Index>(c % 2) + answer];
            z[c] = prescribed_[c] ? 0.0 : momentum_ ? mass_[c / 2] * x : x;
        }
    }

private:
    void begin_column(Eigen::Index column) { lower_.startVec(column); }
    void entry(Eigen::Index row, Eigen::Index column, double value) { lower_.insertBack(row, column) = value; }

    /// Rows and columns are components of nodes; those of prescribed ones hold the mass on the diagonal only.
    void assemble_velocity_form(const StencilMatrix& stiffness, double factor, bool inertia) {
        for (std::size_t l = 0; l < mass_.size(); ++l)
            for (std::size_t a = 0; a < 2; ++a) {
                const std::size_t column = 2 * l + a;
                begin_column(static_cast<Eigen::Index>(column));
                stiffness.for_each_below(static_cast<std::int32_t>(l), [&](std::int32_t k, std::span<const double> block) {
                    for (std::size_t b = 0; b < 2; ++b) {
                        const std::size_t row = 2 * static_cast<std::size_t>(k) + b;
                        const bool diagonal = row == column;
                        if (row < column || (!diagonal && (prescribed_[row] || prescribed_[column])))
                            continue;
                        const double value =
                            prescribed_[row] ? mass_[l] : factor * block[2 * b + a] + (diagonal && inertia ? mass_[l] : 0.0);
                        entry(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column), value);
                    }
                });
            }
    }

    /// Four rows a node: w_x, w_y, z_x, z_y.
    void assemble_momentum_form(const StencilMatrix& stiffness, const StencilMatrix& consistent_mass, double factor) {
        constexpr double shift = 1e-10; // of M, on both diagonals: each may be singular by itself
        for (std::size_t l = 0; l < mass_.size(); ++l) {
            const auto node = static_cast<std::int32_t>(l);
            const auto first = static_cast<Eigen::Index>(4 * l);
            for (std::size_t a = 0; a < 2; ++a) { // columns w
                const bool held = prescribed_[2 * l + a];
                const Eigen::Index column = first + static_cast<Eigen::Index>(a);
                begin_column(column);
                stiffness.for_each_below(node, [&](std::int32_t k, std::span<const double> block) {
                    for (std::size_t b = k == node ? a : 0; b < 2; ++b) {
                        const Eigen::Index row = 4 * static_cast<Eigen::Index>(k) + static_cast<Eigen::Index>(b);
                        if (row == column)
                            entry(row, column, held ? mass_[l] : factor * block[2 * b + a] + shift * mass_[l]);
                        else if (!held && !prescribed_[2 * static_cast<std::size_t>(k) + b])
                            entry(row, column, factor * block[2 * b + a]);
                    }
                    if (k == node && !held)
                        entry(column + 2, column, mass_[l]);
                });
            }
            for (std::size_t a = 0; a < 2; ++a) { // columns z
                const bool held = prescribed_[2 * l + a];
                const Eigen::Index column = first + 2 + static_cast<Eigen::Index>(a);
                begin_column(column);
                consistent_mass.for_each_below(node, [&](std::int32_t k, std::span<const double> block) {
                    const Eigen::Index row = 4 * static_cast<Eigen::Index>(k) + 2 + static_cast<Eigen::Index>(a);
                    if (k == node)
                        entry(row, column, held ? -mass_[l] : -block[0] - shift * mass_[l]);
                    else if (!held && !prescribed_[2 * static_cast<std::size_t>(k) + a])
                        entry(row, column, -block[0]);
                });
            }
        }
    }

    bool momentum_ = false;
    std::vector<std::int32_t> lattice_;
    std::vector<char> prescribed_;
    aligned_vector<double> mass_;
    Eigen::SparseMatrix<double> lower_;
    Eigen::Index entries_ = 0; // of the last matrix: about as many will come
    std::unique_ptr<SparseCholesky> factor_;
    Eigen::VectorXd x_;
};

Preconditioner::Preconditioner(PreconditionerKind kind) : kind_(kind), tangent_(std::make_unique<Tangent>()) {}
Preconditioner::~Preconditioner() = default;

void Preconditioner::update(const MomentumBalance& balance) {
    if (kind_ == PreconditionerKind::none)
        return;
    if (kind_ == PreconditionerKind::tangent && stale_)
        try {
            tangent_->factorise(balance);
            factorised_ = true;
        } catch (const RunError&) {
            factorised_ = false;
        }
    stale_ = false;
    if (!factorised_)
        take_diagonal(balance);
}

void Preconditioner::take_diagonal(const MomentumBalance& balance) {
    const ActiveNodes& nodes = balance.nodes();
    const bool momentum = balance.scheme().form == Form::momentum;
    const bool inertia = balance.scheme().method != ImplicitMethod::quasi_static;
    inverse_diagonal_.resize(nodes.components());
    balance.discretisation().stiffness_diagonal(inverse_diagonal_);
    for (std::size_t c = 0; c < inverse_diagonal_.size(); ++c) {
        const double mass = nodes.mass[c / 2];
        const double sum = (inertia ? mass : 0.0) + balance.stiffness_factor() * inverse_diagonal_[c];
        inverse_diagonal_[c] = sum > 0.0 ? (momentum ? mass : 1.0) / sum : 1.0;
    }
}

void Preconditioner::apply(std::span<double> z) {
    if (kind_ == PreconditionerKind::none)
        return;
    if (factorised_)
        return tangent_->apply(z);
    for (std::size_t c = 0; c < z.size(); ++c)
        z[c] *= inverse_diagonal_[c];
}

} // namespace ductile::mpm
