// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: the sums over particles; one instance for each shape function and geometry.
#include <ductile/material/elasticity.hpp>
#include <ductile/mpm/discretisation.hpp>
#include <ductile/mpm/point_update.hpp>
#include <ductile/mpm/transfer.hpp>

#include <algorithm>
#include <limits>
#include <mutex>

namespace ductile::mpm {

template <class Shape, Geometry geometry> class Kernels final : public Discretisation {
public:
    Kernels(const Scene& scene, bool midpoint)
        : scene_(scene), midpoint_(midpoint && scene.finite_rotation), moves_(midpoint_ || has_finite_strain(scene)),
          transfer_(scene.grid, scene.field_of_body) {}

    void prepare(Particles& particles, std::span<const RigidBody> rigid_bodies, double time, double dt) override {
        check_internal(scene_, particles);
        transfer_.prepare(particles, rigid_bodies, time, dt);
        volume_.resize(particles.size());
        if constexpr (axisymmetric)
            inverse_radius_.resize(particles.size());
        transfer_.for_each_range([&](std::size_t first, std::size_t last) {
            for (std::size_t p = first; p < last; ++p)
                volume_[p] = particles.mass[p] / particles.density[p];
            if constexpr (axisymmetric)
                for (std::size_t p = first; p < last; ++p)
                    inverse_radius_[p] = 1.0 / particles.x[p];
        });
    }

    [[nodiscard]] const ActiveNodes& nodes() const override { return transfer_.nodes(); }
    [[nodiscard]] bool moves() const override { return moves_; }

    void internal_force(const Particles& particles, std::span<double> force, std::span<double> magnitudes) const override {
        std::fill(force.begin(), force.end(), 0.0);
        std::fill(magnitudes.begin(), magnitudes.end(), 0.0);
        transfer_.for_each_run([&](const Run& run) {
            Local sum{}, magnitude{};
            for (std::size_t p = begin(run); p < end(run); ++p) {
                const Weights n = at(p);
                const SymmetricTensor stress = volume_[p] * stress_of(particles, p);
                subtract_force(sum, n, stress);
                if (!magnitudes.empty())
                    add_magnitude(magnitude, n, stress);
            }
            scatter(run, sum, force);
            if (!magnitudes.empty())
                scatter(run, magnitude, magnitudes);
        });
    }

    void force_after(const Particles& particles, std::span<const double> velocity, double dt, std::span<double> force,
                     std::span<double> magnitudes) const override {
        std::fill(force.begin(), force.end(), 0.0);
        std::fill(magnitudes.begin(), magnitudes.end(), 0.0);
        visit_runs([&]<Kinematics kinematics>(const Run& run, const Law& law, Constant<kinematics>) {
            const Local v = gather(run, velocity);
            Local sum{}, magnitude{};
            for_each_batch(run, [&](std::size_t first, std::size_t count) {
                Batch b;
                double unused[most_variables][batch];
                double* internal_end[most_variables];
                for (std::size_t k = 0; k < most_variables; ++k)
                    internal_end[k] = unused[k];
                if constexpr (kinematics == Kinematics::moved) {
                    StepWork work[batch];
                    move(law, particles, first, count, v, dt, b, internal_end, work);
                    if (midpoint_)
                        go_to_middle(count, dt, b);
                } else {
                    strain<kinematics>(law, particles, first, count, v, dt, b);
                    correct(law, particles, first, count, dt, b, internal_end);
                }
                for (std::size_t i = 0; i < count; ++i) {
                    const Weights n = at(first + i);
                    const auto stress = [&] {
                        if constexpr (kinematics == Kinematics::moved)
                            return volume_[first + i] * piola(b.stress[i], b.f[i]);
                        else
                            return volume_[first + i] * b.stress[i];
                    }();
                    subtract_force(sum, n, stress);
                    if (!magnitudes.empty())
                        add_magnitude(magnitude, n, stress);
                }
            });
            scatter(run, sum, force);
            if (!magnitudes.empty())
                scatter(run, magnitude, magnitudes);
        });
    }

    void body_force(const Particles& particles, double time, std::span<double> force) const override {
        std::fill(force.begin(), force.end(), 0.0);
        if (!scene_.body_force)
            return;
        transfer_.for_each_run([&](const Run& run) {
            Local sum{};
            for (std::size_t p = begin(run); p < end(run); ++p) {
                const auto b = scene_.body_force(particles.id[p], particles.x[p], particles.y[p], time);
                add_value(sum, at(p), particles.mass[p] * b[0], particles.mass[p] * b[1]);
            }
            scatter(run, sum, force);
        });
    }

    void consistent_mass_times(const Particles& particles, std::span<const double> x, std::span<double> result) const override {
        std::fill(result.begin(), result.end(), 0.0);
        transfer_.for_each_run([&](const Run& run) {
            const Local local = gather(run, x);
            Local sum{};
            for (std::size_t p = begin(run); p < end(run); ++p) {
                const Weights n = at(p);
                const Vector value = value_of(local, n);
                add_value(sum, n, particles.mass[p] * value.x, particles.mass[p] * value.y);
            }
            scatter(run, sum, result);
        });
    }

    void linearise(const Particles& particles, std::span<const double> velocity, double dt) override {
        if (moves_)
            moved_tangent_.resize(particles.size());
        else
            tangent_.resize(particles.size());
        visit_runs([&]<Kinematics kinematics>(const Run& run, const Law& law, Constant<kinematics>) {
            const Local v = gather(run, velocity);
            for_each_batch(run, [&](std::size_t first, std::size_t count) {
                if constexpr (kinematics == Kinematics::moved) {
                    differentiate_moved(law, particles, first, count, v, dt);
                } else {
                    Batch b;
                    strain<kinematics>(law, particles, first, count, v, dt, b);
                    Tangent tangent[batch];
                    law->tangent(count, b.stress, internal_of(particles, first).row, dt, tangent);
                    for (std::size_t i = 0; i < count; ++i) {
                        PointTangent t = differentiate_point<geometry, kinematics == Kinematics::turning>(
                            tangent[i], b.start[i], law->elasticity().shear_modulus, b.l[i], dt);
                        scale(t, dt * volume_[first + i]);
                        if (moves_)
                            moved_tangent_[first + i] = as_moved(t);
                        else
                            tangent_[first + i] = t;
                    }
                }
            });
        });
    }

    void stiffness_times(std::span<const double> x, std::span<double> result) const override {
        std::fill(result.begin(), result.end(), 0.0);
        with_tangents([&](const auto& tangents) {
            transfer_.for_each_run([&](const Run& run) {
                const Local local = gather(run, x);
                Local sum{};
                for (std::size_t p = begin(run); p < end(run); ++p) {
                    const Weights n = at(p);
                    subtract_force(sum, n, minus(product(tangents[p], gradient(local, n))));
                }
                scatter(run, sum, result);
            });
        });
    }

    void stiffness_diagonal(std::span<double> diagonal) const override {
        std::fill(diagonal.begin(), diagonal.end(), 0.0);
        with_tangents([&](const auto& tangents) {
            transfer_.for_each_run([&](const Run& run) {
                for_each_node_pair(tangents, run, [&](int k, int l, const double(&block)[2][2]) {
                    if (run.node[k] == run.node[l])
                        for (int c = 0; c < 2; ++c)
                            diagonal[2 * run.node[k] + c] += block[c][c];
                });
            });
        });
    }

    void stiffness_blocks(const AddBlock& add) const override {
        with_tangents([&](const auto& tangents) {
            transfer_.for_each_run([&](const Run& run) {
                double matrix[2 * seen][2 * seen];
                for_each_node_pair(tangents, run, [&](int k, int l, const double(&block)[2][2]) {
                    for (int a = 0; a < 2; ++a)
                        for (int b = 0; b < 2; ++b)
                            matrix[2 * k + a][2 * l + b] = block[a][b];
                });
                add(run.node, {&matrix[0][0], 4 * seen * seen});
            });
        });
    }

    void consistent_mass_blocks(const Particles& particles, const AddBlock& add) const override {
        transfer_.for_each_run([&](const Run& run) {
            double matrix[seen][seen] = {};
            for (std::size_t p = begin(run); p < end(run); ++p) {
                const Weights n = at(p);
                for (int k = 0; k < seen; ++k)
                    for (int l = 0; l < seen; ++l)
                        matrix[k][l] += particles.mass[p] * n.value(k) * n.value(l);
            }
            add(run.node, {&matrix[0][0], seen * seen});
        });
    }

    [[nodiscard]] Stencil stencil(std::size_t p) const override {
        const Weights n = affine_field(transfer_.first_node(p), at(p));
        Stencil s{.count = seen};
        for (int k = 0; k < seen; ++k) {
            const auto i = static_cast<std::size_t>(k);
            s.node[i] = transfer_.active_number(transfer_.first_node(p), k);
            s.value[i] = n.value(k);
            s.slope_x[i] = n.x.dw[k % support] * n.y.w[k / support];
            s.slope_y[i] = n.x.w[k % support] * n.y.dw[k / support];
        }
        return s;
    }

    [[nodiscard]] int reach() const override { return support - 1; }

    [[nodiscard]] Forecast forecast(const Particles& particles, const NodalMotion& m) const override {
        Forecast result{.smallest_determinant = std::numeric_limits<double>::infinity()};
        std::mutex lock;
        transfer_.for_each_stripe([&](std::span<const Run> runs) {
            Forecast part{.smallest_determinant = std::numeric_limits<double>::infinity()};
            for (const Run& run : runs) {
                const Local strained = gather(run, m.straining), moved = gather(run, m.motion);
                for (std::size_t p = begin(run); p < end(run); ++p) {
                    const Weights n = at(p);
                    const VelocityGradient l = gradient(strained, n);
                    part.add_determinant(determinant_on_the_way(l, m.dt, 1.0 + out_of_plane_strain(particles, p, l, m.dt)));
                    const Vector v = value_of(moved, n);
                    part.farthest_travel = std::max({part.farthest_travel, m.dt * std::abs(v.x) / transfer_.grid().dx(),
                                                     m.dt * std::abs(v.y) / transfer_.grid().dy()});
                    if (!transfer_.inside(particles.x[p] + m.dt * v.x, particles.y[p] + m.dt * v.y))
                        part.leaving = std::max(part.leaving, static_cast<std::ptrdiff_t>(p));
                }
            }
            const std::lock_guard guard(lock);
            result.add_determinant(part.smallest_determinant);
            result.farthest_travel = std::max(result.farthest_travel, part.farthest_travel);
            result.leaving = std::max(result.leaving, part.leaving);
        });
        return result;
    }

    ParticleEnergies advance(Particles& particles, const NodalMotion& m) override {
        energies_.assign(transfer_.run_count(), {});
        visit_runs([&]<Kinematics kinematics>(const Run& run, const Law& law, Constant<kinematics>) {
            const Local strained = gather(run, m.straining), moved = gather(run, m.motion), change = gather(run, m.increment);
            const Local last = scene_.affine ? gather(run, m.last) : Local{};
            const double heat_capacity = scene_.materials[static_cast<std::size_t>(run.material)].heat_capacity;
            ParticleEnergies& energies = energies_[transfer_.place_of(run)];
            for_each_batch(run, [&](std::size_t first, std::size_t count) {
                Batch b;
                StepWork work[batch];
                double* internal_end[most_variables];
                for (std::size_t k = 0; k < particles.internal.size(); ++k)
                    internal_end[k] = particles.internal[k].data() + first;
                if constexpr (kinematics == Kinematics::moved) {
                    move(law, particles, first, count, strained, m.dt, b, internal_end, work);
                } else {
                    strain<kinematics>(law, particles, first, count, strained, m.dt, b);
                    correct(law, particles, first, count, m.dt, b, internal_end);
                }
                for (std::size_t i = 0; i < count; ++i) {
                    const std::size_t p = first + i;
                    if constexpr (kinematics == Kinematics::moved) {
                        energies.of_lag -= volume_[p] * (work[i].stored + work[i].dissipated);
                        energies.dissipated += volume_[p] * work[i].dissipated;
                        update_energies(particles, p, work[i], determinant(b.f[i]), heat_capacity);
                    } else {
                        const SymmetricTensor twice_felt =
                            2.0 * (1.0 - m.weight_at_end) * stress_of(particles, p) + 2.0 * m.weight_at_end * b.stress[i];
                        const SymmetricTensor twice_mean = b.start[i] + b.stress[i];
                        energies.of_lag += 0.5 * volume_[p] * contraction(twice_felt - twice_mean, b.strain[i]);
                        if (moves_) // what the nodes feel is counted there
                            energies.of_lag -= 0.5 * volume_[p] * contraction(twice_felt, b.strain[i]);
                        energies.dissipated += update_energies(
                            law, particles, p, b, i, plane_determinant(b.l[i], m.dt) * (1.0 + b.strain[i].zz), heat_capacity);
                    }
                    particles.stress_xx[p] = b.stress[i].xx;
                    particles.stress_yy[p] = b.stress[i].yy;
                    particles.stress_zz[p] = b.stress[i].zz;
                    particles.stress_xy[p] = b.stress[i].xy;

                    const Weights n = at(p);
                    const Vector v = value_of(moved, n), dv = value_of(change, n);
                    particles.x[p] = transfer_.wrapped(particles.x[p] + m.dt * v.x);
                    particles.y[p] += m.dt * v.y;
                    if (scene_.affine) {
                        energies.kinetic += take_field(particles, p, run, n, last, moved, m.dt);
                    } else {
                        particles.velocity_x[p] = m.replace_velocity ? v.x : particles.velocity_x[p] + dv.x;
                        particles.velocity_y[p] = m.replace_velocity ? v.y : particles.velocity_y[p] + dv.y;
                    }
                    energies.of_increments += 0.5 * particles.mass[p] * (dv.x * dv.x + dv.y * dv.y);
                }
            });
        });
        ParticleEnergies sum;
        for (const ParticleEnergies& run : energies_)
            sum.add(run);
        return sum;
    }

    [[nodiscard]] std::size_t memory_bytes() const override {
        return transfer_.memory_bytes() + sizeof(double) * (volume_.capacity() + inverse_radius_.capacity()) +
               sizeof(PointTangent) * tangent_.capacity() + sizeof(MovedTangent) * moved_tangent_.capacity() +
               sizeof(ParticleEnergies) * energies_.capacity();
    }

private:
    static constexpr bool axisymmetric = geometry == Geometry::axisymmetric;
    static constexpr int support = Shape::support, seen = support * support;
    using Run = typename Transfer<Shape>::Run;
    using PointTangent = GradientTangent<geometry>;
    using MovedTangent = PiolaTangent<geometry>;

    /// How a law and a scene see a step: strain alone; with Jaumann's turn; or the configuration that forces act on, too.
    enum class Kinematics { strained, turning, moved };
    template <Kinematics kinematics> using Constant = std::integral_constant<Kinematics, kinematics>;

    struct Vector {
        double x, y;
    };
    /// Two components at the nodes that a run sees.
    struct Local {
        double x[seen], y[seen];
    };
    struct Weights {
        Factors<support> x, y;
        double inverse_radius;

        [[nodiscard]] double value(int k) const { return x.w[k % support] * y.w[k / support]; }
    };

    static constexpr std::size_t batch = 8;
    /// Particles in a step, with Jaumann's turn of their old stress in `start`; `stress` is the trial one until it is corrected.
    struct Batch {
        VelocityGradient l[batch];
        SymmetricTensor start[batch], strain[batch], stress[batch];
        Deformation f[batch]; ///< of a moved configuration
    };

    static std::size_t begin(const Run& run) { return static_cast<std::size_t>(run.begin); }
    static std::size_t end(const Run& run) { return static_cast<std::size_t>(run.end); }

    /// Calls `kernel(run, law, rotate)` for all runs; the law is looked up once for neighbouring runs of one material.
    template <class Kernel> void visit_runs(const Kernel& kernel) const {
        transfer_.for_each_stripe([&](std::span<const Run> runs) {
            for (std::size_t first = 0, last = 0; first < runs.size(); first = last) {
                while (last < runs.size() && runs[last].material == runs[first].material)
                    ++last;
                const Law& law = scene_.materials[static_cast<std::size_t>(runs[first].material)].law;
                const bool moved = midpoint_ || law->finite_strain();
                for (const Run& run : runs.subspan(first, last - first))
                    if (moved)
                        kernel(run, law, Constant<Kinematics::moved>{});
                    else if (scene_.finite_rotation)
                        kernel(run, law, Constant<Kinematics::turning>{});
                    else
                        kernel(run, law, Constant<Kinematics::strained>{});
            }
        });
    }

    /// Affine transfers: the particle takes the field of the nodes around it. Returns by how much its kinetic energy grows.
    double take_field(Particles& particles, std::size_t p, const Run& run, const Weights& n, const Local& last,
                      const Local& moved, double dt) const {
        const Weights field = affine_field(run.first, n);
        const VelocityGradient c = gradient(last, field);
        const Deformation affine =
            over({c.xx, c.xy, c.yx, c.yy, 0.0}, deformation<Geometry::plane_strain>(gradient(moved, field), dt));
        const double numbers[4] = {affine.xx, affine.xy, affine.yx, affine.yy};
        for (std::size_t k = 0; k < 4; ++k)
            particles.affine[k][p] = numbers[k];
        const Vector v = value_of(last, n);
        double &x = particles.velocity_x[p], &y = particles.velocity_y[p];
        const double before = x * x + y * y;
        x = v.x;
        y = v.y;
        return 0.5 * particles.mass[p] * (x * x + y * y - before);
    }

    /// Calls `visit(first, count)` for the particles of a run, as many at a time as a Batch holds.
    [[gnu::DUCTILE_ALWAYS_INLINE]] static void for_each_batch(const Run& run, const auto& visit) {
        for (std::size_t first = begin(run); first < end(run); first += batch)
            visit(first, std::min(batch, end(run) - first));
    }

    struct InternalArrays {
        const double* row[most_variables];
    };
    static InternalArrays internal_of(const Particles& particles, std::size_t first) {
        InternalArrays arrays;
        for (std::size_t k = 0; k < particles.internal.size(); ++k)
            arrays.row[k] = particles.internal[k].data() + first;
        return arrays;
    }

    /// The trial stress (2.2.21) of `count` particles in a step of dt seconds with the velocity v at the nodes.
    template <Kinematics kinematics>
    [[gnu::DUCTILE_ALWAYS_INLINE]] void strain(const Law& law, const Particles& particles, std::size_t first, std::size_t count,
                                               const Local& v, double dt, Batch& b) const {
        for (std::size_t i = 0; i < count; ++i) {
            b.l[i] = gradient(v, at(first + i));
            const SymmetricTensor old = stress_of(particles, first + i);
            b.start[i] = kinematics == Kinematics::turning ? turned(old, spin(b.l[i], dt)) : old;
            b.strain[i] = strain_increment<geometry>(b.l[i], dt);
        }
        if constexpr (geometry == Geometry::plane_stress)
            law->release_thickness(count, b.start, internal_of(particles, first).row, dt, b.strain);
        for (std::size_t i = 0; i < count; ++i)
            b.stress[i] = b.start[i] + elastic_stress(law->elasticity(), b.strain[i]);
    }

    [[gnu::DUCTILE_ALWAYS_INLINE]] static void correct(const Law& law, const Particles& particles, std::size_t first,
                                                       std::size_t count, double dt, Batch& b, Arrays internal_end) {
        if (!law->linear())
            law->correct(count, b.stress, internal_of(particles, first).row, dt, b.stress, internal_end);
    }

    /// Stress, deformation and energies of a step of dt seconds with the velocity v, whose forces act on a moved configuration.
    /// By the midpoint rule b.l is g/dt (point_update.hpp), b.start the stress of the beginning, turned to the end.
    void move(const Law& law, const Particles& particles, std::size_t first, std::size_t count, const Local& v, double dt,
              Batch& b, Arrays internal_end, StepWork* work) const {
        const InternalArrays internal = internal_of(particles, first);
        for (std::size_t i = 0; i < count; ++i) {
            const VelocityGradient l = gradient(v, at(first + i));
            b.f[i] = deformation<geometry>(l, dt);
            if (midpoint_) {
                const Deformation there = over({l.xx, l.xy, l.yx, l.yy, l.hoop}, 0.5 * b.f[i]);
                b.l[i] = {there.xx, there.xy, there.yx, there.yy, there.zz};
                b.start[i] = turned(stress_of(particles, first + i), spin(b.l[i], dt));
            }
        }
        if (const FiniteStrain* const finite = law->finite_strain()) {
            if constexpr (geometry == Geometry::plane_stress)
                finite->release_thickness(count, b.f, internal.row, dt);
            finite->correct(count, b.f, internal.row, dt, b.stress, internal_end, work);
            return;
        }
        for (std::size_t i = 0; i < count; ++i)
            b.strain[i] = half_turned(strain_increment<geometry>(b.l[i], dt), spin(b.l[i], dt));
        if constexpr (geometry == Geometry::plane_stress) {
            law->release_thickness(count, b.start, internal.row, dt, b.strain);
            for (std::size_t i = 0; i < count; ++i) // the strain is d(f)/((f + 1)/2)
                b.f[i].zz = b.strain[i].zz / (1.0 - 0.5 * b.strain[i].zz);
        }
        for (std::size_t i = 0; i < count; ++i)
            b.stress[i] = b.start[i] + elastic_stress(law->elasticity(), b.strain[i]);
        correct(law, particles, first, count, dt, b, internal_end);
        for (std::size_t i = 0; i < count; ++i) {
            const double volume = determinant(0.5 * b.f[i]);
            const SymmetricTensor twice_mean = b.start[i] + b.stress[i];
            const SymmetricTensor elastic = elastic_strain(law->elasticity(), b.stress[i] - b.start[i]);
            work[i].dissipated = law->linear() ? 0.0 : 0.5 * volume * contraction(twice_mean, b.strain[i] - elastic);
            work[i].stored = 0.5 * volume * contraction(twice_mean, b.strain[i]) - work[i].dissipated;
        }
    }

    /// From the end of a step that move() has made to the stress and deformation in its middle.
    static void go_to_middle(std::size_t count, double dt, Batch& b) {
        for (std::size_t i = 0; i < count; ++i) {
            b.stress[i] = stress_in_middle(b.start[i], b.stress[i], spin(b.l[i], dt));
            b.f[i] = 0.5 * b.f[i];
        }
    }

    void differentiate_moved(const Law& law, const Particles& particles, std::size_t first, std::size_t count, const Local& v,
                             double dt) {
        const InternalArrays internal = internal_of(particles, first);
        Batch b;
        double unused[most_variables][batch];
        double* internal_end[most_variables];
        for (std::size_t k = 0; k < most_variables; ++k)
            internal_end[k] = unused[k];
        StepWork work[batch];
        move(law, particles, first, count, v, dt, b, internal_end, work);
        SpatialTangent tangent[batch];
        if (const FiniteStrain* const finite = law->finite_strain()) {
            finite->tangent(count, b.f, internal.row, dt, tangent);
            for (std::size_t i = 0; midpoint_ && i < count; ++i)
                tangent[i] = seen_from_middle(tangent[i], 0.5 * b.f[i]);
        } else {
            Tangent small[batch];
            SymmetricTensor trial[batch];
            for (std::size_t i = 0; i < count; ++i)
                trial[i] = b.start[i] + elastic_stress(law->elasticity(), b.strain[i]);
            law->tangent(count, trial, internal.row, dt, small);
            for (std::size_t i = 0; i < count; ++i)
                tangent[i] = turned_tangent(small[i], b.start[i], b.strain[i], law->elasticity().shear_modulus, spin(b.l[i], dt));
        }
        if (midpoint_) {
            for (std::size_t i = 0; i < count; ++i)
                tangent[i] = middle_tangent(tangent[i], b.start[i], b.stress[i], spin(b.l[i], dt));
            go_to_middle(count, dt, b);
        }
        for (std::size_t i = 0; i < count; ++i) {
            MovedTangent t = midpoint_ ? differentiate_piola<geometry, SeenBy::middle>(tangent[i], b.stress[i], b.f[i])
                                       : differentiate_piola<geometry, SeenBy::end>(tangent[i], b.stress[i], b.f[i]);
            scale(t, (midpoint_ ? 0.5 * dt : dt) * volume_[first + i]);
            moved_tangent_[first + i] = t;
        }
    }

    static void scale(auto& tangent, double factor) {
        for (auto& row : tangent.entry)
            for (double& entry : row)
                entry *= factor;
    }
    static MovedTangent as_moved(const PointTangent& t) {
        constexpr int row_of[5] = {0, 2, 2, 1, 3}; // xx, xy, yx, yy, hoop
        MovedTangent moved;
        for (int r = 0; r < MovedTangent::size; ++r)
            for (int c = 0; c < MovedTangent::size; ++c)
                moved.entry[r][c] = t.entry[row_of[r]][c];
        return moved;
    }

    /// Those whose gradient is that of the affine field around a particle.
    [[gnu::DUCTILE_ALWAYS_INLINE]] Weights affine_field(std::int32_t first, const Weights& n) const {
        return {least_squares(n.x, transfer_.offsets_x(first, n.x)), least_squares(n.y, transfer_.offsets_y(first, n.y)),
                n.inverse_radius};
    }

    [[gnu::DUCTILE_ALWAYS_INLINE]] Weights at(std::size_t p) const {
        return {transfer_.factors_x(p), transfer_.factors_y(p), axisymmetric ? inverse_radius_[p] : 0.0};
    }

    [[gnu::DUCTILE_ALWAYS_INLINE]] static Local gather(const Run& run, std::span<const double> nodal) {
        Local local;
        for (int k = 0; k < seen; ++k) {
            local.x[k] = nodal[2 * run.node[k]];
            local.y[k] = nodal[2 * run.node[k] + 1];
        }
        return local;
    }

    [[gnu::DUCTILE_ALWAYS_INLINE]] static void scatter(const Run& run, const Local& sum, std::span<double> nodal) {
        for (int k = 0; k < seen; ++k) {
            nodal[2 * run.node[k]] += sum.x[k];
            nodal[2 * run.node[k] + 1] += sum.y[k];
        }
    }

    [[gnu::DUCTILE_ALWAYS_INLINE]] static Vector value_of(const Local& local, const Weights& n) {
        Vector v{0.0, 0.0};
        for (int j = 0; j < support; ++j) {
            double row_x = 0.0, row_y = 0.0;
            for (int i = 0; i < support; ++i) {
                row_x += n.x.w[i] * local.x[j * support + i];
                row_y += n.x.w[i] * local.y[j * support + i];
            }
            v.x += n.y.w[j] * row_x;
            v.y += n.y.w[j] * row_y;
        }
        return v;
    }

    [[gnu::DUCTILE_ALWAYS_INLINE]] static VelocityGradient gradient(const Local& local, const Weights& n) {
        VelocityGradient l;
        double radial = 0.0;
        for (int j = 0; j < support; ++j) {
            double x = 0.0, y = 0.0, x_slope = 0.0, y_slope = 0.0;
            for (int i = 0; i < support; ++i) {
                x += n.x.w[i] * local.x[j * support + i];
                y += n.x.w[i] * local.y[j * support + i];
                x_slope += n.x.dw[i] * local.x[j * support + i];
                y_slope += n.x.dw[i] * local.y[j * support + i];
            }
            l.xx += n.y.w[j] * x_slope;
            l.yx += n.y.w[j] * y_slope;
            l.xy += n.y.dw[j] * x;
            l.yy += n.y.dw[j] * y;
            if constexpr (axisymmetric)
                radial += n.y.w[j] * x;
        }
        l.hoop = radial * n.inverse_radius;
        return l;
    }

    static double yx_of(const SymmetricTensor& stress) { return stress.xy; }
    static double yx_of(const PiolaStress& stress) { return stress.yx; }

    /// sum -= grad N : stress, the stress multiplied by the volume
    [[gnu::DUCTILE_ALWAYS_INLINE]] static void subtract_force(Local& sum, const Weights& n, const auto& stress) {
        for (int i = 0; i < support; ++i) {
            double xx = stress.xx * n.x.dw[i];
            if constexpr (axisymmetric)
                xx += stress.zz * n.inverse_radius * n.x.w[i];
            const double xy = stress.xy * n.x.w[i], yx = yx_of(stress) * n.x.dw[i], yy = stress.yy * n.x.w[i];
            for (int j = 0; j < support; ++j) {
                sum.x[j * support + i] -= xx * n.y.w[j] + xy * n.y.dw[j];
                sum.y[j * support + i] -= yx * n.y.w[j] + yy * n.y.dw[j];
            }
        }
    }

    /// sum += |grad N : stress|, by components
    [[gnu::DUCTILE_ALWAYS_INLINE]] static void add_magnitude(Local& sum, const Weights& n, const auto& stress) {
        for (int i = 0; i < support; ++i) {
            double xx = stress.xx * n.x.dw[i];
            if constexpr (axisymmetric)
                xx += stress.zz * n.inverse_radius * n.x.w[i];
            const double xy = stress.xy * n.x.w[i], yx = yx_of(stress) * n.x.dw[i], yy = stress.yy * n.x.w[i];
            for (int j = 0; j < support; ++j) {
                sum.x[j * support + i] += std::abs(xx * n.y.w[j] + xy * n.y.dw[j]);
                sum.y[j * support + i] += std::abs(yx * n.y.w[j] + yy * n.y.dw[j]);
            }
        }
    }

    [[gnu::DUCTILE_ALWAYS_INLINE]] static void add_value(Local& sum, const Weights& n, double x, double y) {
        for (int j = 0; j < support; ++j)
            for (int i = 0; i < support; ++i) {
                sum.x[j * support + i] += n.x.w[i] * n.y.w[j] * x;
                sum.y[j * support + i] += n.x.w[i] * n.y.w[j] * y;
            }
    }

    [[gnu::DUCTILE_ALWAYS_INLINE]] static SymmetricTensor product(const PointTangent& t, const VelocityGradient& l) {
        double row[4] = {};
        for (int r = 0; r < PointTangent::rows; ++r) {
            row[r] = t.entry[r][0] * l.xx + t.entry[r][1] * l.xy + t.entry[r][2] * l.yx + t.entry[r][3] * l.yy;
            if constexpr (axisymmetric)
                row[r] += t.entry[r][4] * l.hoop;
        }
        return {row[0], row[1], row[3], row[2]};
    }
    [[gnu::DUCTILE_ALWAYS_INLINE]] static PiolaStress product(const MovedTangent& t, const VelocityGradient& l) {
        double row[5] = {};
        for (int r = 0; r < MovedTangent::size; ++r) {
            row[r] = t.entry[r][0] * l.xx + t.entry[r][1] * l.xy + t.entry[r][2] * l.yx + t.entry[r][3] * l.yy;
            if constexpr (axisymmetric)
                row[r] += t.entry[r][4] * l.hoop;
        }
        return {row[0], row[1], row[2], row[3], row[4]};
    }
    static SymmetricTensor minus(const SymmetricTensor& a) { return {-a.xx, -a.yy, -a.zz, -a.xy}; }
    static PiolaStress minus(const PiolaStress& a) { return {-a.xx, -a.xy, -a.yx, -a.yy, -a.zz}; }
    /// Calls `visit(tangents)` with those of linearise().
    void with_tangents(const auto& visit) const {
        if (moves_)
            visit(moved_tangent_);
        else
            visit(tangent_);
    }

    /// Calls `visit(k, l, block)` with the 2 x 2 block of dt K that couples the nodes k and l of the run, summed over its
    /// particles.
    void for_each_node_pair(const auto& tangents, const Run& run, const auto& visit) const {
        for (int l = 0; l < seen; ++l) {
            double block[seen][2][2] = {};
            for (std::size_t p = begin(run); p < end(run); ++p) {
                const Weights n = at(p);
                const double slope_x = n.x.dw[l % support] * n.y.w[l / support],
                             slope_y = n.x.w[l % support] * n.y.dw[l / support];
                for (int b = 0; b < 2; ++b) {
                    const VelocityGradient unit =
                        b == 0 ? VelocityGradient{slope_x, slope_y, 0.0, 0.0, n.value(l) * n.inverse_radius}
                               : VelocityGradient{0.0, 0.0, slope_x, slope_y, 0.0};
                    Local sum{};
                    subtract_force(sum, n, minus(product(tangents[p], unit)));
                    for (int k = 0; k < seen; ++k) {
                        block[k][0][b] += sum.x[k];
                        block[k][1][b] += sum.y[k];
                    }
                }
            }
            for (int k = 0; k < seen; ++k)
                visit(k, l, block[k]);
        }
    }

    double out_of_plane_strain(const Particles& particles, std::size_t p, const VelocityGradient& l, double dt) const {
        if constexpr (geometry == Geometry::plane_strain)
            return 0.0;
        if constexpr (axisymmetric)
            return dt * l.hoop;
        const Law& law = scene_.materials[static_cast<std::size_t>(particles.material[p])].law;
        if (const FiniteStrain* const finite = law->finite_strain()) {
            Deformation f = deformation<geometry>(l, dt);
            finite->release_thickness(1, &f, internal_of(particles, p).row, dt);
            return f.zz;
        }
        const SymmetricTensor old = stress_of(particles, p);
        const SymmetricTensor start = scene_.finite_rotation ? turned(old, spin(l, dt)) : old;
        SymmetricTensor strain = strain_increment<geometry>(l, dt);
        law->release_thickness(1, &start, internal_of(particles, p).row, dt, &strain);
        return strain.zz;
    }

    /// `determinant` is that of the step's deformation. Returns what is dissipated.
    double update_energies(const Law& law, Particles& particles, std::size_t p, const Batch& b, std::size_t i, double determinant,
                           double heat_capacity) const {
        const double density = particles.density[p];
        const SymmetricTensor twice_mean = b.start[i] + b.stress[i];
        // the stress of (2.2.16) is the mean of the step's: second order
        particles.energy[p] += 0.5 * contraction(twice_mean, b.strain[i]) / density;
        particles.density[p] = density / determinant;
        if (law->linear())
            return 0.0;
        const SymmetricTensor plastic = b.strain[i] - elastic_strain(law->elasticity(), b.stress[i] - b.start[i]);
        if (heat_capacity > 0.0)
            particles.temperature[p] += contraction(b.stress[i], plastic) / (particles.density[p] * heat_capacity);
        return 0.5 * volume_[p] * contraction(twice_mean, plastic);
    }

    /// The same on a moved configuration.
    static void update_energies(Particles& particles, std::size_t p, const StepWork& work, double determinant,
                                double heat_capacity) {
        const double density = particles.density[p];
        particles.energy[p] += (work.stored + work.dissipated) / density;
        particles.density[p] = density / determinant;
        if (heat_capacity > 0.0)
            particles.temperature[p] += work.dissipated / (density * heat_capacity);
    }

    Scene scene_;
    bool midpoint_; ///< forces act on the configuration in the middle of the step, whatever the law
    bool moves_;    ///< some forces act on a moved configuration
    Transfer<Shape> transfer_;
    aligned_vector<double> volume_, inverse_radius_;
    aligned_vector<PointTangent> tangent_;       // times dt V
    aligned_vector<MovedTangent> moved_tangent_; // instead, where moves_
    std::vector<ParticleEnergies> energies_;     // of the runs in the last step
};

template <class Shape> std::unique_ptr<Discretisation> make_kernels(const Scene& scene, bool midpoint) {
    switch (scene.geometry) {
    case Geometry::plane_strain:
        return std::make_unique<Kernels<Shape, Geometry::plane_strain>>(scene, midpoint);
    case Geometry::plane_stress:
        return std::make_unique<Kernels<Shape, Geometry::plane_stress>>(scene, midpoint);
    case Geometry::axisymmetric:
        break;
    }
    return std::make_unique<Kernels<Shape, Geometry::axisymmetric>>(scene, midpoint);
}

extern template std::unique_ptr<Discretisation> make_kernels<Linear>(const Scene&, bool);
extern template std::unique_ptr<Discretisation> make_kernels<Gimp>(const Scene&, bool);
extern template std::unique_ptr<Discretisation> make_kernels<BSpline>(const Scene&, bool);

} // namespace ductile::mpm
