#pragma once
#include <ductile/io/summary.hpp>
#include <ductile/mpm/observation.hpp>
#include <ductile/mpm/scene.hpp>

namespace ductile::mpm {

/// Watches a run for what makes its numbers doubtful, in all programs alike, and says so in the summary's warnings:
/// - energy: kinetic and internal energy may not grow by more than the work done on the particles, sum of -F_b . v_b dt over
/// rigid
///   bodies with contact_force() F_b; looked at without body force. Steps that are too long let it grow;
/// - the smallest determinant of a step's deformation: below 0.3 one step strains a particle by more than it can be accurate for;
/// - connectivity_of(): a body that comes apart or gets holes, counted against the start;
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

    const Scene& scene_;
    Options options_;
};

} // namespace ductile::mpm
