// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: users of the library need not have Eigen.
#include <Eigen/SparseCore>

#include <cstddef>
#include <memory>

namespace ductile {

/// The factorisation of a symmetric matrix by CHOLMOD, with a fill-reducing ordering of its choice.
class SparseCholesky {
public:
    enum class Kind {
        supernodal, ///< L L^T in dense blocks: large positive definite matrices
        simplicial, ///< L L^T column by column: positive definite matrices of some ten thousand rows
        indefinite  ///< L D L^T column by column: also quasi-definite ones, (A, B; B^T, -C) with A and C positive definite
    };

    /// `lower` is the lower triangle, compressed. Throws RunError with CHOLMOD's reason when memory is short or the matrix is not
    /// positive definite (indefinite: has a pivot of zero).
    explicit SparseCholesky(const Eigen::SparseMatrix<double>& lower, Kind kind = Kind::supernodal);
    ~SparseCholesky();
    SparseCholesky(const SparseCholesky&) = delete;
    SparseCholesky& operator=(const SparseCholesky&) = delete;

    /// Factorises a matrix with the same entries but other values: the ordering is kept. Throws as the constructor; then it must
    /// succeed again before the next solve().
    void factorise(const Eigen::SparseMatrix<double>& lower);
    /// In place: the right-hand side becomes the solution. Throws RunError when CHOLMOD runs out of memory.
    void solve(Eigen::VectorXd& x);
    [[nodiscard]] std::size_t memory_bytes() const;

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

} // namespace ductile
