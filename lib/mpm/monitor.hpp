// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/summary.hpp>
#include <ductile/mpm/diagnostics.hpp>
#include <ductile/mpm/observation.hpp>
#include <ductile/mpm/scene.hpp>

#include <algorithm>

namespace ductile::mpm {

/// The energies of a run [J, a metre of thickness or a radian]; without inertia kinetic energy is none.
///
/// Kinetic and elastic energy should have grown by the work done less what plastic flow dissipates. Two things leave the
/// difference open: what the method takes away (StepEnergies, derived there, which it is known to do), and that the elastic law
/// is one of rates, whose energy is that of a state only while strains are small (EnergyFlow of a grid has the same term as
/// transport). Either may hide the other.
///
/// A method that finds forces at the end of a step does the work R = -dt F^L . w, with which StepEnergies is exact; the force
/// grew on the way, and the work that a rigid body has done is that of the mean of both ends, R' = -dt (F^k + F^L)/2 . w. Its
/// error is of second order where that of R is of first, and R - R' is nothing that the method takes away.
struct Ledger {
    double at_start = 0.0; ///< kinetic and elastic
    double kinetic = 0.0, elastic = 0.0;
    Energies of_particles = {}; ///< the same, and more, with or without inertia
    double rigid_work = 0.0, body_work = 0.0, load_work = 0.0;
    double work_magnitude = 0.0;             ///< the sum of magnitudes over all steps
    double dissipated = 0.0;                 ///< by plastic flow
    double friction = 0.0, in_contact = 0.0; ///< dissipated by slipping over surfaces; stored in contacts
    double of_method = 0.0;                  ///< taken away by the method
    double round_off = 0.0;                  ///< an energy that is nothing: of a stress of 1e-12 E everywhere

    [[nodiscard]] double error() const {
        return kinetic + elastic + in_contact + dissipated + friction - at_start - rigid_work - body_work - load_work;
    }
    [[nodiscard]] double of_law() const { return error() + of_method; } ///< what the law in rate form adds
    /// Of the energy at the start, or the work if that is more.
    [[nodiscard]] double relative(double energy) const {
        const double scale = std::max(at_start, work_magnitude);
        return scale > round_off ? energy / scale : 0.0;
    }
    [[nodiscard]] double relative_error() const { return relative(error()); }
};

/// Watches a run for what makes its numbers doubtful, in all programs alike, and says so in the summary's warnings:
/// - the ledger of energy, which should close to 1 % of the work;
/// - the phase that steps lose of a motion that has the run's energy, above 0.1; and of oscillations of the mean stress;
/// - the smallest determinant of a step's deformation: below 0.3 one step strains a particle by more than it can be accurate for;
/// - the longest way that a rigid body goes in a step in which it acts, in cells: beyond half of one the steps, and not the
///   motion, decide which nodes it holds;
/// - the deepest that a surface point lies within a rigid body, beyond a twentieth of a cell;
/// - connectivity_of(): a body that comes apart or gets holes, counted against the start;
/// - a rigid body that lets go of particles it pulled: F_b pointed from it to them, and from one step to the next no node is
///   shared. A gap that opens under a pull is one of cells without particles; one that opens under pressure, as in a rebound, or
///   under less than a tenth of the largest force, is none;
/// - particles that are in other cells than at the start, with shape functions whose gradients jump at the edges;
/// - particles at half or twice their density;
/// - pressure_oscillation() at the end, above twice the equivalent stress: volumetric locking.
class Monitor {
public:
    struct Options {
        int every = 1;       ///< step at which connectivity and mean stress are looked at: little changes in an explicit one
        bool inertia = true; ///< whether kinetic energy is energy
        bool forces_at_end = false; ///< whether the forces of a step are those of its end, which damps oscillations
    };
    Monitor(const Scene& scene, const Options& options) : scene_(scene), options_(options) {}

    /// At the start, and after every step.
    void observe(const Observation& seen, double smallest_determinant, Tally& tally) const;
    [[nodiscard]] Ledger ledger(const Observation& seen, const Tally& tally) const;
    /// `start`: the particles at the start of the run.
    void conclude(const Observation& seen, const Tally& tally, const Particles& start, io::RunSummary& summary) const;

private:
    void watch_work(const Observation& seen, Tally& tally) const;
    void watch_contact(const Observation& seen, Tally& tally) const;
    void watch_stress(const State& state, Tally& tally) const;

    Scene scene_;
    Options options_;
};

} // namespace ductile::mpm
