// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: how particles and nodes see each other during one step.
#include <ductile/base/aligned.hpp>
#include <ductile/base/threads.hpp>
#include <ductile/mpm/active_nodes.hpp>
#include <ductile/mpm/body.hpp>
#include <ductile/mpm/particles.hpp>
#include <ductile/mpm/shape_functions.hpp>

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace ductile::mpm {

/// Shape functions at all particles, cached for one step: the particles do not move while it is in use.
///
/// Particles are visited in runs: neighbours in memory that see the same nodes and are of the same material. A kernel loads the
/// nodes of a run once and writes them back once. In sorted order a run is all particles of a cell; particles that have crossed a
/// cell edge cost a run more each, and prepare() sorts the particles again once these are many.
///
/// A node is active if its mass exceeds 1e-12 of the mean mass of a particle. Where a particle touches a node that is not, the
/// nearest active one of those it touches stands in for it, so that weights keep their sum 1 and gradients of a constant vanish.
/// With linear shape functions a particle on a cell edge (to 1e-12 of a cell) would lose half of its gradient so; it sees the
/// nodes of the neighbouring cell instead.
///
/// Bodies that do not share the nodes' velocity (Scene::field_of_body) see lattices of their own, one above the other: rows from
/// a multiple of nodes_y_ on are the nodes of the next field.
///
/// On a periodic grid columns of the lattice from cells_x on are images of the first ones: the same active nodes, by number_.
template <class Shape> class Transfer {
public:
    static constexpr int support = Shape::support;
    static constexpr int seen = support * support;

    struct Run {
        std::int32_t begin, end, material;
        std::int32_t first;      ///< lattice place of the first node
        std::int32_t node[seen]; ///< active numbers; row by row
    };

    explicit Transfer(const Grid& grid, std::span<const int> field_of_body = {});

    /// Caches weights and finds the active nodes, their masses, mapped velocities (2.2.14) and prescribed components. May sort
    /// the particles. Rigid bodies and sides that hold one component of a node share it if they prescribe the same velocity.
    /// Throws RunError for a particle that has left the grid (which, and where), for mass that no step can work with, and where
    /// rigid bodies and sides prescribe different velocities to one component of a node.
    void prepare(Particles& particles, std::span<const RigidBody> rigid_bodies, double time, double dt);

    [[nodiscard]] const ActiveNodes& nodes() const { return nodes_; }
    /// The active number of the k-th node seen from the lattice place `first`, or of the nearest that stands in for it; -1 if
    /// none can.
    [[nodiscard]] std::int32_t active_number(std::int32_t first, int k) const;
    [[nodiscard]] std::int32_t first_node(std::size_t p) const { return first_[p]; } ///< lattice place
    /// Calls `visit(runs)` for all stripes of runs, on several threads. Stripes are some rows of nodes high: what runs of one and
    /// of the next but one add to nodes does not meet, and a sum over runs has the same bits on any number of threads.
    void for_each_stripe(const auto& visit) const {
        const auto stripes = static_cast<int>(stripe_begin_.size()) - 1;
        const auto visit_stripe = [&](int s) __attribute__((noinline)) {
            const std::size_t first = stripe_begin_[static_cast<std::size_t>(s)];
            visit(std::span<const Run>(runs_).subspan(first, stripe_begin_[static_cast<std::size_t>(s) + 1] - first));
        };
        for (int colour = 0; colour < 2; ++colour) {
            if (worth_threads())
                for_each_task((stripes - colour + 1) / 2, [&](int k) { visit_stripe(colour + 2 * k); });
            else
                for (int s = colour; s < stripes; s += 2)
                    visit_stripe(s);
        }
    }
    void for_each_run(const auto& visit) const {
        for_each_stripe([&](std::span<const Run> runs) {
            for (const Run& run : runs)
                visit(run);
        });
    }
    [[nodiscard]] std::size_t run_count() const { return runs_.size(); }
    [[nodiscard]] std::size_t place_of(const Run& run) const { return static_cast<std::size_t>(&run - runs_.data()); }
    /// Calls `visit(first, last)` for consecutive ranges of particles, on several threads.
    void for_each_range(const auto& visit) const {
        constexpr std::size_t range = 2048;
        if (!worth_threads())
            return visit(std::size_t{0}, particles_);
        for_each_task(static_cast<int>((particles_ + range - 1) / range), [&](int k) {
            const std::size_t first = static_cast<std::size_t>(k) * range;
            visit(first, std::min(first + range, particles_));
        });
    }
    [[nodiscard]] const Grid& grid() const { return grid_; }
    /// Of a periodic grid every x is.
    [[nodiscard]] bool inside(double x, double y) const;
    /// x, or where it comes in again at the other one of two periodic sides.
    [[nodiscard]] double wrapped(double x) const;

    [[gnu::DUCTILE_ALWAYS_INLINE]] Factors<support> factors_x(std::size_t p) const {
        return Shape::expand(&weights_[2 * Shape::stored * p], inverse_dx_);
    }
    [[gnu::DUCTILE_ALWAYS_INLINE]] Factors<support> factors_y(std::size_t p) const {
        return Shape::expand(&weights_[2 * Shape::stored * p + Shape::stored], inverse_dy_);
    }
    /// Places of the nodes that a particle sees, of which the first is at this place of the lattice, from it [m].
    [[gnu::DUCTILE_ALWAYS_INLINE]] auto offsets_x(std::int32_t first, const Factors<support>& f) const {
        auto spacing = Shape::spacing(first % nodes_x_, line_x_);
        for (double& s : spacing)
            s *= grid_.dx();
        return offsets(f, spacing);
    }
    [[gnu::DUCTILE_ALWAYS_INLINE]] auto offsets_y(std::int32_t first, const Factors<support>& f) const {
        auto spacing = Shape::spacing(row_of(first), line_y_);
        for (double& s : spacing)
            s *= grid_.dy();
        return offsets(f, spacing);
    }
    [[nodiscard]] std::size_t memory_bytes() const;

private:
    static constexpr int stripe_rows = 4; // at least support - 1

    /// Of a lattice place, on the grid.
    [[nodiscard]] int row_of(int place) const { return place / nodes_x_ % nodes_y_; }
    [[nodiscard]] bool worth_threads() const { return threads_worth(static_cast<long long>(particles_)) > 1; }

    struct Place {
        std::int32_t cell_x, cell_y;
        double xi, eta;
    };

    [[nodiscard]] Place place_of(double x, double y) const; ///< of a point inside
    void settle(const Particles& particles, std::size_t p, const Place& place);
    void settle_all(const Particles& particles);
    void find_runs(const Particles& particles);
    void sort_by_stripes();
    [[nodiscard]] bool disordered();
    void sort(Particles& particles);
    void add_masses(const Particles& particles);
    void unite_images();
    [[nodiscard]] bool leave_massless_nodes(const Particles& particles);
    void number_nodes();
    void number_runs(const Particles& particles);
    void map_velocities(const Particles& particles);
    void add_affine(const Particles& particles);
    void prescribe(std::span<const RigidBody> rigid_bodies, double time, double dt, bool affine);
    void hold(std::size_t component, double velocity, std::int32_t holder, std::span<const RigidBody> rigid_bodies);

    Grid grid_;
    double inverse_dx_, inverse_dy_;
    CellLine line_x_, line_y_;
    int nodes_x_, nodes_y_;
    int fields_ = 1;
    std::vector<std::int32_t> begin_of_body_; // lattice place where the field of a body begins; empty: there is one field
    aligned_vector<double> weights_;          // stored numbers of x, then of y, particle after particle
    std::vector<std::int32_t> first_;         // lattice place of the first node a particle sees
    std::vector<Run> runs_, sorted_runs_;
    std::vector<std::size_t> stripe_place_;
    std::vector<std::int32_t> order_; // of sorted particles
    Particles::PermutationBuffers permutation_;
    std::vector<std::size_t> stripe_begin_; // place of the first run of each stripe, and the number of runs
    std::size_t particles_ = 0;
    /// Places of the lattice that particles reach, whole rows of it.
    struct Range {
        std::size_t begin = 0, end = 0;
    };
    Range reached_, touched_;              // by the particles now; also by those of the last step: elsewhere nothing is set
    aligned_vector<double> lattice_mass_;  // 0 where nothing is
    std::vector<std::int32_t> number_;     // active number of a lattice node, or -1
    std::vector<std::int32_t> touched_by_; // the last rigid body that was found to touch an active node
    double cutoff_ = 0.0;
    ActiveNodes nodes_;
};

extern template class Transfer<Linear>;
extern template class Transfer<Gimp>;
extern template class Transfer<BSpline>;

} // namespace ductile::mpm
