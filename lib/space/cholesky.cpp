// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/linear/sparse_cholesky.hpp>
#include <ductile/space/cholesky.hpp>
#include <ductile/space/free_motions.hpp>

#include <algorithm>
#include <fmt/format.h>
#include <optional>
#include <vector>

namespace ductile {

struct CholeskyEquilibrium::Implementation {
    NodeNumbering nodes;
    FreeMotions motions;
    std::vector<int> kept;                       ///< equation of each free degree of freedom, -1 if pinned
    Eigen::SparseMatrix<double> from_prescribed; ///< forces on the free degrees of freedom by the prescribed ones
    std::optional<SparseCholesky> factor;        ///< none when every degree of freedom is prescribed or pinned
    Eigen::VectorXd free, prescribed, equations;

    explicit Implementation(const BoundaryValueProblem& problem);
    void solve(VectorField& field);
};

CholeskyEquilibrium::Implementation::Implementation(const BoundaryValueProblem& problem) : nodes(problem.grid, problem.boundary) {
    const Grid& grid = problem.grid;
    const CellStiffness stiffness = cell_stiffness(grid, problem.elasticity, problem.stiffness);
    motions = find_free_motions(grid, nodes, stiffness);

    kept.assign(static_cast<std::size_t>(nodes.free_count()), 0);
    for (const Eigen::Index pin : motions.pins)
        kept[static_cast<std::size_t>(pin)] = -1;
    int count = 0;
    for (int& equation : kept)
        if (equation == 0)
            equation = count++;

    std::vector<Eigen::Triplet<double>> lower, coupling;
    lower.reserve(36 * static_cast<std::size_t>(grid.cells_x) * static_cast<std::size_t>(grid.cells_y));
    for (int j = 0; j < grid.cells_y; ++j)
        for (int i = 0; i < grid.cells_x; ++i) {
            const std::array<int, 8> cell = nodes.of_cell(i, j);
            for (std::size_t r = 0; r < 8; ++r)
                for (std::size_t c = 0; c < 8; ++c) {
                    if (cell[r] < 0)
                        continue;
                    if (cell[c] < 0) {
                        coupling.emplace_back(cell[r], -1 - cell[c], stiffness[r][c]);
                        continue;
                    }
                    const int row = kept[static_cast<std::size_t>(cell[r])], column = kept[static_cast<std::size_t>(cell[c])];
                    if (column >= 0 && row >= column)
                        lower.emplace_back(row, column, stiffness[r][c]);
                }
        }
    from_prescribed.resize(nodes.free_count(), nodes.prescribed_count());
    from_prescribed.setFromTriplets(coupling.begin(), coupling.end());
    free.resize(nodes.free_count());
    prescribed.resize(nodes.prescribed_count());
    equations.resize(count);
    if (count > 0) {
        Eigen::SparseMatrix<double> matrix(count, count);
        matrix.setFromTriplets(lower.begin(), lower.end());
        factor.emplace(matrix);
    }
}

void CholeskyEquilibrium::Implementation::solve(VectorField& field) {
    const auto for_each_value = [&](const auto& visit) {
        for (int j = 0; j < nodes.rows(); ++j)
            for (int i = 0; i < nodes.columns(); ++i) {
                visit(nodes.index(i, j, 0), field.u(i, j));
                visit(nodes.index(i, j, 1), field.v(i, j));
            }
    };
    for_each_value([&](int n, double value) { (n >= 0 ? free[n] : prescribed[-1 - n]) = value; });
    free -= from_prescribed * prescribed;

    const Eigen::VectorXd unbalanced = motions.modes * (motions.modes.transpose() * free);
    const double load = free.norm();
    if (unbalanced.norm() > 1e-8 * load)
        throw InputError(
            fmt::format("equilibrium: the load drives the {}, which no side holds ({:.1e} of its norm is unbalanced); "
                        "balance the forces or prescribe a side",
                        motions.name(unbalanced), unbalanced.norm() / load));
    free -= unbalanced;

    for (std::size_t n = 0; n < kept.size(); ++n)
        if (kept[n] >= 0)
            equations[kept[n]] = free[static_cast<Eigen::Index>(n)];
    if (factor)
        factor->solve(equations);
    for (std::size_t n = 0; n < kept.size(); ++n)
        free[static_cast<Eigen::Index>(n)] = kept[n] >= 0 ? equations[kept[n]] : 0.0;
    free -= motions.modes * (motions.modes.transpose() * free);

    if (!free.allFinite())
        throw RunError("equilibrium: the solution is not finite because the nodal force or the boundary data is not");
    for_each_value([&](int n, double& value) { value = n >= 0 ? free[n] : value; });
    for (int j = 0; j < nodes.rows(); ++j) {
        field.u.wrap_row(j);
        field.v.wrap_row(j);
    }
}

CholeskyEquilibrium::CholeskyEquilibrium(const BoundaryValueProblem& problem) {
    check(problem.grid);
    check(problem.elasticity);
    check(problem.boundary);
    implementation_ = std::make_unique<Implementation>(problem);
}

CholeskyEquilibrium::~CholeskyEquilibrium() = default;

int CholeskyEquilibrium::node_rows() const { return implementation_->nodes.rows(); }
int CholeskyEquilibrium::node_columns() const { return implementation_->nodes.columns(); }
int CholeskyEquilibrium::free_motions() const { return static_cast<int>(implementation_->motions.modes.cols()); }

void CholeskyEquilibrium::solve(VectorField& field) {
    for (const Field* f : {&field.u, &field.v})
        if (f->rows() != node_rows() || f->columns() != node_columns())
            throw InputError(
                fmt::format("equilibrium: a field of {} rows and {} columns was given, the problem has {} rows and {} "
                            "columns of nodes",
                            f->rows(), f->columns(), node_rows(), node_columns()));
    implementation_->solve(field);
}

std::size_t CholeskyEquilibrium::memory_bytes() const {
    const Implementation& it = *implementation_;
    const auto dense =
        it.free.size() + it.prescribed.size() + it.equations.size() + it.motions.modes.size() + it.motions.named.size();
    return (it.factor ? it.factor->memory_bytes() : 0) + static_cast<std::size_t>(dense) * sizeof(double) +
           static_cast<std::size_t>(it.from_prescribed.nonZeros()) * (sizeof(double) + sizeof(int));
}

namespace {

class CholeskySolver final : public EquilibriumSolver {
public:
    explicit CholeskySolver(const EquilibriumProblem& problem)
        : equilibrium_({.grid = problem.grid,
                        .elasticity = problem.elasticity,
                        .boundary = {.left = {Condition::periodic, Condition::periodic},
                                     .right = {Condition::periodic, Condition::periodic},
                                     .bottom = {Condition::prescribed, Condition::prescribed},
                                     .top = {Condition::prescribed, Condition::prescribed}},
                        .stiffness = problem.stiffness}) {}

    void solve(VectorField& field, WallData walls) override {
        if (walls == WallData::zero)
            for (Field* f : {&field.u, &field.v})
                for (const int j : {0, f->rows() - 1})
                    std::fill_n(f->row(j), f->columns(), 0.0);
        equilibrium_.solve(field);
    }
    [[nodiscard]] std::string_view name() const override { return "cholesky"; }
    [[nodiscard]] std::size_t memory_bytes() const override { return equilibrium_.memory_bytes(); }

private:
    CholeskyEquilibrium equilibrium_;
};

} // namespace

std::unique_ptr<EquilibriumSolver> make_cholesky_solver(const EquilibriumProblem& problem) {
    return std::make_unique<CholeskySolver>(problem);
}

} // namespace ductile
