#include <ductile/mpm/diagnostics.hpp>
#include <ductile/mpm/monitor.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numeric>

namespace ductile::mpm {

namespace {

double largest_young_modulus(const Scene& scene) {
    double largest = 0.0;
    for (const Material& material : scene.materials)
        largest = std::max(largest, young_modulus(material.law->elasticity()));
    return largest;
}

} // namespace

double Monitor::energy(const Observation& seen) const {
    const Energies e = energies_of(scene_, seen.state.particles);
    return (options_.inertia ? e.kinetic : 0.0) + e.internal;
}

/// Sum of m_p b_p . v_p [W], of a metre of thickness or a radian.
double Monitor::body_force_power(const State& state) const {
    const Particles& p = state.particles;
    double power = 0.0;
    for (std::size_t i = 0; scene_.body_force && i < p.size(); ++i) {
        const auto b = scene_.body_force(p.id[i], p.x[i], p.y[i], state.time);
        power += p.mass[i] * (b[0] * p.velocity_x[i] + b[1] * p.velocity_y[i]);
    }
    return power;
}

void Monitor::watch_contact(const Observation& seen, Tally& tally) const {
    std::vector<double>& contacts = tally["contacts_N"];
    for (std::size_t b = 0; b < seen.contact_forces.size(); ++b) {
        const RigidBody& body = seen.state.rigid_bodies[b];
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
        tally["energy_at_start_J"] = {energy(seen)};
        tally["work_J"] = {0.0, 0.0}; // and the sum of its magnitudes
        tally["body_power_W"] = {body_force_power(state)};
        tally["contacts_N"].assign(4 * state.rigid_bodies.size(),
                                   0.0); // of each: last force, its largest magnitude, the pull lost
        tally["smallest_determinant"] = {1.0};
        tally["pieces"] = {static_cast<double>(c.parts), static_cast<double>(c.parts)}; // at the start, and most
        tally["holes"] = {static_cast<double>(c.holes), static_cast<double>(c.holes)};
        tally["enclosed_empty_cells"] = {static_cast<double>(c.enclosed_empty_cells)};
        return;
    }
    std::vector<double>& work = tally["work_J"];
    const auto add_work = [&](double done) {
        work[0] += done;
        work[1] += std::abs(done);
    };
    double& power = tally["body_power_W"].front();
    const double power_now = body_force_power(state);
    add_work(seen.dt * (options_.inertia ? 0.5 * (power + power_now) : power_now)); // without inertia a step has one velocity
    power = power_now;
    watch_contact(seen, tally);
    for (std::size_t b = 0; b < seen.contact_forces.size(); ++b) {
        const RigidBody& body = state.rigid_bodies[b];
        const auto& force = seen.contact_forces[b];
        const Velocity mean = body.velocity.mean(state.time - seen.dt, state.time);
        add_work(-seen.dt * (force[0] * mean.u + force[1] * mean.v));
    }
    double& smallest = tally["smallest_determinant"].front();
    smallest = std::min(smallest, smallest_determinant);
    if (state.step % options_.every != 0)
        return;
    const Connectivity c = connectivity_of(scene_.grid, state.particles);
    const auto raise = [](double& most, int now) { most = std::max(most, static_cast<double>(now)); };
    raise(tally["pieces"][1], c.parts);
    raise(tally["holes"][1], c.holes);
    raise(tally["enclosed_empty_cells"][0], c.enclosed_empty_cells);
}

void Monitor::conclude(const Observation& seen, const Tally& tally, io::RunSummary& summary) const {
    const auto warn = [&](const std::string& sentence) { summary.warnings.push_back(sentence); };
    const double before = tally.at("energy_at_start_J")[0], now = energy(seen);
    const std::vector<double>& work = tally.at("work_J");
    const double gained = now - before - work[0], scale = std::max(before, work[1]);
    if (gained > 0.1 * scale)
        warn(fmt::format(
            "the particles have {:.3g} J more than they had and than the work done on them, {:.3g} times as much: the "
            "steps are too long for the method; take shorter ones, or an implicit method",
            gained, now / std::max(before + work[0], 1e-300)));
    if (const double smallest = tally.at("smallest_determinant")[0]; smallest < 0.3)
        warn(fmt::format(
            "a step left a particle {:.3g} of its volume: more strain in one step than is accurate; take shorter steps",
            smallest));
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
    const PressureOscillation oscillation = pressure_oscillation(scene_.grid, seen.state.particles);
    if (oscillation.pressure > 2.0 * oscillation.equivalent && oscillation.pressure > 1e-9 * largest_young_modulus(scene_))
        warn(fmt::format(
            "the mean stress differs between neighbouring particles by {:.3g} Pa (root mean square), {:.3g} times the "
            "equivalent stress: the particles lock in a deformation that keeps the volume, and stresses and forces come "
            "out too large; take one particle a cell while strains are small, or B-splines and smaller cells",
            oscillation.pressure, oscillation.pressure / oscillation.equivalent));
}

} // namespace ductile::mpm
