// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/material/symmetric_tensor.hpp>
#include <ductile/mpm/diagnostics.hpp>
#include <ductile/mpm/output.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numeric>
#include <span>

namespace ductile::mpm {

namespace {

/// The internal variables of the scene's laws, each name once.
std::vector<InternalVariable> internal_variables(const Scene& scene) {
    std::vector<InternalVariable> all;
    for (const Material& material : scene.materials)
        for (const InternalVariable& variable : material.law->variables())
            if (std::ranges::none_of(all, [&](const InternalVariable& known) { return known.name == variable.name; }))
                all.push_back(variable);
    return all;
}

/// Its values at all particles; NaN where the law has another.
std::vector<double> values_of(const InternalVariable& variable, const Scene& scene, const Particles& particles) {
    std::vector<std::size_t> place; // among the variables of each law
    for (const Material& material : scene.materials) {
        const auto variables = material.law->variables();
        place.push_back(
            static_cast<std::size_t>(std::ranges::find(variables, variable.name, &InternalVariable::name) - variables.begin()));
    }
    std::vector<double> values(particles.size(), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t p = 0; p < values.size(); ++p) {
        const auto m = static_cast<std::size_t>(particles.material[p]);
        if (place[m] < scene.materials[m].law->variables().size())
            values[p] = particles.internal[place[m]][p];
    }
    return values;
}

/// What a snapshot holds beside the particles' own numbers.
struct Derived {
    std::vector<double> displacement_x = {}, displacement_y = {}, pressure = {}, von_mises = {}, volume = {};
};

Derived derive(const Grid& grid, const Particles& start, const Particles& now) {
    std::vector<std::size_t> place(start.size()); // at the start, by number
    for (std::size_t p = 0; p < start.size(); ++p)
        place[static_cast<std::size_t>(start.id[p])] = p;
    Derived derived;
    for (std::size_t p = 0; p < now.size(); ++p) {
        const std::size_t first = place[static_cast<std::size_t>(now.id[p])];
        const double dx = now.x[p] - start.x[first];
        derived.displacement_x.push_back(grid.periodic() ? std::remainder(dx, grid.width) : dx);
        derived.displacement_y.push_back(now.y[p] - start.y[first]);
        const SymmetricTensor stress = stress_of(now, p);
        derived.pressure.push_back(-trace(stress) / 3.0);
        derived.von_mises.push_back(equivalent_stress(stress));
        derived.volume.push_back(now.mass[p] / now.density[p]);
    }
    return derived;
}

/// NaN if there is none.
double largest_of(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), std::numeric_limits<double>::quiet_NaN(),
                           [](double a, double b) { return std::fmax(a, b); });
}

} // namespace

void LastStep::describe(io::Checkpoint& content) const {
    content.scalars.insert({{"last_dt", dt},
                            {"last_smallest_determinant", smallest_determinant},
                            {"last_newton_iterations", newton_iterations},
                            {"last_linear_iterations", linear_iterations}});
    content.vectors.emplace_back("last_contact_forces",
                                 contact_forces.empty() ? std::span<const double>()
                                                        : std::span(contact_forces.front().data(), 2 * contact_forces.size()));
}

void LastStep::restore(const io::CheckpointReader& checkpoint) {
    dt = checkpoint.scalar("last_dt");
    smallest_determinant = checkpoint.scalar("last_smallest_determinant");
    newton_iterations = checkpoint.scalar("last_newton_iterations");
    linear_iterations = checkpoint.scalar("last_linear_iterations");
    const std::vector<double> forces = checkpoint.vector("last_contact_forces");
    if (forces.size() != 2 * contact_forces.size())
        throw InputError(fmt::format("{}: 'last_contact_forces' has {} values, expected {}: use another checkpoint",
                                     checkpoint.path().string(), forces.size(), 2 * contact_forces.size()));
    for (std::size_t b = 0; b < contact_forces.size(); ++b)
        contact_forces[b] = {forces[2 * b], forces[2 * b + 1]};
}

std::vector<std::string> history_columns(const Problem& problem) {
    std::vector<std::string> columns{"time_s",           "step", "dt_s", "kinetic_energy_J", "strain_energy_J", "total_energy_J",
                                     "internal_energy_J"};
    for (const InternalVariable& variable : internal_variables(problem.scene))
        columns.push_back(fmt::format("largest_{}", column_name(variable)));
    columns.insert(columns.end(), {"smallest_determinant", "enclosed_empty_cells", "newton_iterations", "linear_iterations",
                                   "work_of_rigid_bodies_J", "work_of_body_force_J", "plastic_dissipation_J",
                                   "numerical_dissipation_J", "energy_error_J", "momentum_y_Ns"});
    if (!problem.scene.loads.empty())
        columns.emplace_back("work_of_loads_J");
    if (problem.scene.surface_contact)
        columns.insert(columns.end(), {"friction_dissipation_J", "contact_energy_J"});
    if (problem.scene.geometry != Geometry::axisymmetric) // there neither has a meaning
        columns.insert(columns.end(), {"momentum_x_Ns", "angular_momentum_Nms"});
    for (const RigidBody& body : problem.start.rigid_bodies)
        for (const char* direction : {"x", "y"})
            columns.push_back(fmt::format("{}_force_{}_N", body.name, direction));
    for (const Observable& observable : problem.observables)
        columns.push_back(observable.name);
    return columns;
}

void append_row(const Problem& problem, const Observation& seen, const LastStep& last, const Ledger& ledger,
                std::vector<double>& row) {
    const State& state = seen.state;
    const Energies& energies = ledger.of_particles;
    row.insert(row.end(), {state.time, static_cast<double>(state.step), last.dt, energies.kinetic, energies.strain,
                           energies.kinetic + energies.strain, energies.internal});
    for (const InternalVariable& variable : internal_variables(problem.scene))
        row.push_back(largest_of(values_of(variable, problem.scene, state.particles)));
    row.insert(row.end(), {last.smallest_determinant,
                           static_cast<double>(connectivity_of(problem.scene.grid, state.particles).enclosed_empty_cells),
                           last.newton_iterations, last.linear_iterations, ledger.rigid_work, ledger.body_work, ledger.dissipated,
                           ledger.of_method, ledger.error()});
    const Momenta momenta = momenta_of(state.particles);
    row.push_back(momenta.y);
    if (!problem.scene.loads.empty())
        row.push_back(ledger.load_work);
    if (problem.scene.surface_contact)
        row.insert(row.end(), {ledger.friction, ledger.in_contact});
    if (problem.scene.geometry != Geometry::axisymmetric)
        row.insert(row.end(), {momenta.x, momenta.angular});
    for (const auto& force : last.contact_forces)
        row.insert(row.end(), force.begin(), force.end());
    for (const Observable& observable : problem.observables)
        row.push_back(observable.value(seen));
}

void write_snapshot(const Scene& scene, const Particles& start, const State& state, io::ParticleSnapshotWriter& snapshots) {
    const Particles& p = state.particles;
    const Derived derived = derive(scene.grid, start, p);
    const auto numbers = [](const aligned_vector<std::int64_t>& integers) {
        return std::vector<double>(integers.begin(), integers.end());
    };
    const std::vector<double> id = numbers(p.id), material = numbers(p.material);
    std::vector fields{io::ParticleField{"velocity_x", "m/s", p.velocity_x},
                       io::ParticleField{"velocity_y", "m/s", p.velocity_y},
                       io::ParticleField{"displacement_x", "m", derived.displacement_x},
                       io::ParticleField{"displacement_y", "m", derived.displacement_y},
                       io::ParticleField{"stress_xx", "Pa", p.stress_xx},
                       io::ParticleField{"stress_yy", "Pa", p.stress_yy},
                       io::ParticleField{"stress_zz", "Pa", p.stress_zz},
                       io::ParticleField{"stress_xy", "Pa", p.stress_xy},
                       io::ParticleField{"pressure", "Pa", derived.pressure},
                       io::ParticleField{"von_mises_stress", "Pa", derived.von_mises},
                       io::ParticleField{"density", "kg/m^3", p.density},
                       io::ParticleField{"volume", "m^3", derived.volume},
                       io::ParticleField{"temperature_rise", "K", p.temperature},
                       io::ParticleField{"id", "1", id},
                       io::ParticleField{"material", "1", material}};
    const std::vector<InternalVariable> variables = internal_variables(scene);
    std::vector<std::vector<double>> internal;
    for (const InternalVariable& variable : variables)
        internal.push_back(values_of(variable, scene, p));
    for (std::size_t k = 0; k < variables.size(); ++k)
        fields.push_back({std::string(variables[k].name), std::string(variables[k].unit), internal[k]});
    std::vector<io::PointSet> rigid;
    for (const RigidBody& body : state.rigid_bodies)
        rigid.push_back({fmt::format("rigid_body_{}", body.name), body.x, body.y});
    snapshots.write(state.time, state.step, p.x, p.y, fields, rigid);
}

} // namespace ductile::mpm
