// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/material/law.hpp>
#include <ductile/material/step_form.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

namespace ductile {

// Isotropic laws at finite strain have an energy W(b) of the elastic left Cauchy-Green tensor b = F_e F_e^T, by volume of the
// undeformed body. With J = det F the stresses are
//   tau = J sigma = 2 b dW/db   (Kirchhoff's and Cauchy's).
// A step deforms its beginning by f (F = f F^k). Flow that keeps the volume, det F_e = J, begins from b* = f b^k f^T.
// A point keeps h = b - 1 in its last four internal variables: what is nothing in an undeformed body, and exact where it is
// small,
//   h* = d + d^T + d d^T + f h f^T,   d = f - 1.

/// The deformation f of a step less the unit tensor: xy = d(x)/d(Y). Out of the plane only zz.
struct Deformation {
    double xx = 0.0, xy = 0.0, yx = 0.0, yy = 0.0, zz = 0.0;
};

/// d(stress) by a displacement with the gradient l from where the step ends, f -> (1 + l) f. Rows: stress xx, yy, zz, xy;
/// columns: l_xx, l_xy, l_yx, l_yy, l_zz.
struct SpatialTangent {
    double entry[4][5] = {};
};

/// Energies of a step by volume at its beginning.
struct StepWork {
    double stored = 0.0;     ///< the growth of W/J^k
    double dissipated = 0.0; ///< by plastic flow
};

/// The functions of a law at finite strain: of `count` points with internal variables internal[0][i], internal[1][i], ...
class FiniteStrain {
public:
    virtual ~FiniteStrain() = default;

    /// Cauchy stress, internal variables and energies of a step of dt seconds with the deformation f. `internal_end` may be
    /// `internal`.
    virtual void correct(std::size_t count, const Deformation* f, ConstArrays internal, double dt, SymmetricTensor* stress,
                         Arrays internal_end, StepWork* work) const = 0;
    /// The derivative of that stress.
    virtual void tangent(std::size_t count, const Deformation* f, ConstArrays internal, double dt,
                         SpatialTangent* tangent) const = 0;
    /// Plane stress: sets f.zz such that sigma_zz = 0 at the end of the step, by Newton's method.
    virtual void release_thickness(std::size_t count, Deformation* f, ConstArrays internal, double dt) const = 0;

protected:
    FiniteStrain() = default;
    FiniteStrain(const FiniteStrain&) = default;
    FiniteStrain& operator=(const FiniteStrain&) = default;
};

/// h* of above.
[[nodiscard]] inline SymmetricTensor deformed(const SymmetricTensor& h, const Deformation& d) {
    const double fxx = 1.0 + d.xx, fyy = 1.0 + d.yy;
    const double xx = fxx * h.xx + d.xy * h.xy, xy = fxx * h.xy + d.xy * h.yy; // f h
    const double yx = d.yx * h.xx + fyy * h.xy, yy = d.yx * h.xy + fyy * h.yy;
    return {2.0 * d.xx + d.xx * d.xx + d.xy * d.xy + xx * fxx + xy * d.xy,
            2.0 * d.yy + d.yy * d.yy + d.yx * d.yx + yx * d.yx + yy * fyy,
            d.zz * (2.0 + d.zz) + (1.0 + d.zz) * (1.0 + d.zz) * h.zz,
            d.xy + d.yx + d.xx * d.yx + d.xy * d.yy + xx * d.yx + xy * fyy};
}

/// Of b in the plane, by h: the mean (ln b_1 + ln b_2)/4 of Hencky's strains, and (ln b_1 - ln b_2)/(b_1 - b_2), which is 1/b
/// where both are b.
struct PlaneLogarithm {
    double strain, slope;

    explicit PlaneLogarithm(const SymmetricTensor& h) {
        const double mean = 0.5 * (h.xx + h.yy), radius = std::hypot(0.5 * (h.xx - h.yy), h.xy);
        strain = 0.25 * std::log1p(2.0 * mean + mean * mean - radius * radius);
        const double ratio = 2.0 * radius / (1.0 + mean - radius); // b_1/b_2 - 1
        slope = ratio > 1e-12 ? std::log1p(ratio) / (2.0 * radius) : 1.0 / (1.0 + mean);
    }
};

/// ln J of elastic deformation with this h.
[[nodiscard]] inline double log_volume(const SymmetricTensor& h) {
    return 2.0 * PlaneLogarithm(h).strain + 0.5 * std::log1p(h.zz);
}

/// 1/J.
[[nodiscard]] inline double inverse_volume(const SymmetricTensor& h) {
    return 1.0 / std::sqrt(((1.0 + h.xx) * (1.0 + h.yy) - h.xy * h.xy) * (1.0 + h.zz));
}

/// Hencky's strain ln(b)/2.
[[nodiscard]] inline SymmetricTensor logarithmic_strain(const SymmetricTensor& h) {
    const PlaneLogarithm log(h);
    const double half_difference = 0.25 * log.slope * (h.xx - h.yy);
    return {log.strain + half_difference, log.strain - half_difference, 0.5 * std::log1p(h.zz), 0.5 * log.slope * h.xy};
}

/// h = exp(2 strain) - 1, its inverse.
[[nodiscard]] inline SymmetricTensor stretch_of(const SymmetricTensor& strain) {
    const double mean = strain.xx + strain.yy, difference = strain.xx - strain.yy, shear = 2.0 * strain.xy;
    const double radius = std::hypot(difference, shear), half = std::sinh(0.5 * radius), factor = std::exp(mean);
    const double even = std::expm1(mean) + 2.0 * factor * half * half; // of exp(mean) cosh(radius) - 1
    const double odd = radius > 1e-12 ? factor * std::sinh(radius) / radius : factor;
    return {even + odd * difference, even - odd * difference, std::expm1(2.0 * strain.zz), odd * shear};
}

/// What a law at finite strain makes of a step: all in the undeformed volume.
template <std::size_t n> struct StretchReturn {
    SymmetricTensor stress = {}; ///< Kirchhoff's
    SymmetricTensor h = {};
    std::array<double, n> internal = {};
    double dissipated = 0.0;
};

/// What a law at finite strain offers, with n internal variables besides h, and flow that keeps the volume:
/// - `variables()`, `elasticity()` (at small strain), `yield_stress(internal)`: as in StepForm;
/// - `correct(h, h*, internal, dt)`: the step from h^k to h* and back to yield;
/// - `tangent(h*, internal, dt)`: the derivative of the Kirchhoff stress by l;
/// - `energy(h)`: W.
template <class L>
concept FiniteForm = requires(const L law, const SymmetricTensor& h, const std::array<double, variable_count<L>>& internal,
                              double dt) {
    { law.elasticity() } -> std::same_as<const IsotropicElasticity&>;
    { law.correct(h, h, internal, dt) } -> std::same_as<StretchReturn<variable_count<L>>>;
    { law.tangent(h, internal, dt) } -> std::same_as<SpatialTangent>;
    { law.yield_stress(internal) } -> std::same_as<double>;
    { law.energy(h) } -> std::same_as<double>;
};

/// A compressible neo-Hookean solid, W = mu/2 (tr b - 3) - mu ln J + lambda/2 (ln J)^2:
///   tau = mu (b - 1) + lambda ln J,   d(tau) = mu (l b + b l^T) + lambda tr(l).
class NeoHookean {
public:
    explicit NeoHookean(const IsotropicElasticity& elasticity) : elasticity_(elasticity) { check(elasticity); }

    [[nodiscard]] const IsotropicElasticity& elasticity() const { return elasticity_; }
    [[nodiscard]] static std::array<InternalVariable, 0> variables() { return {}; }
    [[nodiscard]] double yield_stress(const std::array<double, 0>&) const { return std::numeric_limits<double>::infinity(); }
    [[nodiscard]] StretchReturn<0> correct(const SymmetricTensor&, const SymmetricTensor& h, const std::array<double, 0>&,
                                           double) const {
        const double volumetric = elasticity_.beta() * log_volume(h);
        return {elasticity_.shear_modulus * h + SymmetricTensor{volumetric, volumetric, volumetric, 0.0}, h, {}, 0.0};
    }
    [[nodiscard]] SpatialTangent tangent(const SymmetricTensor& h, const std::array<double, 0>&, double) const {
        const double mu = elasticity_.shear_modulus, lambda = elasticity_.beta();
        const double xx = mu * (1.0 + h.xx), yy = mu * (1.0 + h.yy), zz = mu * (1.0 + h.zz), xy = mu * h.xy;
        return {{{2.0 * xx + lambda, 2.0 * xy, 0.0, lambda, lambda},
                 {lambda, 0.0, 2.0 * xy, 2.0 * yy + lambda, lambda},
                 {lambda, 0.0, 0.0, lambda, 2.0 * zz + lambda},
                 {xy, yy, xx, xy, 0.0}}};
    }
    [[nodiscard]] double energy(const SymmetricTensor& h) const {
        const double log = log_volume(h);
        return elasticity_.shear_modulus * (0.5 * trace(h) - log) + 0.5 * elasticity_.beta() * log * log;
    }

private:
    IsotropicElasticity elasticity_;
};

/// A law in step form with logarithmic strain: Hencky's elasticity, W = K/2 (tr e)^2 + mu dev e : dev e with e = ln(b)/2, so that
/// tau = C : e, and multiplicative flow, whose exponential map makes of every return mapping at small strain one at finite strain
/// (Simo 1992): e* comes in for the trial strain, tau for the stress. What flow dissipates is that between the flow stresses of
/// both ends, times the equivalent of the strain e* - e.
template <StepForm L> class Hencky {
    static_assert(L::isochoric, "flow must keep the volume");

public:
    static constexpr std::size_t n = variable_count<L>;
    explicit Hencky(const L& law) : law_(law) {}

    [[nodiscard]] const IsotropicElasticity& elasticity() const { return law_.elasticity(); }
    [[nodiscard]] auto variables() const { return law_.variables(); }
    [[nodiscard]] double yield_stress(const std::array<double, n>& internal) const { return law_.yield_stress(internal); }

    [[nodiscard]] StretchReturn<n> correct(const SymmetricTensor& before, const SymmetricTensor& h,
                                           const std::array<double, n>& internal, double dt) const {
        const SymmetricTensor trial = elastic_stress(elasticity(), logarithmic_strain(h));
        const StressReturn<n> end = law_.correct(trial, internal, dt);
        if (L::linear || equivalent_stress(trial) <= law_.yield_stress(internal))
            return {end.stress, h, end.internal, 0.0};
        const SymmetricTensor plastic = elastic_strain(elasticity(), trial - end.stress);
        const double q = equivalent_stress(end.stress);
        const double first =
            std::max(law_.yield_stress(internal), equivalent_stress(elastic_stress(elasticity(), logarithmic_strain(before))));
        const double strain = std::sqrt(2.0 / 3.0 * contraction(plastic, plastic));
        return {end.stress, stretch_of(elastic_strain(elasticity(), end.stress)), end.internal, 0.5 * (first + q) * strain};
    }

    /// d(e*) of l: in the principal frame of b* the diagonal is that of l, and
    ///   d(e*)_12 = s/2 (l_12 b_2 + l_21 b_1),   s = (ln b_1 - ln b_2)/(b_1 - b_2).
    [[nodiscard]] SpatialTangent tangent(const SymmetricTensor& h, const std::array<double, n>& internal, double dt) const {
        const Tangent small = law_.tangent(elastic_stress(elasticity(), logarithmic_strain(h)), internal, dt);
        const double slope = PlaneLogarithm(h).slope;
        const double mean = 1.0 + 0.5 * (h.xx + h.yy), radius = std::hypot(0.5 * (h.xx - h.yy), h.xy);
        // cosine and sine of twice the angle of the first principal direction
        const double c = radius > 0.0 ? 0.5 * (h.xx - h.yy) / radius : 1.0, s = radius > 0.0 ? h.xy / radius : 0.0;
        SpatialTangent t;
        for (int j = 0; j < 5; ++j) {
            const double xx = j == 0, xy = j == 1, yx = j == 2, yy = j == 3, zz = j == 4;
            const double half_sum = 0.5 * (xx + yy), half_difference = 0.5 * (xx - yy), shear = 0.5 * (xy + yx),
                         spin = 0.5 * (yx - xy);
            const double along = c * half_difference + s * shear;
            const double across = slope * (mean * (c * shear - s * half_difference) + radius * spin);
            const double strain[4] = {half_sum + c * along - s * across, half_sum - c * along + s * across, zz,
                                      2.0 * (s * along + c * across)};
            for (int i = 0; i < 4; ++i)
                for (int k = 0; k < 4; ++k)
                    t.entry[i][j] += small.entry[i][k] * strain[k];
        }
        return t;
    }

    [[nodiscard]] double energy(const SymmetricTensor& h) const {
        const SymmetricTensor strain = logarithmic_strain(h);
        return 0.5 * contraction(elastic_stress(elasticity(), strain), strain);
    }

private:
    L law_;
};

namespace detail {

/// The components of h among the internal variables, as files call them. All bodies begin undeformed.
inline constexpr std::array<InternalVariable, 4> stretch_variables{{{.name = "elastic_stretch_xx", .unit = "1"},
                                                                    {.name = "elastic_stretch_yy", .unit = "1"},
                                                                    {.name = "elastic_stretch_zz", .unit = "1"},
                                                                    {.name = "elastic_stretch_xy", .unit = "1"}}};

/// A law by its form at finite strain; it has neither rates nor steps of small strain.
template <FiniteForm L> class FiniteLawOf final : public Law::Interface, public FiniteStrain {
    static constexpr std::size_t n = variable_count<L>;
    static_assert(n + 4 <= most_variables);

public:
    explicit FiniteLawOf(const L& law) : Interface(law.elasticity(), list_of(law.variables())), law_(law) {}

    [[nodiscard]] const FiniteStrain* finite_strain() const override { return this; }
    [[nodiscard]] bool linear() const override { return false; }
    [[nodiscard]] double equivalent_yield_stress(std::span<const double> internal) const override {
        std::array<double, n> own;
        std::copy_n(internal.begin(), n, own.begin());
        return law_.yield_stress(own);
    }
    [[nodiscard]] double stored_energy(const SymmetricTensor&, std::span<const double> internal) const override {
        const SymmetricTensor h{internal[n], internal[n + 1], internal[n + 2], internal[n + 3]};
        return law_.energy(h) * inverse_volume(h);
    }

    void correct(std::size_t count, const Deformation* f, ConstArrays internal, double dt, SymmetricTensor* stress,
                 Arrays internal_end, StepWork* work) const override {
        for (std::size_t i = 0; i < count; ++i) {
            const SymmetricTensor before = stretch_at(internal, i), trial = deformed(before, f[i]);
            const StretchReturn<n> end = law_.correct(before, trial, own_at(internal, i), dt);
            stress[i] = inverse_volume(trial) * end.stress;
            const double at_beginning = inverse_volume(before);
            work[i] = {at_beginning * (law_.energy(end.h) - law_.energy(before)), at_beginning * end.dissipated};
            for (std::size_t k = 0; k < n; ++k)
                internal_end[k][i] = end.internal[k];
            internal_end[n][i] = end.h.xx;
            internal_end[n + 1][i] = end.h.yy;
            internal_end[n + 2][i] = end.h.zz;
            internal_end[n + 3][i] = end.h.xy;
        }
    }

    void tangent(std::size_t count, const Deformation* f, ConstArrays internal, double dt, SpatialTangent* t) const override {
        for (std::size_t i = 0; i < count; ++i)
            t[i] = cauchy_tangent(f[i], internal, i, dt);
    }

    void release_thickness(std::size_t count, Deformation* f, ConstArrays internal, double dt) const override {
        const IsotropicElasticity& e = elasticity();
        for (std::size_t i = 0; i < count; ++i) {
            f[i].zz = -e.beta() / e.alpha() * (f[i].xx + f[i].yy);
            for (int iteration = 0; iteration < 50; ++iteration) {
                const double excess = cauchy_stress(f[i], internal, i, dt).zz;
                if (!(std::abs(excess) > 1e-14 * e.alpha()))
                    break;
                // a tenth of the thickness must be left, whatever Newton's method would make of it
                const double stretch = -excess / cauchy_tangent(f[i], internal, i, dt).entry[2][4];
                f[i].zz += (1.0 + f[i].zz) * std::max(stretch, -0.9);
            }
        }
    }

    // what a law of small strain has
    [[nodiscard]] bool has_rates() const override { return false; }
    [[nodiscard]] FlowAt flow_at(double, std::span<const double>) const override { throw no_rates(); }
    void add_flow_rate(const double*, double*) const override { throw no_rates(); }
    void yield_stress(int, ConstArrays, double*) const override { throw no_rates(); }
    FlowSums add_flow_rates(int, ConstArrays, Arrays) const override { throw no_rates(); }
    double flow_by_euler(int, ConstArrays, Arrays, double) const override { throw no_rates(); }
    double flow_by_substeps(int, ConstArrays, Arrays, double, const Rk21Options&, Rk21Counts&) const override {
        throw no_rates();
    }
    void correct(std::size_t, const SymmetricTensor*, ConstArrays, double, SymmetricTensor*, Arrays) const override {
        throw no_rates();
    }
    void tangent(std::size_t, const SymmetricTensor*, ConstArrays, double, Tangent*) const override { throw no_rates(); }
    void release_thickness(std::size_t, const SymmetricTensor*, ConstArrays, double, SymmetricTensor*) const override {
        throw no_rates();
    }

private:
    static std::logic_error no_rates() { return std::logic_error("a law at finite strain knows deformations, not rates"); }
    static std::vector<InternalVariable> list_of(const std::array<InternalVariable, n>& own) {
        std::vector<InternalVariable> all(own.begin(), own.end());
        all.insert(all.end(), stretch_variables.begin(), stretch_variables.end());
        return all;
    }
    static std::array<double, n> own_at(ConstArrays internal, std::size_t i) {
        std::array<double, n> own;
        for (std::size_t k = 0; k < n; ++k)
            own[k] = internal[k][i];
        return own;
    }
    static SymmetricTensor stretch_at(ConstArrays internal, std::size_t i) {
        return {internal[n][i], internal[n + 1][i], internal[n + 2][i], internal[n + 3][i]};
    }
    [[nodiscard]] SymmetricTensor cauchy_stress(const Deformation& f, ConstArrays internal, std::size_t i, double dt) const {
        const SymmetricTensor before = stretch_at(internal, i), trial = deformed(before, f);
        return inverse_volume(trial) * law_.correct(before, trial, own_at(internal, i), dt).stress;
    }
    /// d(sigma) = d(tau)/J - sigma tr(l)
    [[nodiscard]] SpatialTangent cauchy_tangent(const Deformation& f, ConstArrays internal, std::size_t i, double dt) const {
        const SymmetricTensor trial = deformed(stretch_at(internal, i), f), sigma = cauchy_stress(f, internal, i, dt);
        SpatialTangent t = law_.tangent(trial, own_at(internal, i), dt);
        const double inverse = inverse_volume(trial), stress[4] = {sigma.xx, sigma.yy, sigma.zz, sigma.xy};
        for (int r = 0; r < 4; ++r)
            for (int j = 0; j < 5; ++j)
                t.entry[r][j] = inverse * t.entry[r][j] - (j == 1 || j == 2 ? 0.0 : stress[r]);
        return t;
    }

    L law_;
};

} // namespace detail

/// A law from its form at finite strain, for particles.
template <FiniteForm L> [[nodiscard]] Law make_finite_law(const L& law) {
    return Law(std::make_shared<detail::FiniteLawOf<L>>(law));
}

} // namespace ductile
