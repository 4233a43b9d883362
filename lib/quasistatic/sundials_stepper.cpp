#include <ductile/base/error.hpp>
#include <ductile/base/threads.hpp>
#include <ductile/io/interrupt.hpp>
#include <ductile/quasistatic/index_reduced.hpp>
#include <ductile/quasistatic/plastic_flow.hpp>
#include <ductile/quasistatic/projection.hpp>
#include <ductile/space/staggered.hpp>
#include <ductile/sundials/cvode.hpp>
#include <ductile/sundials/erk.hpp>
#include <ductile/sundials/ida.hpp>
#include <ductile/sundials/mri.hpp>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <span>

namespace ductile::quasistatic {

namespace {

/// SUNDIALS sees the cells as one vector without images, the n fields p, s, tau, q, internal variables one after another. They
/// are scaled such that the root mean square of all components is sqrt(1/n) times the norm (59) of (stress, internal/scale): with
/// an absolute tolerance A/sqrt(n) and no relative one, the error test of SUNDIALS bounds that norm by A.
class PackedCells {
public:
    explicit PackedCells(const Scene& scene)
        : columns_(static_cast<std::size_t>(scene.grid.cells_x)),
          rows_(scene.grid.cells_y), scale_{std::sqrt(3.0), std::sqrt(2.0), std::sqrt(2.0), std::sqrt(6.0)} {
        for (const InternalVariable& variable : scene.law->variables())
            scale_.push_back(1.0 / variable.natural_scale());
    }

    [[nodiscard]] std::size_t fields() const { return scale_.size(); }
    [[nodiscard]] std::size_t size() const { return fields() * columns_ * static_cast<std::size_t>(rows_); }

    void pack(const CellState& cells, std::span<double> values) const {
        visit(cells, values, [](const Field& field, int j, double scale, std::span<double> row) {
            std::transform(field.row(j), field.row(j) + row.size(), row.begin(), [=](double x) { return scale * x; });
        });
    }
    void unpack(std::span<const double> values, CellState& cells) const {
        visit(cells, values, [](Field& field, int j, double scale, std::span<const double> row) {
            std::ranges::transform(row, field.row(j), [=](double x) { return x / scale; });
            field.wrap_row(j);
        });
    }

private:
    template <class Cells, class Values, class Action> void visit(Cells& cells, Values values, const Action& action) const {
        const std::size_t field_size = columns_ * static_cast<std::size_t>(rows_);
        for_each_row({rows_, static_cast<int>(columns_)}, [&](int j) {
            for (std::size_t k = 0; k < fields(); ++k)
                action(cells.field(static_cast<int>(k)), j, scale_[k],
                       values.subspan(k * field_size + static_cast<std::size_t>(j) * columns_, columns_));
        });
    }

    std::size_t columns_;
    int rows_;
    std::vector<double> scale_;
};

sundials::ErkOptions erk_options(Scheme scheme, double tolerance, bool fixed) {
    sundials::ErkOptions options{.relative_tolerance = 0.0, .absolute_tolerance = tolerance};
    if (fixed) // longer than any step: one step an attempt
        options.fixed_step = std::numeric_limits<double>::max();
    switch (scheme) {
    case Scheme::arkode_2:
        options.table = sundials::paper_rk21();
        break;
    case Scheme::arkode_3:
        options.method = sundials::ErkMethod::bogacki_shampine;
        break;
    case Scheme::arkode_4:
        options.method = sundials::ErkMethod::zonneveld;
        break;
    default:
        options.method = sundials::ErkMethod::dormand_prince;
    }
    return options;
}

/// An attempt is a whole integration by SUNDIALS from t_n to its end: one step of ARKODE or MRIStep, or as many as the error
/// control of SUNDIALS wants. Nothing is carried over from one attempt to the next but the state, so a run restarts bitwise.
class SundialsStepper final : public IndexReducedStepper {
public:
    SundialsStepper(Scheme scheme, const Scene& scene, std::unique_ptr<EquilibriumSolver> solver, const PassOptions& passes,
                    const SundialsOptions& options, State state)
        : IndexReducedStepper(scene, std::move(solver), passes, std::move(state)), scheme_(scheme), packing_(scene),
          projection_(scene, this->solver()), stage_(scene), stage_rate_(scene), force_(scene.grid), values_(packing_.size()),
          tolerance_(options.fixed_steps ? 0.0 : options.tolerance) {
        const double tolerance = options.tolerance / std::sqrt(static_cast<double>(packing_.fields()));
        const auto f = [this](double t, std::span<const double> y, std::span<double> rate) { complete_rate(t, y, rate); };
        switch (scheme) {
        case Scheme::cvode_adams:
            cvode_.emplace(f, values_.size(),
                           sundials::CvodeOptions{.method = sundials::CvodeMethod::adams,
                                                  .solver = sundials::CvodeSolver::fixed_point,
                                                  .relative_tolerance = 0.0,
                                                  .absolute_tolerance = tolerance});
            break;
        case Scheme::cvode_bdf:
            cvode_.emplace(f, values_.size(),
                           sundials::CvodeOptions{.method = sundials::CvodeMethod::bdf,
                                                  .solver = sundials::CvodeSolver::krylov,
                                                  .projection = [this](double, std::span<const double> y,
                                                                       std::span<double> correction) { project(y, correction); },
                                                  .relative_tolerance = 0.0,
                                                  .absolute_tolerance = tolerance});
            break;
        case Scheme::ida:
            make_ida(tolerance);
            break;
        case Scheme::mri:
            make_mri(options.tolerance);
            break;
        default:
            erk_.emplace(f, values_.size(), erk_options(scheme, tolerance, options.fixed_steps));
        }
    }

    [[nodiscard]] Scheme scheme() const override { return scheme_; }

    [[nodiscard]] StepperCounts counts() const override {
        StepperCounts counts = IndexReducedStepper::counts();
        counts.elliptic_solves += projection_.solves() + preconditioner_solves_;
        counts.pointwise_substeps = substeps_.accepted;
        counts.rejected_substeps = substeps_.rejected;
        const sundials::Counts inner = erk_ ? erk_->counts() : cvode_ ? cvode_->counts() : ida_ ? ida_->counts() : mri_->counts();
        counts.inner_steps = inner.steps;
        counts.rejected_inner_steps = inner.rejected;
        return counts;
    }

private:
    CombinationNorm advance(double dt) override {
        length_ = dt;
        packing_.pack(start(), values_);
        if (erk_)
            erk_->integrate(values_, 0.0, dt);
        else if (cvode_)
            cvode_->integrate(values_, 0.0, dt);
        else if (ida_)
            integrate_ida(dt);
        else
            mri_->integrate(values_, 0.0, dt);
        packing_.unpack(std::span(values_).first(packing_.size()), next());
        if (mri_) // splitting leaves the constraint by its error
            put_into_equilibrium(next());
        evaluate(next(), 1.0, next_rate());
        close_rate(scene(), velocity(), next_rate());
        if (tolerance_ > 0.0)
            return {.stress = tolerance_};
        // the trapezoidal rule's, whatever the method: an upper bound of those of higher order
        return norm(scene(), std::array{Term{&next(), 1.0}, Term{&start(), -1.0}, Term{&start_rate(), -0.5 * dt},
                                        Term{&next_rate(), -0.5 * dt}});
    }

    [[nodiscard]] double relaxation_step(double) const override { return std::numeric_limits<double>::infinity(); }
    [[nodiscard]] double courant_number() const override { return std::numeric_limits<double>::infinity(); }
    /// Vectors that SUNDIALS keeps, about: of ERKStep its stages, of the others histories and bases.
    [[nodiscard]] int buffers() const override { return 24; }

    /// d(sigma, chi)/dt of the method of lines; not finite where its parts are not, so that SUNDIALS tries a shorter step.
    void complete_rate(double t, std::span<const double> y, std::span<double> rate) {
        if (t == 0.0) {
            packing_.pack(start_rate(), rate);
            return;
        }
        if (evaluate_stage(t, y))
            packing_.pack(stage_rate_, rate);
        else
            std::ranges::fill(rate, std::numeric_limits<double>::quiet_NaN());
    }

    /// Leaves the state y in stage_ and its complete rate in stage_rate_. Returns false where that is not finite.
    [[nodiscard]] bool evaluate_stage(double t, std::span<const double> y) {
        if (io::interrupted()) // an attempt may last: it is given up, and the run ends with the state before it
            throw RunError("interrupted");
        packing_.unpack(y, stage_);
        try {
            evaluate(stage_, t / length_, stage_rate_);
        } catch (const RunError&) {
            return false;
        }
        close_rate(scene(), velocity(), stage_rate_);
        return true;
    }

    void put_into_equilibrium(CellState& cells) {
        divergence(scene().grid, cells.stress, -1.0, force_);
        (void)projection_.apply(force_, {}, 1.0, cells);
    }

    /// The constraint projection of CVODE.
    void project(std::span<const double> y, std::span<double> correction) {
        packing_.unpack(y, stage_);
        put_into_equilibrium(stage_);
        packing_.pack(stage_, correction);
        std::ranges::transform(correction, y, correction.begin(), std::minus<>());
    }

    // --- multirate: slow is what the elliptic solve and transport contribute, fast the plastic flow

    void make_mri(double tolerance) {
        const Rk21Options pointwise{.absolute_tolerance = tolerance, .relative_tolerance = tolerance, .exact_components = 1};
        plastic_ = CellState(scene());
        mri_.emplace(sundials::MultirateSystem{
            .components = values_.size(),
            .slow =
                [this](double t, std::span<const double> y, std::span<double> rate) {
                    if (t == 0.0) {
                        packing_.unpack(y, stage_);
                        combine(scene(), std::array{Term{&start_rate(), 1.0}}, stage_rate_);
                    } else if (!evaluate_stage(t, y)) {
                        std::ranges::fill(rate, std::numeric_limits<double>::quiet_NaN());
                        return;
                    }
                    plastic_rate(scene(), stage_, plastic_);
                    combine(scene(), std::array{Term{&stage_rate_, 1.0}, Term{&plastic_, -1.0}}, stage_rate_);
                    packing_.pack(stage_rate_, rate);
                },
            .fast =
                [this](double, std::span<const double> y, std::span<double> rate) {
                    packing_.unpack(y, stage_);
                    plastic_rate(scene(), stage_, plastic_);
                    packing_.pack(plastic_, rate);
                },
            .advance_fast =
                [this, pointwise](double duration, std::span<const double> forcing, std::span<double> y) {
                    packing_.unpack(y, stage_);
                    packing_.unpack(forcing, stage_rate_);
                    const Rk21Counts counts = relax(scene(), stage_rate_, duration, pointwise, stage_);
                    substeps_.accepted += counts.accepted;
                    substeps_.rejected += counts.rejected;
                    if (counts.failed)
                        std::ranges::fill(y, std::numeric_limits<double>::quiet_NaN());
                    else
                        packing_.pack(stage_, y);
                }});
    }

    // --- index 1: y = (cells, interior velocity/U), 0 = d(cells)/dt - f - C : D(v), 0 = B^T (f + C : D(v)) = K v + B^T f

    void make_ida(double tolerance) {
        const Grid& grid = scene().grid;
        interior_ = static_cast<std::size_t>(grid.cells_x) * static_cast<std::size_t>(grid.cells_y - 1);
        values_.resize(packing_.size() + 2 * interior_);
        rates_.resize(values_.size());
        guess_ = VectorField(grid);
        ida_.emplace(sundials::DifferentialAlgebraicSystem{
                         .components = values_.size(),
                         .differential = packing_.size(),
                         .residual = [this](double t, std::span<const double> y, std::span<const double> rate,
                                            std::span<double> residual) { dae_residual(t, y, rate, residual); },
                         .precondition = [this](double factor, std::span<const double> r,
                                                std::span<double> z) { precondition(factor, r, z); }},
                     sundials::IdaOptions{.absolute_tolerance = tolerance});
    }

    void integrate_ida(double dt) {
        packing_.pack(start_rate(), rates_);
        std::fill(rates_.begin() + static_cast<std::ptrdiff_t>(packing_.size()), rates_.end(), 0.0);
        pack_interior(state().velocity, 1.0 / lines().speed_scale(), std::span(values_).subspan(packing_.size()));
        ida_->integrate(values_, rates_, 0.0, dt);
    }

    void pack_interior(const VectorField& field, double scale, std::span<double> values) {
        auto target = values.begin();
        for (const Field* f : {&field.u, &field.v})
            for (int j = 1; j < scene().grid.cells_y; ++j)
                target = std::transform(f->row(j), f->row(j) + scene().grid.cells_x, target, [=](double x) { return scale * x; });
    }
    void unpack_interior(std::span<const double> values, double scale, VectorField& field) {
        auto source = values.begin();
        for (Field* f : {&field.u, &field.v})
            for (int j = 1; j < scene().grid.cells_y; ++j, source += scene().grid.cells_x) {
                std::transform(source, source + scene().grid.cells_x, f->row(j), [=](double x) { return scale * x; });
                f->wrap_row(j);
            }
    }

    void dae_residual(double t, std::span<const double> y, std::span<const double> rate, std::span<double> residual) {
        if (io::interrupted())
            throw RunError("interrupted");
        const Grid& grid = scene().grid;
        packing_.unpack(y.first(packing_.size()), stage_);
        const WallVelocity wall = wall_velocity(t / length_);
        unpack_interior(y.subspan(packing_.size()), lines().speed_scale(), guess_);
        for (const auto& [row, sign] : {std::pair{0, -1.0}, std::pair{grid.cells_y, 1.0}}) {
            std::fill_n(guess_.u.row(row), grid.cells_x, sign * wall.u);
            std::fill_n(guess_.v.row(row), grid.cells_x, sign * wall.v);
            guess_.u.wrap_row(row);
            guess_.v.wrap_row(row);
        }
        lines().open_rate(stage_, guess_, stage_rate_);
        close_rate(scene(), guess_, stage_rate_);
        for (Field* f : {&stage_rate_.stress.p, &stage_rate_.stress.s, &stage_rate_.stress.tau, &stage_rate_.stress.q})
            for (int j = 0; j < grid.cells_y; ++j)
                f->wrap_row(j);
        divergence(grid, stage_rate_.stress, 1.0, force_);
        packing_.pack(stage_rate_, residual.first(packing_.size()));
        for (std::size_t i = 0; i < packing_.size(); ++i)
            residual[i] = rate[i] - residual[i];
        pack_interior(force_, 1.0 / lines().speed_scale(), residual.subspan(packing_.size()));
    }

    /// dF/dy without the derivatives of f: K dv = r_v, then derivative_factor d(cells) - C : D(dv) = r.
    void precondition(double derivative_factor, std::span<const double> r, std::span<double> z) {
        const Grid& grid = scene().grid;
        for (Field* f : {&force_.u, &force_.v})
            for (const int row : {0, grid.cells_y}) {
                std::fill_n(f->row(row), grid.cells_x, 0.0);
                f->wrap_row(row);
            }
        unpack_interior(r.subspan(packing_.size()), lines().speed_scale(), force_);
        solver().solve(force_, WallData::zero);
        ++preconditioner_solves_;
        for (Field* f : {&force_.u, &force_.v})
            for (int j = 0; j <= grid.cells_y; ++j)
                f->wrap_row(j);
        packing_.unpack(r.first(packing_.size()), stage_rate_);
        close_rate(scene(), force_, stage_rate_);
        packing_.pack(stage_rate_, z.first(packing_.size()));
        for (double& value : z.first(packing_.size()))
            value /= derivative_factor;
        pack_interior(force_, 1.0 / lines().speed_scale(), z.subspan(packing_.size()));
    }

    Scheme scheme_;
    PackedCells packing_;
    Projection projection_;
    CellState stage_, stage_rate_, plastic_;
    VectorField force_, guess_;
    std::vector<double> values_, rates_;
    std::optional<sundials::ErkIntegrator> erk_;
    std::optional<sundials::CvodeIntegrator> cvode_;
    std::optional<sundials::IdaIntegrator> ida_;
    std::optional<sundials::MriIntegrator> mri_;
    std::size_t interior_ = 0;
    Rk21Counts substeps_;
    long long preconditioner_solves_ = 0;
    double length_ = 0.0;    ///< of the attempted step
    double tolerance_ = 0.0; ///< of the error control of SUNDIALS; zero with fixed steps, which have none
};

} // namespace

std::unique_ptr<TimeStepper> make_sundials(Scheme scheme, const Scene& scene, std::unique_ptr<EquilibriumSolver> solver,
                                           const PassOptions& passes, const SundialsOptions& options, State state) {
    const bool multistep = scheme == Scheme::cvode_adams || scheme == Scheme::cvode_bdf || scheme == Scheme::ida;
    if (options.fixed_steps && multistep)
        throw InputError("--step fixed: CVODE and IDA choose their steps: use --step adaptive");
    if (!options.fixed_steps && scheme == Scheme::mri)
        throw InputError("--step adaptive: MRIStep has fixed steps only: use --step fixed and --dt");
    return std::make_unique<SundialsStepper>(scheme, scene, std::move(solver), passes, options, std::move(state));
}

} // namespace ductile::quasistatic
