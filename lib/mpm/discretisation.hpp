// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/mpm/active_nodes.hpp>
#include <ductile/mpm/particles.hpp>
#include <ductile/mpm/scene.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>

namespace ductile::mpm {

/// How the nodes move the particles at the end of a step, (2.3.2)-(2.3.3) or (3.2.5)-(3.2.6); vectors over active nodes.
struct NodalMotion {
    std::span<const double> motion;    ///< velocity that carries positions [m/s]
    std::span<const double> straining; ///< velocity whose gradient strains the particles [m/s]; may be the same
    std::span<const double> increment; ///< change of the nodes' velocity over the step, added to the particles' [m/s]
    bool replace_velocity = false;     ///< particles take the nodes' `motion` instead of the increment (no inertia)
    double dt = 0.0;
    double weight_at_end = 0.0;        ///< mu, of the force at the end of the step in the one that acts
    std::span<const double> last = {}; ///< the nodes' velocity at the end of the step, for affine transfers
};

/// Energies of a step, summed over the particles [J, a metre of thickness or a radian].
struct ParticleEnergies {
    double of_increments = 0.0; ///< sum of m |dv|^2/2, dv the nodes' change of velocity at a particle
    double kinetic = 0.0;       ///< by how much sum of m |v|^2/2 grows, where transfers are affine
    /// sum of V (sigma_f - (sigma' + sigma^L)/2) : (strain increment): what the stress sigma_f = (1 - mu) sigma^k + mu sigma^L
    /// that the nodes feel does beyond what (2.2.16) counts, sigma' the turned stress of the beginning; see moves()
    double of_lag = 0.0;
    double dissipated = 0.0;   ///< sum of V (sigma' + sigma^L)/2 : (plastic strain increment)
    double surface_work = 0.0; ///< of rigid bodies by their surfaces, see SurfaceContact
    double friction = 0.0;     ///< what slipping over them has dissipated
    double load_work = 0.0;    ///< of loads, see SurfaceLoads
    double in_contact = 0.0;   ///< by how much the energy stored in contacts grows

    void add(const ParticleEnergies& other) {
        of_increments += other.of_increments;
        kinetic += other.kinetic;
        of_lag += other.of_lag;
        dissipated += other.dissipated;
        surface_work += other.surface_work;
        friction += other.friction;
        in_contact += other.in_contact;
        load_work += other.load_work;
    }
};

/// What a velocity field would do to the particles.
struct Forecast {
    /// Of the deformation gradient I + dt grad v of the step with its stretch out of the plane; not positive where a material
    /// line would turn over on the way to it.
    double smallest_determinant = 0.0;
    double farthest_travel = 0.0; ///< of a particle, in cells
    std::ptrdiff_t leaving = -1;  ///< place in the arrays of a particle that would leave the grid, or -1

    /// NaN stays.
    void add_determinant(double determinant) {
        if (determinant < smallest_determinant || std::isnan(determinant))
            smallest_determinant = determinant;
    }
};

/// The nodes that a particle sees, by active number, its shape functions there, and what takes the gradient of the affine field
/// around it (below), which no node without mass has a part in.
struct Stencil {
    std::size_t count = 0;
    std::array<std::int32_t, 9> node = {};
    std::array<double, 9> value = {}, slope_x = {}, slope_y = {};
};

/// Takes one dense matrix, row by row, over nodes with these active numbers. Calls on several threads at once have no node in
/// common; they must not throw.
using AddBlock = std::function<void(std::span<const std::int32_t> nodes, std::span<const double> matrix)>;

/// The discrete equations of Sec. 2.2 of Sulsky & Kaul for particles on the background grid, at one instant: prepare() takes the
/// particles where they are; everything else evaluates sums over them with the weights of that instant, as often as wanted, and
/// changes no particle, until advance() moves them.
///
/// Vectors over active nodes hold x and y components in turn, 2 nodes().count() numbers.
///
/// Transfers. The paper's particles keep their velocities and get the nodes' change of it: what the grid does not see of them
/// stays, a rotation loses angular momentum to the lumped mass. Affine ones (Jiang, Schroeder, Selle, Teran & Stomakhin 2015)
/// give a particle the velocity field of the end of the step around it, v + C (x - x_p), and take a node's from all of it,
///   m_i v_i = sum m_p N_i (v_p + C_p (x_i - x_p)),   v_p = sum N_i v_i^L,   C_p = [sum N_i v_i^L (x_i - x_p)^T] D^-1 f^-1
/// with D = sum N_i (x_i - x_p)(x_i - x_p)^T, which is diagonal (hat functions: the gradient), and the deformation f of the step
/// by which the nodes move away from each other: a velocity that is linear in space stays what it is. What the grid resolves and
/// one such field a particle does not is lost, as kinetic energy. At nodes that something holds the particles take the velocity
/// of that, and it takes their momentum: see add_held_force().
class Discretisation {
public:
    virtual ~Discretisation() = default;

    /// Weights, active nodes, masses (2.2.12), mapped velocities (2.2.14), prescribed components. May sort the particles.
    /// Rigid bodies hold their nodes at their mean velocity over a step of dt seconds from `time` on.
    /// Throws InputError as check_internal() does, and RunError for a particle outside the grid, and for a node that two rigid
    /// bodies, or a body and a side, hold at different velocities.
    virtual void prepare(Particles& particles, std::span<const RigidBody> rigid_bodies, double time = 0.0, double dt = 0.0) = 0;
    [[nodiscard]] virtual const ActiveNodes& nodes() const = 0;

    /// Whether some forces of a step act on another configuration than that of its beginning: those of laws at finite strain,
    /// which act where the step ends, and those of the midpoint rule (point_update.hpp). ParticleEnergies::of_lag is -sum m de
    /// then, and lacks the work of the forces, -dt f . w.
    [[nodiscard]] virtual bool moves() const = 0;

    /// f_i = -sum V_p grad N_i sigma_p, (2.2.9)-(2.2.10) with the particles' present stress and the volumes of prepare();
    /// in axisymmetry the x component gets -sum V_p N_i sigma_zz/r besides.
    /// `magnitudes`, unless empty, takes the sums of the magnitudes of the particles' forces, which do not cancel at a node.
    virtual void internal_force(const Particles& particles, std::span<double> force, std::span<double> magnitudes = {}) const = 0;
    /// The same with the stress that a step of dt with this velocity would give, (2.4.7), where that acts.
    virtual void force_after(const Particles& particles, std::span<const double> velocity, double dt, std::span<double> force,
                             std::span<double> magnitudes = {}) const = 0;
    /// b_i of (2.2.8): the scene's body force at the given time, mapped to the nodes.
    virtual void body_force(const Particles& particles, double time, std::span<double> force) const = 0;
    /// M_c x with the consistent mass matrix (2.2.6), for both components.
    virtual void consistent_mass_times(const Particles& particles, std::span<const double> x, std::span<double> result) const = 0;

    /// Keeps the derivative of force_after() at this velocity for the three functions below: -df/dv = dt K.
    virtual void linearise(const Particles& particles, std::span<const double> velocity, double dt) = 0;
    /// result = dt K x
    virtual void stiffness_times(std::span<const double> x, std::span<double> result) const = 0;
    /// The diagonal of dt K.
    virtual void stiffness_diagonal(std::span<double> diagonal) const = 0;
    /// Calls `add(nodes, matrix)` with dense matrices whose sum is dt K: row by row, over both components of these active nodes.
    virtual void stiffness_blocks(const AddBlock& add) const = 0;
    /// The same for the consistent mass matrix, whose rows and columns are nodes.
    virtual void consistent_mass_blocks(const Particles& particles, const AddBlock& add) const = 0;
    [[nodiscard]] virtual Stencil stencil(std::size_t p) const = 0; ///< of the particle at this place in the arrays
    /// Of the particles on the surface of each rigid body, as the last step's method weighs its beginning and end [N, a metre of
    /// thickness or a radian]; none where no body has a surface.
    [[nodiscard]] virtual std::span<const std::array<double, 2>> surface_forces() const { return {}; }
    /// How far apart, each way, nodes that a particle sees can be: 1 or 2.
    [[nodiscard]] virtual int reach() const = 0;

    [[nodiscard]] virtual Forecast forecast(const Particles& particles, const NodalMotion& motion) const = 0;
    /// The end of a step: stress, internal variable, density (2.3.4), energy (2.2.16) and temperature (2.3.5) at the particles,
    /// then their velocities and positions. The sums have the same bits on any number of threads.
    virtual ParticleEnergies advance(Particles& particles, const NodalMotion& motion) = 0;

    [[nodiscard]] virtual std::size_t memory_bytes() const = 0;
};

/// The discretisation with the scene's shape functions and geometry. `midpoint`: the steps are those of the midpoint rule; if the
/// scene has finite rotation, their forces act on the configuration in the middle.
[[nodiscard]] std::unique_ptr<Discretisation> make_discretisation(const Scene& scene, bool midpoint = false);

} // namespace ductile::mpm
