#include <ductile/base/error.hpp>
#include <ductile/equilibrium/sparse_cholesky.hpp>
#include <ductile/mpm/preconditioner.hpp>

#include <vector>

namespace ductile::mpm {

struct Preconditioner::Work {
    Eigen::VectorXd whole, component;
};

Preconditioner::Preconditioner(PreconditionerKind kind) : kind_(kind), work_(std::make_unique<Work>()) {}
Preconditioner::~Preconditioner() = default;

void Preconditioner::update(const MomentumBalance& balance) {
    if (kind_ == PreconditionerKind::none)
        return;
    if (kind_ == PreconditionerKind::tangent && !stale_)
        return;
    const bool first = stale_;
    stale_ = false;
    const ActiveNodes& nodes = balance.nodes();
    const bool momentum = balance.scheme().form == Form::momentum;
    if (kind_ == PreconditionerKind::tangent && first) {
        try {
            factorise(balance);
            return;
        } catch (const RunError&) {
            tangent_.reset();
        }
    }
    inverse_diagonal_.resize(nodes.components());
    balance.discretisation().stiffness_diagonal(inverse_diagonal_);
    const bool inertia = balance.scheme().method != ImplicitMethod::quasi_static;
    for (std::size_t c = 0; c < inverse_diagonal_.size(); ++c) {
        const double mass = nodes.mass[c / 2];
        const double sum = (inertia ? mass : 0.0) + balance.stiffness_factor() * inverse_diagonal_[c];
        inverse_diagonal_[c] = sum > 0.0 ? (momentum ? mass : 1.0) / sum : 1.0;
    }
}

void Preconditioner::factorise(const MomentumBalance& balance) {
    const ActiveNodes& nodes = balance.nodes();
    const auto size = static_cast<int>(nodes.components());
    const bool inertia = balance.scheme().method != ImplicitMethod::quasi_static;
    using Entries = std::vector<Eigen::Triplet<double>>;
    const auto lower_triangle = [](const Entries& entries, int order) {
        Eigen::SparseMatrix<double> matrix(order, order);
        matrix.setFromTriplets(entries.begin(), entries.end());
        return matrix;
    };
    Entries entries;
    const double factor = balance.stiffness_factor();
    balance.discretisation().stiffness_entries([&](int row, int column, double value) {
        if (nodes.prescribed[row] || nodes.prescribed[column])
            return;
        // both triangles are given: their mean is the symmetric part
        const double share = row == column ? factor * value : 0.5 * factor * value;
        entries.emplace_back(std::max(row, column), std::min(row, column), share);
    });
    for (int c = 0; c < size; ++c)
        entries.emplace_back(c, c, nodes.prescribed[c] ? nodes.mass[c / 2] : inertia ? nodes.mass[c / 2] : 0.0);
    prescribed_ = nodes.prescribed;
    ++factorisations_;
    tangent_ = std::make_unique<SparseCholesky>(lower_triangle(entries, size));

    mass_.reset();
    if (balance.scheme().form == Form::momentum) {
        entries.clear();
        balance.discretisation().consistent_mass_entries(balance.particles(), [&](int row, int column, double value) {
            if (row >= column)
                entries.emplace_back(row, column, value);
        });
        node_mass_.assign(nodes.mass.begin(), nodes.mass.end());
        for (int n = 0; n < size / 2; ++n)
            entries.emplace_back(n, n, 0.01 * nodes.mass[n]);
        mass_ = std::make_unique<SparseCholesky>(lower_triangle(entries, size / 2));
    }
}

void Preconditioner::apply(std::span<double> z) {
    if (kind_ == PreconditionerKind::none)
        return;
    if (!tangent_) {
        for (std::size_t c = 0; c < z.size(); ++c)
            z[c] *= inverse_diagonal_[c];
        return;
    }
    Eigen::VectorXd &whole = work_->whole, &component = work_->component;
    whole = Eigen::Map<const Eigen::VectorXd>(z.data(), static_cast<Eigen::Index>(z.size()));
    tangent_->solve(whole);
    if (mass_) {
        const Eigen::Index count = whole.size() / 2;
        component.resize(count);
        for (Eigen::Index a = 0; a < 2; ++a) {
            for (Eigen::Index n = 0; n < count; ++n)
                component[n] = node_mass_[static_cast<std::size_t>(n)] * whole[2 * n + a];
            mass_->solve(component);
            for (Eigen::Index n = 0; n < count; ++n)
                whole[2 * n + a] = node_mass_[static_cast<std::size_t>(n)] * component[n];
        }
    }
    for (std::size_t c = 0; c < z.size(); ++c)
        z[c] = prescribed_[c] ? 0.0 : whole[static_cast<Eigen::Index>(c)]; // M_c couples free and prescribed nodes
}

} // namespace ductile::mpm
