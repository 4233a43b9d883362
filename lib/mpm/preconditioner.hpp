#pragma once
#include <ductile/base/aligned.hpp>
#include <ductile/mpm/momentum_balance.hpp>

#include <memory>
#include <span>
#include <vector>

namespace ductile {
class SparseCholesky;
}

namespace ductile::mpm {

enum class PreconditionerKind {
    none,
    diagonal, ///< of M + mu kappa dt^2 K
    tangent   ///< the factorised M + mu kappa dt^2 K of the step's first Newton iteration
};

/// Approximations of J^-1. Velocity form: A^-1 with A = M + mu kappa dt^2 K, or its diagonal (quasi-static: without M). Momentum
/// form: J = I + mu kappa dt^2 K S with S = M^-1 M_c M^-1, and J^-1 = S^-1 (S^-1 + mu kappa dt^2 K)^-1; the diagonal one takes S
/// for M^-1, i.e. M/diag(A), and the tangent one M M_c^-1 M A^-1 with M_c + 0.01 M for M_c, which may be singular.
/// Prescribed components stay out. The tangent is symmetrised where the flow is not associated.
class Preconditioner {
public:
    explicit Preconditioner(PreconditionerKind kind);
    ~Preconditioner();

    [[nodiscard]] PreconditionerKind kind() const { return kind_; }
    /// A new step: factorisations of the last one are of no more use.
    void begin_step() { stale_ = true; }
    /// To be called after balance.linearise(). Where the tangent is not positive definite (softening) its diagonal is used.
    void update(const MomentumBalance& balance);
    /// z becomes P^-1 z.
    void apply(std::span<double> z);

    [[nodiscard]] long long factorisations() const { return factorisations_; }

private:
    void factorise(const MomentumBalance& balance);

    PreconditionerKind kind_;
    bool stale_ = true;
    long long factorisations_ = 0;
    aligned_vector<double> inverse_diagonal_;
    std::unique_ptr<SparseCholesky> tangent_, mass_;
    std::vector<double> node_mass_;
    std::vector<char> prescribed_;
    struct Work;
    std::unique_ptr<Work> work_;
};

} // namespace ductile::mpm
