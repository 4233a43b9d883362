// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/function_ref.hpp>
#include <ductile/ode/rk21.hpp>
#include <ductile/space/cells.hpp>
#include <ductile/space/equilibrium_solver.hpp>
#include <ductile/space/interpolation.hpp>
#include <ductile/space/transport.hpp>
#include <ductile/time/system.hpp>

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

/// A discretisation in space of the quasi-static equations as verbs: all loops over rows, cells and nodes are behind them, and
/// whoever integrates in time sees states, velocities and one call a sweep.
namespace ductile {

/// Which spaces there are.
enum class SpaceKind {
    staggered, ///< the grid of Lu & Rycroft, Sec. 2.1: second order, for fields that are rough from cell to cell
    elements,  ///< Fourier series in x and spectral elements in y: high order, for smooth fields
};

/// Of SpaceKind::elements. A row of cells is a row of stress points, `degree` of which make an element.
struct ElementOptions {
    int degree = 8;                 ///< of the velocity in y, 1 to 16; 1 differences in x as the staggered grid does
    std::vector<double> edges = {}; ///< where elements meet, y in units of the grid's; empty: elements of equal height
    bool adapt = false;             ///< the edges may move to where fields are fine
};

/// How a space discretises.
struct SpaceOptions {
    SpaceKind kind = SpaceKind::staggered;
    SolverKind solver = SolverKind::fastest; ///< staggered
    Stiffness stiffness = Stiffness::exact;  ///< staggered
    Advection advection = Advection::weno3;  ///< staggered
    ElementOptions elements = {};
};

/// What fills a space. All in natural units.
struct Medium {
    Law law;
    bool transported = true; ///< advection and Jaumann spin are kept, Eqs. (27), (28); otherwise (57), (58)
};

/// How the constitutive equations are advanced before the projection.
enum class Predictor {
    euler,       ///< forward Euler without C : D, Eq. (16)
    substepped,  ///< RK2(1) substeps without C : D: Eq. (16) with the plastic terms resolved (Sec. 4.3)
    incremental, ///< RK2(1) substeps with C : D(q), Eqs. (27), (28)
};

/// A rate that is not complete yet: `fields` hold f of the method of lines; the rate is f + C : D(velocity).
struct OpenRate {
    CellState* fields = nullptr;
    const VectorField* velocity = nullptr;
    double factor = 0.0;
    bool close = true; ///< write the complete rate back to `fields`
};

/// Norms (59) of a combination.
struct CombinationNorm {
    double stress = 0.0;   ///< Frobenius norm of the 3 x 3 stress, root mean square over the domain
    double internal = 0.0; ///< root mean square of an internal variable in units of its scale, the largest of all

    [[nodiscard]] double largest() const { return std::max(stress, internal); }
};

/// Scalars that describe a state, in natural units.
struct Observables {
    double wall_traction = 0.0;     ///< shear force on a wall per length: the mean of tau (every row has the same mean)
    double normal_traction = 0.0;   ///< mean sigma_yy
    double mean_magnitude = 0.0;    ///< mean of sbar
    double largest_magnitude = 0.0; ///< max of sbar
    std::vector<double> smallest_internal = {}, largest_internal = {}; ///< of each internal variable
    double plastic_fraction = 0.0;                                     ///< share of cells at or above yield
    double elastic_energy = 0.0; ///< of the whole domain: sum of (p^2/K + (s^2 + tau^2 + 3 q^2)/mu)/2 dA
};

/// What the finest scales of a space hold of tau and the internal variables, in units of the yield stress and of their scales:
/// the largest of all fields and rows (staggered) or elements, root mean squares there. Where fields are resolved it falls with
/// the error of the space; where it stays, they have structures that the space cannot show. On elements: the last quarter of the
/// waves in x; in y the last quarter of the Legendre coefficients, or the jumps at edges where they are larger. On the staggered
/// grid: a sixteenth of the fourth difference from cell to cell, beside walls a quarter of the second one; of a wave as short as
/// the grid allows either is the wave itself.
struct Unresolved {
    double x = 0.0, y = 0.0;
    double jump = 0.0;  ///< at edges of elements
    double whole = 0.0; ///< of rows or elements themselves

    /// Each the larger one.
    void take(const Unresolved& other) {
        x = std::max(x, other.x);
        y = std::max(y, other.y);
        jump = std::max(jump, other.jump);
        whole = std::max(whole, other.whole);
    }
};

/// Mean of tau and of sigma_yy over all cells: the traction on the walls, in equilibrium.
struct MeanTraction {
    double shear = 0.0, normal = 0.0;
};

/// What the motion of walls adds to a velocity, and how that differs from another one.
struct VelocityChange {
    double change = 0.0;       ///< largest difference of a component
    double courant_rate = 0.0; ///< largest |u|/dx + |v|/dy
};

/// The verbs. Stress and internal variables live at points, M of equal weight in each of N rows, velocity at M nodes in each of
/// the N + 1 rows between and around them; images are wrapped by whoever writes a field. The rates, combinations and norms are
/// what time::System asks for.
class Space {
public:
    using Term = time::Term<CellState>;

    Space(const Grid& grid, const Medium& medium, RowSpacing rows);
    virtual ~Space() = default;
    Space(const Space&) = delete;
    Space& operator=(const Space&) = delete;

    [[nodiscard]] const Grid& grid() const { return grid_; }
    [[nodiscard]] const Medium& medium() const { return medium_; }
    [[nodiscard]] const RowSpacing& rows() const { return rows_; }
    [[nodiscard]] CellState make_cells() const { return {grid_, medium_.law->variables().size()}; }
    [[nodiscard]] VectorField make_velocity() const { return VectorField(grid_); }

    // what depends on where velocity lives

    /// What transport wants to find beside the values of a state, and takes from `cells` alone: called before the first of the
    /// rates() of the same cells.
    virtual void prepare_transport(CellState& cells) const = 0;

    /// K v = force with v = 0 on the walls (or, WallData::given, what `force` has there), in place. Throws RunError when the
    /// solution is not finite.
    virtual void solve(VectorField& force, WallData walls) = 0;
    /// factor * B^T sigma inside, zero on the walls.
    virtual void divergence(const StressField& stress, double factor, VectorField& force) const = 0;
    /// Completes a rate in place: f += C : D(v).
    virtual void close(const VectorField& velocity, CellState& rate) const = 0;
    /// out = sum of terms + open.factor * (f + C : D(v)), at most nine terms; `out` may be one of them.
    virtual void combine(std::span<const Term> terms, const OpenRate& open, CellState& out) const = 0;
    /// stress += dt C : (D(phi) + D_w), D_w the gradient of walls that move; returns Q* of the first part, which vanishes on the
    /// walls: Q*^2 = 1/|Omega| integral of (sbar^2/mu^2 + p^2/(K mu)) dA.
    virtual double correct(const VectorField& phi, const Velocity& wall, double dt, StressField& stress) = 0;
    /// Of both walls, the upper one moving so, on what is between them: sum sigma : D(v) dA for every v with these walls, if
    /// B^T sigma = 0 inside.
    [[nodiscard]] virtual double wall_power(const StressField& stress, const Velocity& upper) const = 0;
    /// The velocity at the points, where stress lives, without images.
    virtual void at_points(const VectorField& velocity, Field& u, Field& v) const = 0;
    /// rates = -(v . grad) fields, which live at points, too, of order 1 and with room for two ghost rows; images of the rates
    /// are not wrapped. What prepare_transport() has found is lost.
    virtual void advect(std::span<Field> fields, const VectorField& velocity, std::span<Field> rates) const = 0;
    /// Where values live.
    enum class At { cells, nodes };
    /// To places between and beyond them; x and y in units of the mean width and height of cells, from the lower left corner on.
    [[nodiscard]] virtual Interpolation interpolation(At at, const std::vector<double>& x,
                                                      const std::vector<double>& y) const = 0;
    [[nodiscard]] virtual std::size_t memory_bytes() const = 0; ///< factors, plans and work space

    // rows that may move

    /// Edges of elements that may move, walls included, from 0 on; none where nothing may.
    [[nodiscard]] virtual std::vector<double> movable_edges() const { return {}; }
    /// As many that would show `cells` better; none where there is little to gain, or nothing may move.
    [[nodiscard]] virtual std::vector<double> better_edges(const CellState& cells) const {
        (void)cells;
        return {};
    }
    /// Moves the edges, and carries fields over: those at points, of N rows, as the best polynomials in the mean square, whose
    /// integrals stay; those at nodes, of N + 1, by the old polynomials. The stress is then out of equilibrium by about what the
    /// space does not show. Throws InputError where edges may not move, or these are impossible.
    virtual void move_edges(const std::vector<double>& edges, std::span<Field* const> fields);

    // what happens node by node

    /// max |B^T sigma| inside, divided by (largest |sigma| component times the longer side of a cell): the relative residual of
    /// discrete equilibrium. `force` is room to work in.
    [[nodiscard]] double equilibrium_residual(const StressField& stress, VectorField& force) const;
    /// velocity(y) += change * 2 y/height: two walls whose velocities change by `change` (upper) and -`change` (lower).
    void add_affine(const Velocity& change, VectorField& velocity) const;
    /// The same, and compares with `guess`.
    VelocityChange add_affine_and_compare(const Velocity& wall, const VectorField& guess, VectorField& velocity) const;
    /// The velocity inside, without images, scaled: 2 M (N - 1) numbers.
    [[nodiscard]] std::size_t interior_size() const;
    void pack_interior(const VectorField& velocity, double factor, std::span<double> values) const;
    /// Leaves the walls as they are.
    void unpack_interior(std::span<const double> values, double factor, VectorField& velocity) const;
    void set_walls(const Velocity& upper, VectorField& velocity) const;

    // what happens point by point

    /// f of the method of lines in `rate`, f = spin - advection - C : D^pl, dchi/dt, with all powers but that of the walls, and
    /// in `force` -B^T f. `cells` are prepared if transported. Returns the largest relaxation rate 2 mu
    /// dD^pl/dsbar.
    double rates(const CellState& cells, const VectorField& velocity, CellState& rate, VectorField& force);

    /// rate = [spin - advection](cells, velocity) alone, nothing of what has passed. Prepares `cells`; `room` is room to work in.
    /// Nothing where the model leaves both out.
    void transport(CellState& cells, const VectorField& velocity, CellState& rate, VectorField& room);

    /// The predictor of one global step: from the state at t_n computes, for every cell,
    ///   sigma* = integral of  [spin - advection](sigma_n, v_n) + [incremental: C : D(v_n)] - 2 mu D^pl sigma_0/sbar,
    ///   chi*   = integral of  -advection(chi_n, v_n) + F(sigma, chi),
    /// bracketed terms constant over the step, at t_n in the paper. The Jaumann spin, Eq. (5), with (grad v)_ij = dv_i/dx_j reads
    ///   ds/dt += (du/dy - dv/dx) tau,  dtau/dt -= (du/dy - dv/dx) s;  p and q do not turn.
    /// Cells whose stress stays below yield at both ends of the step (sbar is convex along the straight elastic path) are updated
    /// in closed form. In the same sweep, while the rows are in cache, `force` receives -B^T sigma*/dt.
    ///
    /// Spin and advection are those of the cells `transported`: `now` itself for terms frozen at t_n, or fields extrapolated to
    /// the middle of the step, together with such a velocity. Not changed, but prepared.
    /// `next` gets sigma* and chi*, and what has passed but for the work of the walls: dissipation with the stress in the middle
    /// between sigma_n and sigma*, transport with that of the cells `transported`. Returns the substeps of plastic cells; a cell
    /// that stays elastic takes none.
    Rk21Counts predict(Predictor predictor, const CellState& now, CellState& transported, const VectorField& velocity, double dt,
                       const Rk21Options& options, CellState& next, VectorField& force);

    /// rate = (-C : D^pl, dchi/dt), Eqs. (20), (21), and its dissipation; nothing else.
    void plastic_rate(const CellState& cells, CellState& rate);
    /// The equivalent one, sqrt(2/3 D^pl : D^pl), which makes with the stress of von Mises the plastic power, without images.
    void plastic_strain_rate(const CellState& cells, Field& rate) const;
    /// Takes `cells` over `duration` by (sources + plastic rate) with constant sources, every cell that flows in its own RK2(1)
    /// substeps. The memory of `sources` is used up.
    Rk21Counts relax(CellState& sources, double duration, const Rk21Options& options, CellState& cells);

    /// out = sum of terms, at most ten; `out` may be one of them.
    void combine(std::span<const Term> terms, CellState& out) const;
    [[nodiscard]] CombinationNorm norm(std::span<const Term> terms);
    /// Largest sbar/(yield stress) over all cells of the state cells + dt rate.
    [[nodiscard]] double yield_ratio(const CellState& cells, double dt, const CellState& rate) const;
    [[nodiscard]] MeanTraction mean_traction(const StressField& stress);
    [[nodiscard]] Observables observe(const CellState& cells) const;
    [[nodiscard]] Unresolved unresolved(const CellState& cells) const;
    /// That of the plastic strain rate, of the largest there is in a row or element (`whole`), or of `negligible` where that is
    /// more: flow hangs on the fields exponentially, and a band shows in it before it shows in them. `rate` is room.
    [[nodiscard]] Unresolved unresolved_flow(const CellState& cells, double negligible, Field& rate) const;

    /// Cells as one vector without images, field after field, scaled such that the root mean square of all components is
    /// sqrt(1/n) times norm() of the state, n the number of fields, if internal variables are counted together: with an absolute
    /// tolerance A/sqrt(n) and no relative one, the error test of SUNDIALS bounds that norm by A.
    [[nodiscard]] std::size_t packed_size() const;
    void pack(const CellState& cells, std::span<double> values) const;
    void unpack(std::span<const double> values, CellState& cells) const;

protected:
    /// What becomes of row j of the sources, where advection does the work `transport` a unit of time and of cell area.
    using RowKernel = FunctionRef<void(int j, double transport)>;
    /// In one pass: row after row of `sources` receives [elastic: C : D(v)] + [transported: spin - advection by v] of `cells`,
    /// `kernel` makes of it what it wants, and `force`, unless the factor is 0, factor * B^T of the stress that comes out.
    virtual void sweep(const CellState& cells, const VectorField& velocity, bool elastic, CellState& sources, RowKernel kernel,
                       double factor, VectorField& force) = 0;
    /// The same of one field.
    [[nodiscard]] virtual Unresolved unresolved(const Field& field) const = 0;
    /// Room for a number of each row, so that sums do not depend on the number of threads.
    [[nodiscard]] std::vector<double>& row_sums() { return row_sums_; }
    /// The root of the mean of a square over the domain, whose sums over the cells of a row are there.
    [[nodiscard]] double root_mean_of_row_sums() const;
    /// As many as before.
    void set_rows(RowSpacing rows) { rows_ = std::move(rows); }
    /// C : D of the affine field of walls, the upper of which moves so.
    [[nodiscard]] StressComponents<double> wall_rate(const Velocity& upper) const;

private:
    Grid grid_;
    Medium medium_;
    RowSpacing rows_;
    std::vector<double> scale_; ///< of the fields in a packed state
    /// A unit of cell area.
    struct RowPowers {
        double dissipation = 0.0, transport = 0.0;
    };
    /// Of all rows, one after the other, so that the sum does not depend on the number of threads.
    [[nodiscard]] EnergyFlow sum_of_powers() const;
    /// 2 y/height of node row j.
    [[nodiscard]] double from_middle(int j) const {
        return (2.0 * rows_.node[static_cast<std::size_t>(j)] - grid_.cells_y) / grid_.cells_y;
    }

    std::vector<double> row_sums_;
    std::vector<RowPowers> row_powers_;
    std::vector<Rk21Counts> row_counts_;
};

/// With its elliptic solver. Throws InputError for an impossible grid, medium or choice.
[[nodiscard]] std::unique_ptr<Space> make_staggered_space(const Grid& grid, const Medium& medium, const SpaceOptions& options);
[[nodiscard]] std::unique_ptr<Space> make_element_space(const Grid& grid, const Medium& medium, const ElementOptions& options);

} // namespace ductile
