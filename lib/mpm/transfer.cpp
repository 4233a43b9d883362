// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/mpm/transfer.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fmt/format.h>
#include <limits>
#include <mutex>
#include <numeric>
#include <tuple>
#include <utility>

namespace ductile::mpm {

namespace {
constexpr double edge = 1e-12;          // of a cell: nearer to its edge a particle lies on it
constexpr double mass_cutoff = 1e-12;   // of the mean mass of a particle
constexpr double disorder_limit = 1.25; // runs for each occupied cell above which sorting pays
} // namespace

template <class Shape>
Transfer<Shape>::Transfer(const Grid& grid, std::span<const int> field_of_body)
    : grid_(grid), inverse_dx_(1.0 / grid.dx()),
      inverse_dy_(1.0 / grid.dy()), line_x_{grid.cells_x, grid.periodic()}, line_y_{grid.cells_y},
      nodes_x_(Shape::nodes(line_x_)), nodes_y_(Shape::nodes(line_y_)) {
    for (const int field : field_of_body) {
        fields_ = std::max(fields_, field + 1);
        begin_of_body_.push_back(field * nodes_x_ * nodes_y_);
    }
    const auto lattice = static_cast<std::size_t>(nodes_x_) * static_cast<std::size_t>(fields_ * nodes_y_);
    lattice_mass_.resize(lattice);
    number_.resize(lattice);
    touched_ = {0, lattice};
    nodes_.lattice_width = nodes_x_;
    nodes_.lattice_height = fields_ * nodes_y_;
    nodes_.period = grid.periodic() ? grid.cells_x : 0;
}

template <class Shape> bool Transfer<Shape>::inside(double x, double y) const {
    const double cx = (x - grid_.left) * inverse_dx_, cy = (y - grid_.bottom) * inverse_dy_;
    return (line_x_.periodic ? std::isfinite(cx) : cx >= 0.0 && cx <= grid_.cells_x) && cy >= 0.0 && cy <= grid_.cells_y;
}

template <class Shape> double Transfer<Shape>::wrapped(double x) const {
    const auto within = [&](double place) {
        const double cx = (place - grid_.left) * inverse_dx_;
        return cx >= 0.0 && cx <= grid_.cells_x;
    };
    if (!line_x_.periodic || within(x))
        return x;
    const double image = x - grid_.width * std::floor((x - grid_.left) / grid_.width);
    return within(image) ? image : grid_.left; // round-off
}

template <class Shape> auto Transfer<Shape>::place_of(double x, double y) const -> Place {
    const double cx = (wrapped(x) - grid_.left) * inverse_dx_, cy = (y - grid_.bottom) * inverse_dy_;
    const int cell_x = std::min(static_cast<int>(cx), grid_.cells_x - 1),
              cell_y = std::min(static_cast<int>(cy), grid_.cells_y - 1);
    return {cell_x, cell_y, cx - cell_x, cy - cell_y};
}

template <class Shape> void Transfer<Shape>::settle(const Particles& particles, std::size_t p, const Place& place) {
    double* const stored = &weights_[2 * Shape::stored * p];
    Shape::store(place.xi, place.cell_x, line_x_, particles.half_width[p] * inverse_dx_, stored);
    Shape::store(place.eta, place.cell_y, line_y_, particles.half_height[p] * inverse_dy_, stored + Shape::stored);
    first_[p] = Shape::first(place.eta, place.cell_y, line_y_) * nodes_x_ + Shape::first(place.xi, place.cell_x, line_x_);
    if (!begin_of_body_.empty())
        first_[p] += begin_of_body_[static_cast<std::size_t>(particles.body[p])];
}

template <class Shape> void Transfer<Shape>::settle_all(const Particles& particles) {
    std::size_t outside = particles.size(); // the first that is
    std::mutex lock;
    for_each_range([&](std::size_t first, std::size_t last) {
        for (std::size_t p = first; p < last; ++p) {
            const double x = particles.x[p], y = particles.y[p];
            if (inside(x, y)) {
                settle(particles, p, place_of(x, y));
            } else {
                const std::lock_guard guard(lock);
                outside = std::min(outside, p);
            }
        }
    });
    if (outside < particles.size())
        throw RunError(
            fmt::format("particle {} has left the background grid: it is at ({:.6g}, {:.6g}) m, and the grid extends from "
                        "({:.6g}, {:.6g}) to ({:.6g}, {:.6g}) m: use a larger grid, another condition at its sides, or "
                        "a smaller step",
                        particles.id[outside], particles.x[outside], particles.y[outside], grid_.left, grid_.bottom,
                        grid_.left + grid_.width, grid_.bottom + grid_.height));
}

template <class Shape> void Transfer<Shape>::find_runs(const Particles& particles) {
    runs_.clear();
    const auto count = static_cast<std::int32_t>(particles.size());
    for (std::int32_t begin = 0, end = 0; begin < count; begin = end) {
        const std::int32_t first = first_[begin];
        const std::int64_t material = particles.material[begin];
        for (end = begin + 1; end < count && first_[end] == first && particles.material[end] == material;)
            ++end;
        runs_.push_back({begin, end, static_cast<std::int32_t>(material), first, {}});
    }
    std::int32_t lowest = std::numeric_limits<std::int32_t>::max(), highest = 0;
    for (const Run& run : runs_) {
        lowest = std::min(lowest, run.first);
        highest = std::max(highest, run.first);
    }
    reached_ = {static_cast<std::size_t>(std::min(lowest, highest) / nodes_x_ * nodes_x_),
                static_cast<std::size_t>((highest / nodes_x_ + support) * nodes_x_)};
    touched_ = {std::min(touched_.begin, reached_.begin), std::max(touched_.end, reached_.end)};
    sort_by_stripes();
}

/// Within a stripe runs stay in the order of the particles.
template <class Shape> void Transfer<Shape>::sort_by_stripes() {
    const auto stripe_of = [&](const Run& run) { return static_cast<std::size_t>(run.first / nodes_x_ / stripe_rows); };
    stripe_begin_.assign(static_cast<std::size_t>((fields_ * nodes_y_ - 1) / stripe_rows + 2), 0);
    bool sorted = true;
    std::size_t last = 0;
    for (const Run& run : runs_) {
        const std::size_t stripe = stripe_of(run);
        ++stripe_begin_[stripe + 1];
        sorted = sorted && stripe >= last;
        last = stripe;
    }
    std::partial_sum(stripe_begin_.begin(), stripe_begin_.end(), stripe_begin_.begin());
    if (sorted)
        return;
    stripe_place_.assign(stripe_begin_.begin(), stripe_begin_.end() - 1);
    sorted_runs_.resize(runs_.size());
    for (const Run& run : runs_)
        sorted_runs_[stripe_place_[stripe_of(run)]++] = run;
    runs_.swap(sorted_runs_);
}

/// Whether there are many more runs than places with particles.
template <class Shape> bool Transfer<Shape>::disordered() {
    std::fill(&number_[touched_.begin], number_.data() + touched_.end, 0);
    std::size_t places = 0;
    for (const Run& run : runs_)
        places += number_[run.first]++ == 0 ? 1 : 0;
    return static_cast<double>(runs_.size()) > disorder_limit * static_cast<double>(places) + 1.0;
}

template <class Shape> void Transfer<Shape>::sort(Particles& particles) {
    order_.resize(particles.size());
    std::iota(order_.begin(), order_.end(), 0);
    std::sort(order_.begin(), order_.end(), [&](std::int32_t a, std::int32_t b) {
        const auto key = [&](std::int32_t p) { return std::tuple(first_[p], particles.material[p], p); };
        return key(a) < key(b);
    });
    particles.permute(order_, permutation_);
}

template <class Shape> void Transfer<Shape>::add_masses(const Particles& particles) {
    std::fill(&lattice_mass_[touched_.begin], lattice_mass_.data() + touched_.end, 0.0);
    for_each_run([&](const Run& run) {
        double sum[seen] = {};
        for (auto p = static_cast<std::size_t>(run.begin); p < static_cast<std::size_t>(run.end); ++p) {
            const Factors<support> fx = factors_x(p), fy = factors_y(p);
            for (int j = 0; j < support; ++j) {
                const double row = particles.mass[p] * fy.w[j];
                for (int i = 0; i < support; ++i)
                    sum[j * support + i] += row * fx.w[i];
            }
        }
        double* const lattice = &lattice_mass_[run.first];
        for (int j = 0; j < support; ++j)
            for (int i = 0; i < support; ++i)
                lattice[j * nodes_x_ + i] += sum[j * support + i];
    });
}

/// Gives nodes and their images the mass of both.
template <class Shape> void Transfer<Shape>::unite_images() {
    const auto width = static_cast<std::size_t>(nodes_x_);
    for (std::size_t row = reached_.begin / width; row < reached_.end / width && line_x_.periodic; ++row)
        for (int i = grid_.cells_x; i < nodes_x_; ++i) {
            double* const lattice = &lattice_mass_[row * width];
            lattice[i] = lattice[i - grid_.cells_x] += lattice[i];
        }
}

/// Moves particles that lie on a cell edge and touch nodes without mass to the cell beyond the edge. Says whether it did.
template <class Shape> bool Transfer<Shape>::leave_massless_nodes(const Particles& particles) {
    if constexpr (Shape::smooth)
        return false;
    bool moved = false;
    const auto massless = [&](std::int32_t node) { return lattice_mass_[node] <= cutoff_; };
    for (const Run& run : runs_) {
        const std::int32_t a = run.first, b = a + 1, c = a + nodes_x_, d = c + 1;
        if (!massless(a) && !massless(b) && !massless(c) && !massless(d))
            continue;
        for (auto p = static_cast<std::size_t>(run.begin); p < static_cast<std::size_t>(run.end); ++p) {
            Place place = place_of(particles.x[p], particles.y[p]);
            const Place before = place;
            const int cells = grid_.cells_x, turn = line_x_.periodic ? cells : 0;
            if (massless(b) && massless(d) && place.xi <= edge && place.cell_x + turn > 0)
                place.cell_x = (place.cell_x + turn - 1) % cells, place.xi = 1.0;
            else if (massless(a) && massless(c) && place.xi >= 1.0 - edge && place.cell_x + 1 < cells + turn)
                place.cell_x = (place.cell_x + 1) % cells, place.xi = 0.0;
            if (massless(c) && massless(d) && place.eta <= edge && place.cell_y > 0)
                --place.cell_y, place.eta = 1.0;
            else if (massless(a) && massless(b) && place.eta >= 1.0 - edge && place.cell_y < grid_.cells_y - 1)
                ++place.cell_y, place.eta = 0.0;
            if (place.cell_x != before.cell_x || place.cell_y != before.cell_y) {
                settle(particles, p, place);
                moved = true;
            }
        }
    }
    return moved;
}

template <class Shape> void Transfer<Shape>::number_nodes() {
    nodes_.lattice.clear();
    nodes_.mass.clear();
    for (std::size_t node = touched_.begin; node < touched_.end; ++node) {
        if (line_x_.periodic && static_cast<int>(node % nodes_x_) >= grid_.cells_x) {
            number_[node] = number_[node - grid_.cells_x];
            continue;
        }
        const bool active = lattice_mass_[node] > cutoff_;
        number_[node] = active ? static_cast<std::int32_t>(nodes_.lattice.size()) : -1;
        if (active) {
            nodes_.lattice.push_back(static_cast<std::int32_t>(node));
            nodes_.mass.push_back(lattice_mass_[node]);
        }
    }
    touched_ = reached_;
}

template <class Shape> std::int32_t Transfer<Shape>::active_number(std::int32_t first, int k) const {
    const auto number = [&](int node) { return number_[first + node / support * nodes_x_ + node % support]; };
    if (number(k) >= 0)
        return number(k);
    std::int32_t found = -1;
    int nearest = 2 * support;
    for (int other = 0; other < seen; ++other) {
        const int distance = std::abs(other % support - k % support) + std::abs(other / support - k / support);
        if (number(other) >= 0 && distance < nearest) {
            nearest = distance;
            found = number(other);
        }
    }
    return found;
}

template <class Shape> void Transfer<Shape>::number_runs(const Particles& particles) {
    for (Run& run : runs_)
        for (int k = 0; k < seen; ++k) {
            run.node[k] = active_number(run.first, k);
            if (run.node[k] < 0) {
                const auto p = static_cast<std::size_t>(run.begin);
                throw RunError(
                    fmt::format("particle {} at ({:.6g}, {:.6g}) m sees no node with mass: its own mass, {:.3g} kg, must be "
                                "positive, and more than 1e-12 of the mean of all particles",
                                particles.id[p], particles.x[p], particles.y[p], particles.mass[p]));
            }
        }
}

template <class Shape> void Transfer<Shape>::map_velocities(const Particles& particles) {
    nodes_.velocity.assign(2 * nodes_.count(), 0.0);
    for_each_run([&](const Run& run) {
        double sum_x[seen] = {}, sum_y[seen] = {};
        for (auto p = static_cast<std::size_t>(run.begin); p < static_cast<std::size_t>(run.end); ++p) {
            const Factors<support> fx = factors_x(p), fy = factors_y(p);
            for (int j = 0; j < support; ++j) {
                const double row_x = particles.mass[p] * particles.velocity_x[p] * fy.w[j];
                const double row_y = particles.mass[p] * particles.velocity_y[p] * fy.w[j];
                for (int i = 0; i < support; ++i) {
                    sum_x[j * support + i] += row_x * fx.w[i];
                    sum_y[j * support + i] += row_y * fx.w[i];
                }
            }
        }
        for (int k = 0; k < seen; ++k) {
            nodes_.velocity[2 * run.node[k]] += sum_x[k];
            nodes_.velocity[2 * run.node[k] + 1] += sum_y[k];
        }
    });
    if (!particles.affine.empty())
        add_affine(particles);
    for (std::size_t n = 0; n < nodes_.count(); ++n) {
        nodes_.velocity[2 * n] /= nodes_.mass[n];
        nodes_.velocity[2 * n + 1] /= nodes_.mass[n];
    }
}

/// The momenta m C (x_i - x_p) besides.
template <class Shape> void Transfer<Shape>::add_affine(const Particles& particles) {
    for_each_run([&](const Run& run) {
        double sum_x[seen] = {}, sum_y[seen] = {};
        for (auto p = static_cast<std::size_t>(run.begin); p < static_cast<std::size_t>(run.end); ++p) {
            const Factors<support> fx = factors_x(p), fy = factors_y(p);
            const auto ox = offsets_x(run.first, fx), oy = offsets_y(run.first, fy);
            for (int j = 0; j < support; ++j)
                for (int i = 0; i < support; ++i) {
                    const double mass = particles.mass[p] * fx.w[i] * fy.w[j];
                    sum_x[j * support + i] += mass * (particles.affine[0][p] * ox[i] + particles.affine[1][p] * oy[j]);
                    sum_y[j * support + i] += mass * (particles.affine[2][p] * ox[i] + particles.affine[3][p] * oy[j]);
                }
        }
        for (int k = 0; k < seen; ++k) {
            nodes_.velocity[2 * run.node[k]] += sum_x[k];
            nodes_.velocity[2 * run.node[k] + 1] += sum_y[k];
        }
    });
}

template <class Shape>
void Transfer<Shape>::hold(std::size_t component, double velocity, std::int32_t holder, std::span<const RigidBody> rigid_bodies) {
    double& prescribed = nodes_.velocity[component];
    if (nodes_.prescribed[component] > 0) {
        if (std::abs(velocity - prescribed) > 1e-12 * std::max(std::abs(velocity), std::abs(prescribed))) {
            const auto other = std::find_if(nodes_.holds.begin(), nodes_.holds.end(), [&](const Hold& hold) {
                return static_cast<std::size_t>(hold.component) == component;
            });
            const auto name = [&](std::int32_t h) {
                constexpr const char* sides[] = {"left", "right", "bottom", "top"};
                return h < 0 ? fmt::format("the {} side of the grid", sides[-h - 1])
                             : fmt::format("the rigid body '{}'", rigid_bodies[static_cast<std::size_t>(h)].name);
            };
            const int node = nodes_.lattice[component / 2], row = row_of(node);
            throw RunError(fmt::format(
                "{} and {} hold one node, near ({:.6g}, {:.6g}) m, at different velocities in {}, {:g} and {:g} m/s: end the run "
                "before they come so near to each other, use smaller cells, or let one of them slip",
                name(other->holder), name(holder), grid_.left + node % nodes_x_ * grid_.dx(), grid_.bottom + row * grid_.dy(),
                component % 2 == 0 ? "x" : "y", prescribed, velocity));
        }
        velocity = std::max(velocity, prescribed); // the same bits in any order of the bodies
    }
    ++nodes_.prescribed[component];
    prescribed = velocity;
    nodes_.holds.push_back({static_cast<std::int32_t>(component), holder});
}

template <class Shape>
void Transfer<Shape>::prescribe(std::span<const RigidBody> rigid_bodies, double time, double dt, bool affine) {
    if (affine)
        nodes_.mapped = nodes_.velocity;
    nodes_.prescribed.assign(2 * nodes_.count(), 0);
    nodes_.holds.clear();
    touched_by_.assign(nodes_.count(), -1);
    for (std::size_t b = 0; b < rigid_bodies.size(); ++b) {
        const RigidBody& body = rigid_bodies[b];
        if (body.surface)
            continue;
        const Velocity velocity = body.velocity.mean(time, time + dt);
        const auto number_of_body = static_cast<std::int32_t>(b);
        for (std::size_t p = 0; p < body.x.size(); ++p) {
            if (!inside(body.x[p], body.y[p]))
                continue;
            const auto [cell_x, cell_y, xi, eta] = place_of(body.x[p], body.y[p]);
            double stored[2][Shape::stored];
            Shape::store(xi, cell_x, line_x_, body.half_width, stored[0]);
            Shape::store(eta, cell_y, line_y_, body.half_width, stored[1]);
            const Factors<support> fx = Shape::expand(stored[0], inverse_dx_), fy = Shape::expand(stored[1], inverse_dy_);
            const int first = Shape::first(eta, cell_y, line_y_) * nodes_x_ + Shape::first(xi, cell_x, line_x_);
            for (int k = 0; k < fields_ * seen; ++k) {
                const int field = k / seen, i = k % support, j = k % seen / support;
                const std::int32_t number = number_[first + (field * nodes_y_ + j) * nodes_x_ + i];
                if (number < 0 || fx.w[i] * fy.w[j] <= edge)
                    continue;
                const auto n = static_cast<std::size_t>(number);
                if (std::exchange(touched_by_[n], number_of_body) == number_of_body)
                    continue;
                if (body.holds_x)
                    hold(2 * n, velocity.u, number_of_body, rigid_bodies);
                if (body.holds_y)
                    hold(2 * n + 1, velocity.v, number_of_body, rigid_bodies);
            }
        }
    }
    const auto at_side = [&](std::size_t n, SideCondition condition, std::int32_t side, int normal) {
        if (condition == SideCondition::free || condition == SideCondition::periodic)
            return;
        hold(2 * n + static_cast<std::size_t>(normal), 0.0, side, rigid_bodies);
        if (condition == SideCondition::fixed)
            hold(2 * n + static_cast<std::size_t>(1 - normal), 0.0, side, rigid_bodies);
    };
    for (std::size_t n = 0; n < nodes_.count(); ++n) {
        const int i = nodes_.lattice[n] % nodes_x_, j = row_of(nodes_.lattice[n]);
        if (i < Shape::wall_layers)
            at_side(n, grid_.sides.left, left_side, 0);
        if (i >= nodes_x_ - Shape::wall_layers)
            at_side(n, grid_.sides.right, right_side, 0);
        if (j < Shape::wall_layers)
            at_side(n, grid_.sides.bottom, bottom_side, 1);
        if (j >= nodes_y_ - Shape::wall_layers)
            at_side(n, grid_.sides.top, top_side, 1);
    }
}

template <class Shape>
void Transfer<Shape>::prepare(Particles& particles, std::span<const RigidBody> rigid_bodies, double time, double dt) {
    particles_ = particles.size();
    weights_.resize(2 * Shape::stored * particles.size());
    first_.resize(particles.size());
    settle_all(particles);
    find_runs(particles);
    if (disordered()) {
        sort(particles);
        settle_all(particles);
        find_runs(particles);
    }
    add_masses(particles);
    // weights sum to one: the nodes have the mass of the particles
    cutoff_ = mass_cutoff * std::accumulate(&lattice_mass_[reached_.begin], lattice_mass_.data() + reached_.end, 0.0) /
              static_cast<double>(particles.size());
    if (!(cutoff_ > 0.0 && std::isfinite(cutoff_)))
        throw RunError(fmt::format("the mass of all particles is {} kg: each must have a positive and finite one",
                                   cutoff_ / mass_cutoff * static_cast<double>(particles.size())));
    unite_images();
    if (leave_massless_nodes(particles)) {
        find_runs(particles);
        add_masses(particles);
        unite_images();
    }
    number_nodes();
    number_runs(particles);
    map_velocities(particles);
    prescribe(rigid_bodies, time, dt, !particles.affine.empty());
}

template <class Shape> std::size_t Transfer<Shape>::memory_bytes() const {
    return sizeof(double) * (weights_.capacity() + lattice_mass_.capacity() + 6 * nodes_.mass.capacity()) +
           sizeof(std::int32_t) * (first_.capacity() + number_.capacity()) +
           sizeof(Run) * (runs_.capacity() + sorted_runs_.capacity());
}

template class Transfer<Linear>;
template class Transfer<Gimp>;
template class Transfer<BSpline>;

} // namespace ductile::mpm
