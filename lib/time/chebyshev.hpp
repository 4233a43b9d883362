// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/time/method.hpp>

#include <array>
#include <utility>

namespace ductile::time {

/// Coefficients of the Runge-Kutta-Chebyshev method with s stages (Sommeijer, Shampine & Verwer, J. Comput. Appl. Math. 88,
/// 1998):
///   w0 = 1 + eps/s^2 (eps = 2/13), w1 = T_s'(w0)/T_s''(w0), b_j = T_j''(w0)/T_j'(w0)^2 (b_0 = b_1 = b_2), a_j = 1 - b_j T_j(w0),
///   Y_1 = y_n + mu~_1 dt F_0,  mu~_1 = b_1 w1,
///   Y_j = (1 - mu_j - nu_j) y_n + mu_j Y_{j-1} + nu_j Y_{j-2} + mu~_j dt F_{j-1} + gamma~_j dt F_0,
///   mu_j = 2 b_j w0/b_{j-1}, nu_j = -b_j/b_{j-2}, mu~_j = 2 b_j w1/b_{j-1}, gamma~_j = -a_{j-1} mu~_j,
///   c_j = (T_s'/T_s'') (T_j''/T_j'), c_1 = c_2/(4 w0).
struct ChebyshevCoefficients {
    struct Stage {
        double mu = 0.0, nu = 0.0, mu_tilde = 0.0, gamma_tilde = 0.0, c = 0.0;
    };
    std::vector<Stage> stages; ///< 1 .. s, the first with mu_tilde and c only; index 0 is unused

    explicit ChebyshevCoefficients(int s);
};

/// The fewest stages that hold a step of dt stable with some margin where flow decays at `relaxation`.
[[nodiscard]] int chebyshev_stages(double dt, double relaxation);
/// The longest step that any number of stages holds stable.
[[nodiscard]] double longest_chebyshev_step(double relaxation);

/// The stabilised Runge-Kutta-Chebyshev method of second order, the estimate of whose error falls with dt^3; the number of stages
/// follows the fastest decay.
template <class Vector> class Chebyshev final : public Method<Vector> {
public:
    explicit Chebyshev(System<Vector>& system) : system_(system), other_(system.make()) {}

    [[nodiscard]] double advance(const Step<Vector>& step) override {
        using Term = Term<Vector>;
        const int s = chebyshev_stages(step.dt, step.relaxation);
        if (coefficients_.stages.size() != static_cast<std::size_t>(s) + 1)
            coefficients_ = ChebyshevCoefficients(s);

        // Y_{j-1} and Y_{j-2} live in next and other_, in turns, such that Y_s ends in next
        Vector* latest = s % 2 == 1 ? &step.next : &other_;
        Vector* before = s % 2 == 1 ? &other_ : &step.next;
        const std::array first{Term{&step.start, 1.0}, Term{&step.start_rate, step.dt * coefficients_.stages[1].mu_tilde}};
        system_.combine(first, *latest);
        for (int j = 2; j <= s; ++j) {
            const auto& c = coefficients_.stages[static_cast<std::size_t>(j)];
            const auto open = system_.evaluate(*latest, coefficients_.stages[static_cast<std::size_t>(j - 1)].c, step.next_rate);
            std::array<Term, 4> terms{Term{&step.start, 1.0 - c.mu - c.nu}, Term{latest, c.mu},
                                      Term{&step.start_rate, step.dt * c.gamma_tilde}, Term{before, c.nu}};
            if (j == 2) // Y_0 = y_n
                terms[3].vector = &step.start;
            system_.combine(terms, open, step.dt * c.mu_tilde, Completed::dropped, *before);
            std::swap(latest, before);
        }
        system_.close(system_.evaluate(step.next, 1.0, step.next_rate));
        const std::array error{Term{&step.start, 0.8}, Term{&step.next, -0.8}, Term{&step.start_rate, 0.4 * step.dt},
                               Term{&step.next_rate, 0.4 * step.dt}};
        return system_.norm(error);
    }

    [[nodiscard]] bool interpolates() const override { return true; }
    void interpolate(const Step<Vector>& step, double fraction, Vector& y) const override {
        system_.combine(cubic_within(step, fraction), y);
    }

    [[nodiscard]] double relaxation_step(double relaxation, std::span<const double>) const override {
        return longest_chebyshev_step(relaxation);
    }
    /// More stages widen the stability region along the real axis only.
    [[nodiscard]] double courant_number(std::span<const double>) const override { return 0.5; }
    [[nodiscard]] double evaluations(double dt, double relaxation) const override { return chebyshev_stages(dt, relaxation); }
    [[nodiscard]] int buffers() const override { return 1; }

private:
    System<Vector>& system_;
    Vector other_;
    ChebyshevCoefficients coefficients_{2}; // of the last step
};

} // namespace ductile::time
