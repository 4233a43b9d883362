// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/mpm/body_contact.hpp>
#include <ductile/mpm/diagnostics.hpp>
#include <ductile/mpm/monitor.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <numeric>

namespace ductile::mpm {

namespace {

double largest_young_modulus(const Scene& scene) {
    double largest = 0.0;
    for (const Material& material : scene.materials)
        largest = std::max(largest, young_modulus(material.law->elasticity()));
    return largest;
}

double volume_of(const Particles& particles) {
    double sum = 0.0;
    for (std::size_t p = 0; p < particles.size(); ++p)
        sum += particles.mass[p] / particles.density[p];
    return sum;
}

constexpr double doubtful_energy = 0.01, doubtful_phase = 0.1, doubtful_travel = 0.5, doubtful_depth = 0.05;

/// Whether a ledger does not close because of the steps rather than the law.
bool of_steps(const Ledger& e) { return std::abs(e.of_law()) <= std::abs(e.of_method); }

/// Whether more is open than is accurate, or only less because what the law and what the steps leave open cancel.
bool is_open(const Ledger& e) {
    const auto doubtful = [&](double energy) { return !(std::abs(e.relative(energy)) <= doubtful_energy); };
    return doubtful(e.error()) || (doubtful(e.of_law()) && doubtful(e.of_method));
}

/// By how much steps of the midpoint rule shift an oscillation that has all the energy [rad]; `changes` is the sum of
/// (dv . M_c dv/2)^(3/2) over the steps. With the frequency w and the energy E a step has dv . M_c dv/2 = (w dt)^2 E sin^2 and
/// the phase error (w dt)^3/12; the mean of |sin|^3 is 4/(3 pi). Explicit steps, half of that; energy that does not move counts
/// in E, so that what rings beside a slow load is no matter.
double phase_error(double changes, const Ledger& e) {
    const double scale = std::max(e.at_start, e.work_magnitude);
    return scale > e.round_off ? changes * std::pow(scale, -1.5) * std::numbers::pi / 16.0 : 0.0;
}

/// The oscillation of the mean stress s that the steps have to follow. Three looks a time h apart know the square of its
/// frequency as a Rayleigh quotient, w^2 = -sum s . s'' / sum s . s over the last few, s'' the second difference of the three:
/// exact for one frequency, weighted by the squares of amplitudes for several; what is at rest, a constant stress, lowers it, so
/// that what rings beside a load counts by its share, and waves within the body, whose mean is nothing, do not count. A step of
/// the midpoint rule loses the phase (w dt)^3/12.
///
/// In the tally: time and mean stress of the last two looks, the two sums, the mean s . s of some fifty, the largest, the phase
/// [rad].
namespace stress_oscillation {
std::vector<double> begin(double time, const SymmetricTensor& s) {
    return {time, s.xx, s.yy, s.zz, s.xy, time, s.xx, s.yy, s.zz, s.xy, 0.0, 0.0, 0.0, 0.0, 0.0};
}

void look(std::vector<double>& tally, double time, const SymmetricTensor& now, int steps) {
    constexpr double few = 0.8, many = 0.98; // of a look that count in the next
    const SymmetricTensor before{tally[1], tally[2], tally[3], tally[4]}, middle{tally[6], tally[7], tally[8], tally[9]};
    const double first = tally[5] - tally[0], second = time - tally[5];
    double &restoring = tally[10], &squares = tally[11];
    const double square = contraction(now, now);
    tally[12] = many * tally[12] + (1.0 - many) * square;
    tally[13] = std::max(tally[13], square);
    if (first > 0.0 && second > 0.0) {
        const SymmetricTensor bend = 2.0 / (first + second) * (1.0 / second * (now - middle) - 1.0 / first * (middle - before));
        restoring = few * restoring - contraction(middle, bend);
        squares = few * squares + contraction(middle, middle);
        if (const double dt = second / steps; restoring > 0.0)
            tally[14] += steps * std::pow(std::min(dt * dt * restoring / squares, 4.0), 1.5) / 12.0;
    }
    std::copy(tally.begin() + 5, tally.begin() + 10, tally.begin());
    std::ranges::copy(std::array{time, now.xx, now.yy, now.zz, now.xy}, tally.begin() + 5);
}
double phase(const std::vector<double>& tally) { return tally[14]; }
/// Of the stress at the end, over the largest of the run.
double error(const std::vector<double>& tally) {
    return tally[13] > 0.0 ? std::min(phase(tally), 1.0) * std::sqrt(std::min(2.0 * tally[12] / tally[13], 1.0)) : 0.0;
}
} // namespace stress_oscillation

/// What a ledger that does not close comes from, and what to do.
std::string describe_error(const Ledger& e, bool inertia) {
    const double of_law = e.of_law();
    const std::string open =
        std::abs(e.relative_error()) > doubtful_energy
            ? fmt::format("the ledger of energy does not close: {:.3g} of the energy at the start and the work since is {}",
                          std::abs(e.relative_error()), e.error() < 0.0 ? "missing" : "too much")
            : fmt::format(
                  "the ledger of energy closes only because two errors, of {:.3g} and {:.3g} of the energy at the start and "
                  "the work since, cancel",
                  e.relative(of_law), -e.relative(e.of_method));
    if (!of_steps(e))
        return fmt::format(
            "{}, {:.3g} J of it because the law in rate form (Jaumann's) has no energy that depends on the strain "
            "alone: stresses of bodies that turn or change their volume while they are loaded are as doubtful; keep "
            "elastic strains small, or take a law at finite strain",
            open, std::abs(of_law));
    if (e.of_method < 0.0)
        return fmt::format("{}: the steps have added {:.3g} J, they are too long for the method: take shorter ones, or --method "
                           "implicit",
                           open, -e.of_method);
    if (!inertia)
        return fmt::format(
            "{}: {:.3g} J are lost in steps in which the load changes a lot: take shorter ones, and let loads grow "
            "from nothing",
            open, e.of_method);
    return fmt::format("{}: the steps have damped {:.3g} J away: take shorter ones if what oscillates or meets matters; --method "
                       "midpoint damps least",
                       open, e.of_method);
}

} // namespace

Ledger Monitor::ledger(const Observation& seen, const Tally& tally) const {
    const Energies now = energies_of(scene_, seen.state.particles);
    const std::vector<double>&work = tally.at("work_J"), &lost = tally.at("lost_J");
    return {.at_start = tally.at("energy_at_start_J")[0],
            .kinetic = options_.inertia ? now.kinetic : 0.0,
            .elastic = now.strain,
            .of_particles = now,
            .rigid_work = work[0],
            .body_work = work[1],
            .load_work = work[3],
            .work_magnitude = work[2],
            .dissipated = lost[0],
            .friction = lost[2],
            .in_contact = lost[3],
            .of_method = lost[1],
            .round_off = 1e-24 * largest_young_modulus(scene_) * volume_of(seen.state.particles)};
}

void Monitor::watch_work(const Observation& seen, Tally& tally) const {
    std::vector<double>&work = tally.at("work_J"), &lost = tally.at("lost_J");
    const auto add = [&](std::size_t kind, double done) {
        work[kind] += done;
        work[2] += std::abs(done);
    };
    add(1, seen.energies.body_work);
    add(3, seen.energies.load_work);
    lost[0] += seen.energies.dissipated;
    lost[1] += seen.energies.of_method;
    lost[2] += seen.energies.friction;
    lost[3] += seen.energies.in_contact;
    add(0, seen.energies.surface_work);
    const State& state = seen.state;
    const std::vector<double>& contacts = tally.at("contacts_N");
    for (std::size_t b = 0; b < seen.contact_forces.size(); ++b) {
        if (state.rigid_bodies[b].surface)
            continue;
        const auto& force = seen.contact_forces[b];
        const Velocity mean = state.rigid_bodies[b].velocity.mean(state.time - seen.dt, state.time);
        const double by_last = -seen.dt * (force[0] * mean.u + force[1] * mean.v);
        const double by_first = -seen.dt * (contacts[4 * b] * mean.u + contacts[4 * b + 1] * mean.v);
        const double done = options_.forces_at_end ? 0.5 * (by_first + by_last) : by_last;
        add(0, done);
        lost[1] -= by_last - done; // (Ledger)
        if (force[0] != 0.0 || force[1] != 0.0) {
            const Grid& grid = scene_.grid;
            double& longest = tally.at("rigid_travel_cells").front();
            longest = std::max(longest, seen.dt * std::max(std::abs(mean.u) / grid.dx(), std::abs(mean.v) / grid.dy()));
        }
    }
}

void Monitor::watch_contact(const Observation& seen, Tally& tally) const {
    std::vector<double>& contacts = tally["contacts_N"];
    for (std::size_t b = 0; b < seen.contact_forces.size(); ++b) {
        const RigidBody& body = seen.state.rigid_bodies[b];
        if (body.surface) // they never pull
            continue;
        const auto& force = seen.contact_forces[b];
        double &fx = contacts[4 * b], &fy = contacts[4 * b + 1], &largest = contacts[4 * b + 2], &lost = contacts[4 * b + 3];
        if (force[0] == 0.0 && force[1] == 0.0 && (fx != 0.0 || fy != 0.0)) {
            const auto mean = [](const auto& values) {
                return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
            };
            const double to_x = mean(seen.state.particles.x) - mean(body.x), to_y = mean(seen.state.particles.y) - mean(body.y);
            if (const double pull = (fx * to_x + fy * to_y) / std::hypot(to_x, to_y); pull > std::max(lost, 0.1 * largest))
                lost = pull;
        }
        largest = std::max(largest, std::hypot(force[0], force[1]));
        fx = force[0];
        fy = force[1];
    }
}

void Monitor::observe(const Observation& seen, double smallest_determinant, Tally& tally) const {
    const State& state = seen.state;
    const bool start = tally.find("work_J") == tally.end();
    if (start) {
        const Connectivity c = connectivity_of(scene_.grid, state.particles);
        const Energies energies = energies_of(scene_, state.particles);
        tally["energy_at_start_J"] = {(options_.inertia ? energies.kinetic : 0.0) + energies.strain};
        tally["work_J"] = {0.0, 0.0, 0.0, 0.0}; // of rigid bodies, of body forces, the sum of magnitudes, and of loads
        tally["lost_J"] = {0.0, 0.0, 0.0, 0.0}; // by plastic flow, by the method, by friction, and to contacts
        tally["deepest_contact_cells"] = {0.0};
        tally["velocity_changes"] = {0.0}; // see phase_error()
        tally["stress_oscillation"] = stress_oscillation::begin(state.time, mean_stress(state.particles));
        tally["contacts_N"].assign(4 * state.rigid_bodies.size(),
                                   0.0); // of each: last force, its largest magnitude, the pull lost
        tally["smallest_determinant"] = {1.0};
        tally["rigid_travel_cells"] = {0.0};                                            // the longest of a step
        tally["pieces"] = {static_cast<double>(c.parts), static_cast<double>(c.parts)}; // at the start, and most
        tally["holes"] = {static_cast<double>(c.holes), static_cast<double>(c.holes)};
        tally["enclosed_empty_cells"] = {static_cast<double>(c.enclosed_empty_cells)};
        return;
    }
    watch_work(seen, tally);
    watch_contact(seen, tally);
    tally["velocity_changes"][0] += std::pow(seen.energies.of_change, 1.5);
    double& smallest = tally["smallest_determinant"].front();
    smallest = std::min(smallest, smallest_determinant);
    if (state.step % options_.every != 0)
        return;
    double& deepest = tally["deepest_contact_cells"].front();
    deepest = std::max(deepest, std::max(deepest_contact(state.particles, state.rigid_bodies, state.time),
                                         deepest_body_contact(state.particles, scene_)) /
                                    scene_.grid.smallest_spacing());
    if (options_.inertia)
        stress_oscillation::look(tally.at("stress_oscillation"), state.time, mean_stress(state.particles), options_.every);
    const Connectivity c = connectivity_of(scene_.grid, state.particles);
    const auto raise = [](double& most, int now) { most = std::max(most, static_cast<double>(now)); };
    raise(tally["pieces"][1], c.parts);
    raise(tally["holes"][1], c.holes);
    raise(tally["enclosed_empty_cells"][0], c.enclosed_empty_cells);
}

void Monitor::conclude(const Observation& seen, const Tally& tally, const Particles& start, io::RunSummary& summary) const {
    const auto warn = [&](const std::string& sentence) { summary.warnings.push_back(sentence); };
    const Ledger energies = ledger(seen, tally);
    summary.extra["kinetic_energy_J"] = energies.kinetic;
    summary.extra["elastic_energy_J"] = energies.elastic;
    summary.extra["work_of_rigid_bodies_J"] = energies.rigid_work;
    summary.extra["work_of_body_force_J"] = energies.body_work;
    summary.extra["plastic_dissipation_J"] = energies.dissipated;
    summary.extra["numerical_dissipation_J"] = energies.of_method;
    summary.extra["energy_error_of_work"] = energies.relative_error();
    if (!scene_.loads.empty())
        summary.extra["work_of_loads_J"] = energies.load_work;
    if (scene_.surface_contact) {
        summary.extra["friction_dissipation_J"] = energies.friction;
        summary.extra["contact_energy_J"] = energies.in_contact;
        summary.extra["deepest_contact_cells"] = tally.at("deepest_contact_cells")[0];
    }
    const bool open = is_open(energies);
    if (open)
        warn(describe_error(energies, options_.inertia));
    const double phase = phase_error(tally.at("velocity_changes")[0], energies);
    summary.extra["phase_error_rad"] = phase;
    if (phase > doubtful_phase && !(open && of_steps(energies)))
        warn(
            fmt::format("the steps change velocities so much that oscillations and impacts are out of phase by about {:.2g} rad: "
                        "they are too long to follow the motion; take steps {:.2g} times as long, or --method implicit, which "
                        "damps it, if the motion does not matter",
                        phase, std::sqrt(0.1 * doubtful_phase / phase)));
    const std::vector<double>& oscillation = tally.at("stress_oscillation");
    const double of_stress = stress_oscillation::error(oscillation), stress_phase = stress_oscillation::phase(oscillation);
    summary.extra["stress_phase_error_rad"] = stress_phase;
    if (of_stress > doubtful_phase && phase <= doubtful_phase && !options_.forces_at_end && !(open && of_steps(energies)))
        warn(fmt::format(
            "the mean stress oscillates faster than the steps follow: at the end it is out of phase by about {:.2g} rad, "
            "and off by {:.2g} of the largest of the run; take steps {:.2g} times as long if the stress at a time matters",
            stress_phase, of_stress, std::sqrt(0.1 * doubtful_phase / stress_phase)));
    if (const double smallest = tally.at("smallest_determinant")[0]; smallest < 0.3)
        warn(fmt::format(
            "a step left a particle {:.3g} of its volume: more strain in one step than is accurate; take shorter steps",
            smallest));
    if (const double travel = tally.at("rigid_travel_cells")[0]; travel > doubtful_travel)
        warn(fmt::format(
            "a rigid body went {:.2g} cells in one step while it acted: by so much of a cell it takes hold of particles "
            "too early or too late; take steps {:.2g} times as long",
            travel, 0.2 * doubtful_travel / travel));
    if (const double deepest = tally.at("deepest_contact_cells")[0]; deepest > doubtful_depth)
        warn(fmt::format("a surface lay {:.2g} cells within another body: contact is as stiff as a layer of particles, and the "
                         "pressure there is a large part of the material's stiffness; take smaller cells if that way matters",
                         deepest));
    const std::vector<double>&pieces = tally.at("pieces"), &holes = tally.at("holes");
    if (pieces[1] > pieces[0] || holes[1] > holes[0])
        warn(fmt::format("particles have moved so far apart that cells between them are empty: the bodies, in {:g} piece{} and "
                         "with {:g} hole{} at the start, came to {:g} and {:g}; that is numerical fracture and not the "
                         "material's: use more particles a cell, or larger cells",
                         pieces[0], pieces[0] == 1.0 ? "" : "s", holes[0], holes[0] == 1.0 ? "" : "s", pieces[1], holes[1]));
    for (std::size_t b = 0; b < seen.state.rigid_bodies.size(); ++b)
        if (const double lost = tally.at("contacts_N")[4 * b + 3]; lost > 0.0)
            warn(fmt::format("the rigid body '{}' let go of the particles while it pulled them with {:.3g} N: between them are "
                             "empty cells; that is numerical fracture and not the material's: use more particles a cell, or "
                             "larger cells",
                             seen.state.rigid_bodies[b].name, lost));
    if (const double most = tally.at("enclosed_empty_cells")[0]; most > 0.0)
        summary.extra["most_enclosed_empty_cells"] = most;
    if (scene_.shape == ShapeFunction::linear)
        if (const double moved = share_in_other_cells(scene_.grid, start, seen.state.particles); moved > 0.1)
            warn(fmt::format(
                "{:.2g} of the particles have crossed into other cells, where the stress of linear shape functions jumps: "
                "it is off by tens of per cent beside cell edges, and finer cells do not help; compare with --shape gimp "
                "or bspline",
                moved));
    if (const double gone = farthest_from_fixed_side(scene_.grid, start, seen.state.particles); gone > 1.0)
        warn(fmt::format(
            "a particle that lay beside a fixed side of the grid has moved {:.2g} cells: a side holds what lies within "
            "a cell of it, and lets go of what is torn or stretched beyond that; if it should hold, let the body "
            "reach into a rigid one (contact = \"nodes\"), or use more particles a cell",
            gone));
    const double density = largest_change_of_density(start, seen.state.particles);
    const bool keeps_volume = density > 0.5 && density < 2.0;
    if (const bool small_changes = std::ranges::any_of(
            scene_.materials, [](const Material& material) { return material.law->finite_strain() == nullptr; });
        !keeps_volume && small_changes)
        warn(fmt::format(
            "the density of a particle has become {:.3g} times what it was: elastic laws of small changes of volume mean "
            "nothing there; load it less, stiffen the material, or take a law at finite strain",
            density));
    const PressureOscillation alternating = pressure_oscillation(scene_.grid, seen.state.particles);
    if (keeps_volume && alternating.pressure > 2.0 * alternating.equivalent &&
        alternating.pressure > 1e-9 * largest_young_modulus(scene_))
        warn(fmt::format(
            "the mean stress differs between neighbouring particles by {:.3g} Pa (root mean square), {:.3g} times the "
            "equivalent stress: the particles lock in a deformation that keeps the volume, and stresses and forces come "
            "out too large; take one particle a cell while strains are small, or B-splines and smaller cells",
            alternating.pressure, alternating.pressure / alternating.equivalent));
}

} // namespace ductile::mpm
