// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/vectorise.hpp>
#include <ductile/space/modes.hpp>
#include <ductile/space/stencil.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace ductile {
namespace {

struct Symmetric {
    double uu, uv, vv;
};

Symmetric inverse(const Symmetric& s) {
    const double determinant = s.uu * s.vv - s.uv * s.uv;
    return {s.vv / determinant, -s.uv / determinant, s.uu / determinant};
}

/// One mode's blocks: A = diag(uu, vv) and U = (a, -e; e, d).
struct ModeBlocks {
    double uu, vv, a, d, e;

    ModeBlocks(const Grid& grid, const IsotropicElasticity& elasticity, Stiffness stiffness, int k) {
        const double alpha = elasticity.alpha(), mu = elasticity.shear_modulus;
        const double dy_dx = grid.dy() / grid.dx(), dx_dy = grid.dx() / grid.dy();
        const double half_angle = std::numbers::pi * k / grid.cells_x;
        // Not cos(theta), which would lose the digits of the lowest and highest modes to cancellation.
        const double sine = std::sin(half_angle), cosine = 2 * k == grid.cells_x ? 0.0 : std::cos(half_angle);
        const double m = neighbour_mass(stiffness);
        const double along_x = dy_dx * 4.0 * sine * sine;
        const double along_y = dx_dy * (cosine * cosine + (1.0 - 4.0 * m) * sine * sine);
        uu = alpha * along_x * (1.0 - 2.0 * m) + mu * along_y * 2.0;
        vv = mu * along_x * (1.0 - 2.0 * m) + alpha * along_y * 2.0;
        a = alpha * along_x * m - mu * along_y;
        d = mu * along_x * m - alpha * along_y;
        e = 0.5 * (elasticity.beta() + mu) * 2.0 * sine * cosine;
    }

    /// U^T P U for a symmetric P.
    [[nodiscard]] Symmetric eliminated(const Symmetric& p) const {
        const double pu_uu = p.uu * a + p.uv * e, pu_uv = p.uv * d - p.uu * e;
        const double pu_vu = p.uv * a + p.vv * e, pu_vv = p.vv * d - p.uv * e;
        return {a * pu_uu + e * pu_vu, a * pu_uv + e * pu_vv, d * pu_vv - e * pu_uv};
    }
};

/// Agreement of two inverse pivots to round-off, measured against their size.
bool agree(const Symmetric& p, const Symmetric& q) {
    const double difference = std::max({std::abs(p.uu - q.uu), std::abs(p.uv - q.uv), std::abs(p.vv - q.vv)});
    return difference <= 2.0 * std::numeric_limits<double>::epsilon() * std::min(q.uu, q.vv);
}

// The kernels: eight modes, real or imaginary parts.

void eliminate_block(const ModeCouplings& c, const ModePivots& p, double* u, double* v, const double* u_previous,
                     const double* v_previous) {
    DUCTILE_VECTORISE
    for (int l = 0; l < row_unit; ++l) {
        const double ru = u[l] - c.a[l] * u_previous[l] - c.e[l] * v_previous[l];
        const double rv = v[l] + c.e[l] * u_previous[l] - c.d[l] * v_previous[l];
        u[l] = p.uu[l] * ru + p.uv[l] * rv;
        v[l] = p.uv[l] * ru + p.vv[l] * rv;
    }
}

void meet_block(const ModeCouplings& c, const ModePivots& p, double* u, double* v, const double* u_below, const double* v_below,
                const double* u_above, const double* v_above) {
    DUCTILE_VECTORISE
    for (int l = 0; l < row_unit; ++l) {
        const double ru = u[l] - c.a[l] * (u_below[l] + u_above[l]) - c.e[l] * (v_below[l] + v_above[l]);
        const double rv = v[l] + c.e[l] * (u_below[l] - u_above[l]) - c.d[l] * (v_below[l] - v_above[l]);
        u[l] = p.uu[l] * ru + p.uv[l] * rv;
        v[l] = p.uv[l] * ru + p.vv[l] * rv;
    }
}

void substitute_block(const ModeCouplings& c, const ModePivots& p, double* u, double* v, const double* u_next,
                      const double* v_next) {
    DUCTILE_VECTORISE
    for (int l = 0; l < row_unit; ++l) {
        const double tu = c.a[l] * u_next[l] - c.e[l] * v_next[l];
        const double tv = c.e[l] * u_next[l] + c.d[l] * v_next[l];
        u[l] = u[l] - p.uu[l] * tu - p.uv[l] * tv;
        v[l] = v[l] - p.uv[l] * tu - p.vv[l] * tv;
    }
}

} // namespace

ModeSystems::ModeSystems(const Grid& grid, const IsotropicElasticity& elasticity, Stiffness stiffness) {
    const int modes = grid.cells_x / 2 + 1, blocks = (modes + row_unit - 1) / row_unit;
    const int below = grid.cells_y / 2 - 1, above = grid.cells_y - 1 - grid.cells_y / 2; // rows of the two halves
    const double scale = 2.0 * grid.cells_x;
    couplings_.resize(static_cast<std::size_t>(blocks));
    middle_.resize(static_cast<std::size_t>(blocks));
    for (int block = 0; block < blocks; ++block) {
        std::vector<ModePivots> rows(static_cast<std::size_t>(above));
        int needed = 1;
        for (int lane = 0; lane < row_unit && block * row_unit + lane < modes; ++lane) {
            const ModeBlocks mode(grid, elasticity, stiffness, block * row_unit + lane);
            ModeCouplings& coupling = couplings_[static_cast<std::size_t>(block)];
            coupling.a[lane] = scale * mode.a;
            coupling.d[lane] = scale * mode.d;
            coupling.e[lane] = scale * mode.e;
            const auto store = [&](ModePivots& to, const Symmetric& p) {
                to.uu[lane] = p.uu / scale;
                to.uv[lane] = p.uv / scale;
                to.vv[lane] = p.vv / scale;
            };
            std::vector<Symmetric> inverses{inverse({mode.uu, 0.0, mode.vv})};
            for (int step = 2; step <= above; ++step) {
                const Symmetric e = mode.eliminated(inverses.back());
                inverses.push_back(inverse({mode.uu - e.uu, -e.uv, mode.vv - e.vv}));
            }
            for (int step = 1; step <= above; ++step)
                store(rows[static_cast<std::size_t>(step - 1)], inverses[static_cast<std::size_t>(step - 1)]);
            const Symmetric e = mode.eliminated(inverses[static_cast<std::size_t>(below - 1)]);
            const Symmetric mirrored = mode.eliminated(inverses.back());
            store(middle_[static_cast<std::size_t>(block)],
                  inverse({mode.uu - e.uu - mirrored.uu, -e.uv + mirrored.uv, mode.vv - e.vv - mirrored.vv}));
            const auto last_apart =
                std::find_if(inverses.rbegin(), inverses.rend(), [&](const Symmetric& p) { return !agree(p, inverses.back()); });
            needed = std::max(needed, std::min(above, static_cast<int>(inverses.rend() - last_apart) + 1));
        }
        first_.push_back(static_cast<int>(pivots_.size()));
        stored_.push_back(needed);
        pivots_.insert(pivots_.end(), rows.begin(), rows.begin() + needed);
    }
}

std::size_t ModeSystems::memory_bytes() const {
    return (pivots_.size() + middle_.size()) * sizeof(ModePivots) + couplings_.size() * sizeof(ModeCouplings) +
           (first_.size() + stored_.size()) * sizeof(int);
}

const ModePivots& ModeSystems::pivots(int step, int block) const {
    const auto b = static_cast<std::size_t>(block);
    return pivots_[static_cast<std::size_t>(first_[b] + std::min(step, stored_[b]) - 1)];
}

void ModeSystems::eliminate(SpectralRow row, SpectralRow previous, int step, int begin, int end) const {
    for (int block = begin, k = begin * row_unit; block < end; ++block, k += row_unit) {
        const ModeCouplings& c = couplings_[static_cast<std::size_t>(block)];
        const ModePivots& p = pivots(step, block);
        eliminate_block(c, p, row.u_re + k, row.v_re + k, previous.u_re + k, previous.v_re + k);
        eliminate_block(c, p, row.u_im + k, row.v_im + k, previous.u_im + k, previous.v_im + k);
    }
}

void ModeSystems::meet(SpectralRow middle, SpectralRow below, SpectralRow above, SpectralRow mirrored, int begin, int end) const {
    for (int block = begin, k = begin * row_unit; block < end; ++block, k += row_unit) {
        const ModeCouplings& c = couplings_[static_cast<std::size_t>(block)];
        const ModePivots& p = middle_[static_cast<std::size_t>(block)];
        meet_block(c, p, middle.u_re + k, middle.v_re + k, below.u_re + k, below.v_re + k, above.u_re + k, above.v_re + k);
        meet_block(c, p, middle.u_im + k, middle.v_im + k, below.u_im + k, below.v_im + k, above.u_im + k, above.v_im + k);
        for (int l = k; l < k + row_unit; ++l) {
            mirrored.u_re[l] = middle.u_re[l];
            mirrored.u_im[l] = middle.u_im[l];
            mirrored.v_re[l] = -middle.v_re[l];
            mirrored.v_im[l] = -middle.v_im[l];
        }
    }
}

void ModeSystems::substitute(SpectralRow row, SpectralRow next, int step, int begin, int end) const {
    for (int block = begin, k = begin * row_unit; block < end; ++block, k += row_unit) {
        const ModeCouplings& c = couplings_[static_cast<std::size_t>(block)];
        const ModePivots& p = pivots(step, block);
        substitute_block(c, p, row.u_re + k, row.v_re + k, next.u_re + k, next.v_re + k);
        substitute_block(c, p, row.u_im + k, row.v_im + k, next.u_im + k, next.v_im + k);
    }
}

} // namespace ductile
