// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/linear/sparse_cholesky.hpp>

#include <algorithm>
#include <cholmod.h>
#include <fmt/format.h>

namespace ductile {

struct SparseCholesky::Implementation {
    cholmod_common common;
    cholmod_factor* factor = nullptr;
    cholmod_dense *solution = nullptr, *work = nullptr, *more_work = nullptr;

    explicit Implementation(Kind kind) {
        cholmod_start(&common);
        common.print = 0;
        common.supernodal = kind == Kind::supernodal ? CHOLMOD_SUPERNODAL : CHOLMOD_SIMPLICIAL;
        common.final_ll = kind == Kind::indefinite ? 0 : 1;
    }
    ~Implementation() {
        for (cholmod_dense** dense : {&solution, &work, &more_work})
            cholmod_free_dense(dense, &common);
        cholmod_free_factor(&factor, &common);
        cholmod_finish(&common);
    }
    Implementation(const Implementation&) = delete;
    Implementation& operator=(const Implementation&) = delete;

    void check_status(const char* action) const {
        if (common.status == CHOLMOD_OK)
            return;
        const char* reason = common.status == CHOLMOD_OUT_OF_MEMORY ? "out of memory"
                             : common.status == CHOLMOD_TOO_LARGE   ? "the problem is too large for 32-bit indices"
                             : common.status == CHOLMOD_NOT_POSDEF  ? "it is not positive definite, or singular"
                                                                    : "internal error";
        throw RunError(fmt::format("CHOLMOD cannot {} the stiffness: {} (status {})", action, reason, common.status));
    }
};

namespace {

cholmod_sparse view_of(const Eigen::SparseMatrix<double>& lower) {
    cholmod_sparse matrix{};
    matrix.nrow = static_cast<std::size_t>(lower.rows());
    matrix.ncol = static_cast<std::size_t>(lower.cols());
    matrix.nzmax = static_cast<std::size_t>(lower.nonZeros());
    // CHOLMOD's interface knows no const; it only reads.
    matrix.p = const_cast<int*>(lower.outerIndexPtr());
    matrix.i = const_cast<int*>(lower.innerIndexPtr());
    matrix.x = const_cast<double*>(lower.valuePtr());
    matrix.stype = -1;
    matrix.itype = CHOLMOD_INT;
    matrix.xtype = CHOLMOD_REAL;
    matrix.dtype = CHOLMOD_DOUBLE;
    matrix.sorted = 1;
    matrix.packed = 1;
    return matrix;
}

} // namespace

SparseCholesky::SparseCholesky(const Eigen::SparseMatrix<double>& lower, Kind kind)
    : implementation_(std::make_unique<Implementation>(kind)) {
    cholmod_sparse matrix = view_of(lower);
    implementation_->factor = cholmod_analyze(&matrix, &implementation_->common);
    implementation_->check_status("order");
    factorise(lower);
}

void SparseCholesky::factorise(const Eigen::SparseMatrix<double>& lower) {
    cholmod_sparse matrix = view_of(lower);
    cholmod_factorize(&matrix, implementation_->factor, &implementation_->common);
    implementation_->check_status("factorise");
}

SparseCholesky::~SparseCholesky() = default;

void SparseCholesky::solve(Eigen::VectorXd& x) {
    cholmod_dense right_hand_side{};
    right_hand_side.nrow = right_hand_side.nzmax = right_hand_side.d = static_cast<std::size_t>(x.size());
    right_hand_side.ncol = 1;
    right_hand_side.x = x.data();
    right_hand_side.xtype = CHOLMOD_REAL;
    right_hand_side.dtype = CHOLMOD_DOUBLE;
    Implementation& cholmod = *implementation_;
    cholmod_solve2(CHOLMOD_A, cholmod.factor, &right_hand_side, nullptr, &cholmod.solution, nullptr, &cholmod.work,
                   &cholmod.more_work, &cholmod.common);
    cholmod.check_status("solve with");
    std::copy_n(static_cast<const double*>(cholmod.solution->x), x.size(), x.data());
}

std::size_t SparseCholesky::memory_bytes() const { return implementation_->common.memory_inuse; }

} // namespace ductile
