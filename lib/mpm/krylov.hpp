// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/aligned.hpp>
#include <ductile/base/function_ref.hpp>

#include <span>
#include <vector>

namespace ductile::mpm {

/// result = A x
using LinearMap = FunctionRef<void(std::span<const double> x, std::span<double> result)>;
/// z becomes P^-1 z
using InPlaceMap = FunctionRef<void(std::span<double> z)>;

struct LinearResult {
    bool converged = false;
    int iterations = 0;
};

/// The two Krylov methods of the paper for A s = b with s = 0 at first; buffers are kept from call to call.
class Krylov {
public:
    /// Conjugate gradients, Algorithm 2 (Algorithm 3 with p_1 = r_0: as printed it normalises p_1 but not alpha); preconditioned
    /// if `precondition` is not empty. Ends when |b - A s| <= tolerance |b|, or where p.Ap is not positive: then the matrix is
    /// not positive definite, and s is the best so far (b itself if there is none).
    LinearResult conjugate_gradients(const LinearMap& a, const InPlaceMap& precondition, std::span<const double> b,
                                     std::span<double> s, double tolerance, int largest_iterations);

    /// GMRES with modified Gram-Schmidt and Givens rotations, Algorithm 4 (with h(i, k) for the printed h(k, i)), preconditioned
    /// from the right. One cycle of at most `vectors` iterations: the paper restricts its basis so and leaves the rest to Newton.
    LinearResult gmres(const LinearMap& a, const InPlaceMap& precondition, std::span<const double> b, std::span<double> s,
                       double tolerance, int vectors);

private:
    using Vector = aligned_vector<double>;
    Vector r_, z_, p_, w_;
    std::vector<Vector> basis_;
    std::vector<double> hessenberg_, rotation_, rhs_;
};

[[nodiscard]] double dot(std::span<const double> a, std::span<const double> b);
[[nodiscard]] double norm(std::span<const double> a);

} // namespace ductile::mpm
