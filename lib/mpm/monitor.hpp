#pragma once
#include <ductile/io/summary.hpp>
#include <ductile/mpm/observation.hpp>
#include <ductile/mpm/scene.hpp>

namespace ductile::mpm {

/// Watches a run for what makes its numbers doubtful, in all programs alike, and says so in the summary's warnings:
/// - energy: kinetic and internal energy may not grow by more than the work done on the particles, the sum over rigid bodies of
///   -F_b . v_b dt with contact_force() F_b, and over particles of m_p b_p . v_p dt with the body force b_p, by the trapezoidal
///   rule. Steps that are too long let it grow;
/// - the smallest determinant of a step's deformation: below 0.3 one step strains a particle by more than it can be accurate for;
/// - connectivity_of(): a body that comes apart or gets holes, counted against the start;
/// - a rigid body that lets go of particles it pulled: F_b pointed from it to them, and from one step to the next no node is
///   shared. A gap that opens under a pull is one of cells without particles; one that opens under pressure, as in a rebound, or
///   under less than a tenth of the largest force, is none;
/// - pressure_oscillation() at the end, above twice the equivalent stress: volumetric locking.
class Monitor {
public:
    struct Options {
        int every = 1;       ///< step at which connectivity is looked at: one can be so short that nothing changes in many
        bool inertia = true; ///< whether kinetic energy is energy
    };
    Monitor(const Scene& scene, const Options& options) : scene_(scene), options_(options) {}

    /// At the start, and after every step.
    void observe(const Observation& seen, double smallest_determinant, Tally& tally) const;
    void conclude(const Observation& seen, const Tally& tally, io::RunSummary& summary) const;

private:
    [[nodiscard]] double energy(const Observation& seen) const;
    [[nodiscard]] double body_force_power(const State& state) const;
    void watch_contact(const Observation& seen, Tally& tally) const;

    Scene scene_;
    Options options_;
};

} // namespace ductile::mpm
