// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/base/threads.hpp>
#include <ductile/base/vectorise.hpp>
#include <ductile/space/fourier.hpp>
#include <ductile/space/modes.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fftw3.h>
#include <fmt/format.h>
#include <mutex>

namespace ductile {
namespace {

/// The planner of FFTW is not thread-safe.
std::mutex planner;

/// Four doubles: compilers cut or join them to the vectors of the target. Loaded and stored by reference, because the ABI of
/// vectors as arguments depends on the instruction set.
using Lanes = double __attribute__((vector_size(16)));
constexpr int lanes = 2;
inline void load_lanes(Lanes& x, const double* from) { std::memcpy(&x, from, sizeof x); }
inline void store_lanes(const Lanes& x, double* to) { std::memcpy(to, &x, sizeof x); }

/// u and i v of the modes from W: W_k + conj(W_{-k}) and W_k - conj(W_{-k}). Here and below W holds M + 1 complex numbers, the
/// last a copy of the first. Compilers do not vectorise the reversed access to W_{-k}: hence the shuffles.
void split(const double* w, int cells, SpectralRow row) {
    const int modes = cells / 2 + 1;
    int k = 0;
    for (; k + lanes <= modes; k += lanes) {
        const double *plus = w + 2 * k, *minus = w + 2 * (cells - k - lanes + 1);
        Lanes plus0, plus1, minus0, minus1;
        load_lanes(plus0, plus);
        load_lanes(plus1, plus + lanes);
        load_lanes(minus0, minus);
        load_lanes(minus1, minus + lanes);
        const Lanes plus_re = __builtin_shufflevector(plus0, plus1, 0, 2);
        const Lanes plus_im = __builtin_shufflevector(plus0, plus1, 1, 3);
        const Lanes minus_re = __builtin_shufflevector(minus0, minus1, 2, 0);
        const Lanes minus_im = __builtin_shufflevector(minus0, minus1, 3, 1);
        store_lanes(plus_re + minus_re, row.u_re + k);
        store_lanes(plus_im - minus_im, row.u_im + k);
        store_lanes(plus_re - minus_re, row.v_re + k);
        store_lanes(plus_im + minus_im, row.v_im + k);
    }
    for (; k < modes; ++k) {
        const double *plus = w + 2 * k, *minus = w + 2 * (cells - k);
        row.u_re[k] = plus[0] + minus[0];
        row.u_im[k] = plus[1] - minus[1];
        row.v_re[k] = plus[0] - minus[0];
        row.v_im[k] = plus[1] + minus[1];
    }
}

/// W from u and i v: W_k = u + i v, W_{-k} = conj(u - i v).
void join(SpectralRow row, int cells, double* w) {
    const int modes = cells / 2 + 1;
    int k = 0;
    for (; k + lanes <= modes; k += lanes) {
        Lanes u_re, u_im, v_re, v_im;
        load_lanes(u_re, row.u_re + k);
        load_lanes(u_im, row.u_im + k);
        load_lanes(v_re, row.v_re + k);
        load_lanes(v_im, row.v_im + k);
        const Lanes plus_re = u_re + v_re, plus_im = u_im + v_im, minus_re = u_re - v_re, minus_im = v_im - u_im;
        double *plus = w + 2 * k, *minus = w + 2 * (cells - k - lanes + 1);
        store_lanes(__builtin_shufflevector(minus_re, minus_im, 1, 3), minus);
        store_lanes(__builtin_shufflevector(minus_re, minus_im, 0, 2), minus + lanes);
        store_lanes(__builtin_shufflevector(plus_re, plus_im, 0, 2), plus);
        store_lanes(__builtin_shufflevector(plus_re, plus_im, 1, 3), plus + lanes);
    }
    for (; k < modes; ++k) {
        double *plus = w + 2 * k, *minus = w + 2 * (cells - k);
        minus[0] = row.u_re[k] - row.v_re[k];
        minus[1] = row.v_im[k] - row.u_im[k];
        plus[0] = row.u_re[k] + row.v_re[k];
        plus[1] = row.u_im[k] + row.v_im[k];
    }
}

struct PlanDeleter {
    void operator()(fftw_plan plan) const {
        const std::lock_guard lock(planner);
        fftw_destroy_plan(plan);
    }
};
using Plan = std::unique_ptr<std::remove_pointer_t<fftw_plan>, PlanDeleter>;

/// Work space of one thread: u + i v at the nodes of a row, and its transform W.
struct Scratch {
    double *nodes, *modes;
};

class FourierSolver final : public EquilibriumSolver {
public:
    explicit FourierSolver(const EquilibriumProblem& problem)
        : cells_x_(problem.grid.cells_x), cells_y_(problem.grid.cells_y), middle_(cells_y_ / 2),
          systems_(problem.grid, problem.elasticity, problem.stiffness),
          outside_(static_cast<std::size_t>(16 * systems_.padded_modes())) {
        // Measured plans save 0.2 to 0.8 ns a cell and solve (M = 360: 1.9), a few per cent of a step. But timing would choose
        // them, and a restarted run could then round differently.
        const Scratch s = scratch();
        auto* const nodes = reinterpret_cast<fftw_complex*>(s.nodes);
        auto* const modes = reinterpret_cast<fftw_complex*>(s.modes);
        {
            const std::lock_guard lock(planner);
            to_modes_.reset(fftw_plan_dft_1d(cells_x_, nodes, modes, FFTW_FORWARD, FFTW_ESTIMATE));
            to_nodes_.reset(fftw_plan_dft_1d(cells_x_, modes, nodes, FFTW_BACKWARD, FFTW_ESTIMATE));
        }
        if (!to_modes_ || !to_nodes_)
            throw RunError(fmt::format("FFTW cannot plan a complex transform of length {}", cells_x_));
    }

    void solve(VectorField& field, WallData walls) override {
        check_shape(field);
        set_walls(field, walls);
        const int team = Rows{cells_y_, cells_x_}.threads();
        const double checksum = team <= 2 ? sweep_fused(field, team) : sweep_in_turns(field, team);
        if (!std::isfinite(checksum))
            throw RunError("equilibrium: the solution is not finite because the nodal force or the wall data is not");
    }

    [[nodiscard]] std::string_view name() const override { return "fourier"; }
    [[nodiscard]] std::size_t memory_bytes() const override {
        const std::size_t scratch = static_cast<std::size_t>(thread_count()) * scratch_size();
        return systems_.memory_bytes() + (outside_.size() + scratch) * sizeof(double);
    }

private:
    /// The rows one elimination goes through, from its wall to the neighbour of the middle row.
    struct Half {
        int wall, inwards, rows;    ///< row of the wall, +1 or -1, number of rows
        SpectralRow data, solution; ///< Dirichlet data of the wall and solution of the middle row, both as this half sees them

        [[nodiscard]] int row(int step) const { return wall + inwards * step; }
    };
    [[nodiscard]] Half half(int h) {
        if (h == 0)
            return {.wall = 0, .inwards = 1, .rows = middle_ - 1, .data = outside(0), .solution = outside(2)};
        return {.wall = cells_y_, .inwards = -1, .rows = cells_y_ - 1 - middle_, .data = outside(1), .solution = outside(3)};
    }

    /// The four spectral rows that have no place in the field: walls, middle row, mirrored middle row.
    [[nodiscard]] SpectralRow outside(int which) {
        const int n = systems_.padded_modes();
        double* const start = outside_.data() + 4 * which * n;
        return {start, start + n, start + 2 * n, start + 3 * n};
    }
    /// Coefficients live in the place of their node row, halo included, which has room for them whatever M is.
    [[nodiscard]] SpectralRow coefficients(VectorField& field, int j) {
        if (j == middle_)
            return outside(2);
        double* const u = field.u.row(j) - row_unit;
        double* const v = field.v.row(j) - row_unit;
        return {u, u + systems_.padded_modes(), v, v + systems_.padded_modes()};
    }
    /// The upper half is solved as the mirror image of the lower: with -v.
    [[nodiscard]] double sign_of_v(int j) const { return j > middle_ ? -1.0 : 1.0; }

    /// One thread or two: each half in one go, rows stay in cache between transform and sweep. Returns a sum over the solution.
    double sweep_fused(VectorField& field, int team) {
        const int blocks = systems_.blocks();
        for_each_half(team, 0, [&](int h) {
            for (int step = 1; step <= half(h).rows; ++step) {
                forward(field, half(h).row(step), coefficients(field, half(h).row(step)));
                eliminate(field, half(h), step, 0, blocks);
            }
        });
        forward(field, middle_, coefficients(field, middle_));
        meet(field, 0, blocks);
        double checksum[2] = {};
        const double middle = backward(field, middle_);
        for_each_half(team, 1, [&](int h) {
            double sum = 0.0;
            for (int step = half(h).rows; step >= 1; --step) {
                substitute(field, half(h), step, 0, blocks);
                // The row just solved is still needed as the neighbour of the next one.
                if (step < half(h).rows)
                    sum += backward(field, half(h).row(step + 1));
                if (step == 1)
                    sum += backward(field, half(h).row(step));
            }
            checksum[h] = sum;
        });
        return middle + checksum[0] + checksum[1];
    }

    /// Two threads keep to the same half; one begins with that which it has seen last.
    static void for_each_half(int team, int first_if_alone, const auto& visit) {
        if (team == 1)
            for (const int h : {first_if_alone, 1 - first_if_alone})
                visit(h);
        else
            for_each_task(2, visit);
    }

    /// More threads: rows are shared out for the transforms, halves and blocks of modes for the sweeps.
    double sweep_in_turns(VectorField& field, int team) {
        const int shares = (team + 1) / 2;
        const auto blocks = [&](int share) { return share_of_rows(systems_.blocks(), share, shares); };
        const Rows inside{cells_y_ - 1, cells_x_};
        for_each_row(inside, [&](int j) { forward(field, j + 1, coefficients(field, j + 1)); });
        for_each_task(2 * shares, [&](int task) {
            const Half h = half(task / shares);
            const auto [begin, end] = blocks(task % shares);
            for (int step = 1; step <= h.rows; ++step)
                eliminate(field, h, step, begin, end);
        });
        for_each_task(shares, [&](int share) { meet(field, blocks(share).begin, blocks(share).end); });
        for_each_task(2 * shares, [&](int task) {
            const Half h = half(task / shares);
            const auto [begin, end] = blocks(task % shares);
            for (int step = h.rows; step >= 1; --step)
                substitute(field, h, step, begin, end);
        });
        return gather_rows(
            inside, 0.0, [&](int j, double& sum) { sum += backward(field, j + 1); },
            [](double& total, double part) { total += part; });
    }

    /// `row` = 2 M times the coefficients of node row j.
    void forward(const VectorField& field, int j, SpectralRow row) {
        const Scratch s = scratch();
        const double *u = field.u.row(j), *v = field.v.row(j), sign = sign_of_v(j);
        for (int i = 0; i < cells_x_; ++i) {
            s.nodes[2 * i] = u[i];
            s.nodes[2 * i + 1] = sign * v[i];
        }
        fftw_execute_dft(to_modes_.get(), reinterpret_cast<fftw_complex*>(s.nodes), reinterpret_cast<fftw_complex*>(s.modes));
        std::copy_n(s.modes, 2, s.modes + 2 * cells_x_);
        split(s.modes, cells_x_, row);
    }

    void eliminate(VectorField& field, const Half& half, int step, int begin, int end) {
        const SpectralRow previous = step == 1 ? half.data : coefficients(field, half.row(step - 1));
        systems_.eliminate(coefficients(field, half.row(step)), previous, step, begin, end);
    }

    void meet(VectorField& field, int begin, int end) {
        systems_.meet(outside(2), coefficients(field, middle_ - 1), coefficients(field, middle_ + 1), outside(3), begin, end);
    }

    void substitute(VectorField& field, const Half& half, int step, int begin, int end) {
        const SpectralRow next = step == half.rows ? half.solution : coefficients(field, half.row(step + 1));
        systems_.substitute(coefficients(field, half.row(step)), next, step, begin, end);
    }

    /// Node row j from its coefficients, images wrapped. Returns the sum of its values, which is finite only if they are.
    double backward(VectorField& field, int j) {
        const Scratch s = scratch();
        join(coefficients(field, j), cells_x_, s.modes);
        fftw_execute_dft(to_nodes_.get(), reinterpret_cast<fftw_complex*>(s.modes), reinterpret_cast<fftw_complex*>(s.nodes));
        double *u = field.u.row(j), *v = field.v.row(j), sum = 0.0;
        const double sign = sign_of_v(j);
        DUCTILE_VECTORISE_SUM
        for (int i = 0; i < cells_x_; ++i) {
            u[i] = s.nodes[2 * i];
            v[i] = sign * s.nodes[2 * i + 1];
            sum += u[i] + v[i];
        }
        wrap(field, j);
        return sum;
    }

    /// Coefficients went into the halo too: what wrap_row() leaves alone there is zero again.
    static void wrap(VectorField& field, int j) {
        for (Field* f : {&field.u, &field.v}) {
            std::fill_n(f->row(j) - row_unit, row_unit, 0.0);
            std::fill_n(f->row(j) + f->padded_columns(), row_unit, 0.0);
            f->wrap_row(j);
        }
    }

    void set_walls(VectorField& field, WallData walls) {
        for (int h : {0, 1}) {
            const int j = half(h).wall, n = 4 * systems_.padded_modes();
            double* const data = half(h).data.u_re;
            if (walls == WallData::given) {
                forward(field, j, half(h).data);
                std::transform(data, data + n, data, [this](double w) { return w / (2.0 * cells_x_); });
            } else {
                std::fill_n(data, n, 0.0);
                std::fill_n(field.u.row(j), cells_x_, 0.0);
                std::fill_n(field.v.row(j), cells_x_, 0.0);
            }
            wrap(field, j);
        }
    }

    void check_shape(const VectorField& field) const {
        for (const Field* f : {&field.u, &field.v})
            if (f->rows() != cells_y_ + 1 || f->columns() != cells_x_)
                throw InputError(
                    fmt::format("equilibrium: a field of {} rows and {} columns was given, a grid of {} x {} cells has "
                                "{} rows and {} columns of nodes",
                                f->rows(), f->columns(), cells_x_, cells_y_, cells_y_ + 1, cells_x_));
    }

    /// W needs one number more than the nodes, see split().
    [[nodiscard]] std::size_t scratch_size() const {
        return static_cast<std::size_t>(round_up_to_row_unit(2 * cells_x_) + round_up_to_row_unit(2 * cells_x_ + 2));
    }
    /// That of the calling thread, shared by all solvers.
    [[nodiscard]] Scratch scratch() const {
        thread_local aligned_vector<double> numbers;
        if (numbers.size() < scratch_size())
            numbers.resize(scratch_size());
        return {numbers.data(), numbers.data() + round_up_to_row_unit(2 * cells_x_)};
    }

    int cells_x_, cells_y_;
    int middle_; ///< the row where both eliminations meet
    ModeSystems systems_;
    aligned_vector<double> outside_;
    Plan to_modes_, to_nodes_;
};

} // namespace

std::unique_ptr<EquilibriumSolver> make_fourier_solver(const EquilibriumProblem& problem) {
    check(problem.grid);
    check(problem.elasticity);
    return std::make_unique<FourierSolver>(problem);
}

} // namespace ductile
