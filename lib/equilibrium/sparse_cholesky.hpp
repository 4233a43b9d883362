#pragma once
// Private: users of the library need not have Eigen.
#include <Eigen/SparseCore>

#include <cstddef>
#include <memory>

namespace ductile {

/// The factorisation of a symmetric positive definite matrix by CHOLMOD (supernodal L L^T, fill-reducing ordering of its choice).
class SparseCholesky {
public:
    /// `lower` is the lower triangle, compressed. Throws RunError with CHOLMOD's reason when memory is short or the matrix is not
    /// positive definite.
    explicit SparseCholesky(const Eigen::SparseMatrix<double>& lower);
    ~SparseCholesky();
    SparseCholesky(const SparseCholesky&) = delete;
    SparseCholesky& operator=(const SparseCholesky&) = delete;

    /// In place: the right-hand side becomes the solution. Throws RunError when CHOLMOD runs out of memory.
    void solve(Eigen::VectorXd& x);
    [[nodiscard]] std::size_t memory_bytes() const;

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

} // namespace ductile
