// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/aligned.hpp>
#include <ductile/mpm/momentum_balance.hpp>

#include <memory>
#include <span>

namespace ductile::mpm {

enum class PreconditionerKind {
    none,
    diagonal, ///< the diagonal of the Jacobian, about
    tangent   ///< the factorised Jacobian of the step's first Newton iteration
};

/// Approximations of J^-1 with c = mu kappa dt and the stiffness dt K.
///
/// Velocity form: J = A = M + c dt K (quasi-static: without M), or its diagonal. Where A cannot be factorised (softening makes it
/// indefinite) its diagonal takes its place.
/// Momentum form: J = I + c dt K S with S = M^-1 M_c M^-1, which may be singular. The diagonal one takes S for M^-1: M/diag(A).
/// The tangent one solves J u = b with w = S u and z = M^-1 u as the symmetric quasi-definite system
///   c dt K w + M z = b,   M w - M_c z = 0.
/// Prescribed components stay out. The tangent is symmetrised where the flow is not associated.
class Preconditioner {
public:
    explicit Preconditioner(PreconditionerKind kind);
    ~Preconditioner();

    [[nodiscard]] PreconditionerKind kind() const { return kind_; }
    /// A new step: factorisations of the last one are of no more use.
    void begin_step() { stale_ = true; }
    /// To be called after balance.linearise().
    void update(const MomentumBalance& balance);
    /// z becomes P^-1 z.
    void apply(std::span<double> z);

private:
    class Tangent;
    void take_diagonal(const MomentumBalance& balance);

    PreconditionerKind kind_;
    bool stale_ = true;
    bool factorised_ = false; // otherwise the diagonal is in use
    aligned_vector<double> inverse_diagonal_;
    std::unique_ptr<Tangent> tangent_;
};

} // namespace ductile::mpm
