#include <ductile/quasistatic/embedded_method.hpp>

#include <array>
#include <utility>
#include <vector>

namespace ductile::quasistatic {

namespace {

/// Coefficients of the Runge-Kutta-Chebyshev method with s stages (Sommeijer, Shampine & Verwer, J. Comput. Appl. Math. 88,
/// 1998):
///   w0 = 1 + eps/s^2 (eps = 2/13), w1 = T_s'(w0)/T_s''(w0), b_j = T_j''(w0)/T_j'(w0)^2 (b_0 = b_1 = b_2), a_j = 1 - b_j T_j(w0),
///   Y_1 = y_n + mu~_1 dt F_0,  mu~_1 = b_1 w1,
///   Y_j = (1 - mu_j - nu_j) y_n + mu_j Y_{j-1} + nu_j Y_{j-2} + mu~_j dt F_{j-1} + gamma~_j dt F_0,
///   mu_j = 2 b_j w0/b_{j-1}, nu_j = -b_j/b_{j-2}, mu~_j = 2 b_j w1/b_{j-1}, gamma~_j = -a_{j-1} mu~_j,
///   c_j = (T_s'/T_s'') (T_j''/T_j'), c_1 = c_2/(4 w0).
struct Coefficients {
    struct Stage {
        double mu = 0.0, nu = 0.0, mu_tilde = 0.0, gamma_tilde = 0.0, c = 0.0;
    };
    std::vector<Stage> stages; ///< 1 .. s, the first with mu_tilde and c only; index 0 is unused

    explicit Coefficients(int s) : stages(static_cast<std::size_t>(s) + 1) {
        const double w0 = 1.0 + 2.0 / 13.0 / (s * s);
        const std::size_t n = stages.size();
        std::vector<double> t(n), d1(n), d2(n), b(n); // T_j, T_j', T_j'' at w0
        t[0] = 1.0;
        t[1] = w0;
        d1[1] = 1.0;
        for (std::size_t j = 2; j < n; ++j) {
            t[j] = 2.0 * w0 * t[j - 1] - t[j - 2];
            d1[j] = 2.0 * t[j - 1] + 2.0 * w0 * d1[j - 1] - d1[j - 2];
            d2[j] = 4.0 * d1[j - 1] + 2.0 * w0 * d2[j - 1] - d2[j - 2];
        }
        const double w1 = d1[n - 1] / d2[n - 1];
        for (std::size_t j = 2; j < n; ++j)
            b[j] = d2[j] / (d1[j] * d1[j]);
        b[0] = b[1] = b[2];
        stages[1].mu_tilde = b[1] * w1;
        for (std::size_t j = 2; j < n; ++j) {
            Stage& stage = stages[j];
            stage.mu = 2.0 * b[j] * w0 / b[j - 1];
            stage.nu = -b[j] / b[j - 2];
            stage.mu_tilde = 2.0 * b[j] * w1 / b[j - 1];
            stage.gamma_tilde = -(1.0 - b[j - 1] * t[j - 1]) * stage.mu_tilde;
            stage.c = w1 * d2[j] / d1[j];
        }
        stages[1].c = stages[2].c / (4.0 * w0);
    }
};

/// The real stability interval of s stages, with damping.
double stability(int s) { return 2.0 / 3.0 * (s * s - 1.0) * (1.0 - 2.0 / 15.0 * 2.0 / 13.0); }

/// Round-off grows with the square of the number of stages: 1e-11 of the stress at most.
constexpr int most_stages = 300;

/// The relaxation rate may grow during the step.
constexpr double margin = 1.1;

int stages_for(double dt, double relaxation) {
    int s = 2;
    while (s < most_stages && stability(s) < margin * dt * relaxation)
        ++s;
    return s;
}

class ChebyshevMethod final : public EmbeddedMethod {
public:
    explicit ChebyshevMethod(const Scene& scene) : other_(scene) {}

    [[nodiscard]] Scheme scheme() const override { return Scheme::chebyshev; }

    [[nodiscard]] CombinationNorm advance(const Stages& stages, double dt) override {
        const int s = stages_for(dt, stages.relaxation);
        const Coefficients coefficients(s);

        // Y_{j-1} and Y_{j-2} live in next and other_, in turns, such that Y_s ends in next
        CellState* latest = s % 2 == 1 ? &stages.next : &other_;
        CellState* before = s % 2 == 1 ? &other_ : &stages.next;
        const std::array first{Term{&stages.start, 1.0}, Term{&stages.start_rate, dt * coefficients.stages[1].mu_tilde}};
        combine(stages.scene, first, *latest);
        for (int j = 2; j <= s; ++j) {
            const auto& c = coefficients.stages[static_cast<std::size_t>(j)];
            const VectorField& velocity =
                stages.evaluate(*latest, coefficients.stages[static_cast<std::size_t>(j - 1)].c, stages.next_rate);
            std::array<Term, 4> terms{Term{&stages.start, 1.0 - c.mu - c.nu}, Term{latest, c.mu},
                                      Term{&stages.start_rate, dt * c.gamma_tilde}, Term{before, c.nu}};
            if (j == 2) // Y_0 = y_n
                terms[3].fields = &stages.start;
            combine(stages.scene, terms, {&stages.next_rate, &velocity, dt * c.mu_tilde, false}, *before);
            std::swap(latest, before);
        }
        const VectorField& velocity = stages.evaluate(stages.next, 1.0, stages.next_rate);
        close_rate(stages.scene, velocity, stages.next_rate);
        const std::array error{Term{&stages.start, 0.8}, Term{&stages.next, -0.8}, Term{&stages.start_rate, 0.4 * dt},
                               Term{&stages.next_rate, 0.4 * dt}};
        return norm(stages.scene, error);
    }

    [[nodiscard]] double relaxation_step(double relaxation) const override {
        return stability(most_stages) / (margin * relaxation);
    }
    /// More stages widen the stability region along the real axis only.
    [[nodiscard]] double courant_number() const override { return 0.5; }
    [[nodiscard]] double evaluations(double dt, double relaxation) const override { return stages_for(dt, relaxation); }
    [[nodiscard]] int buffers() const override { return 1; }

private:
    CellState other_;
};

} // namespace

std::unique_ptr<EmbeddedMethod> chebyshev_method(const Scene& scene) { return std::make_unique<ChebyshevMethod>(scene); }

} // namespace ductile::quasistatic
