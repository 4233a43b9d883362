// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/material/internal_variable.hpp>
#include <ductile/space/field.hpp>
#include <ductile/space/grid.hpp>

#include <cstdint>
#include <variant>

/// Initial fields of the internal variable. Lengths are in units of the scene's length, values in the law's own unit (natural, or
/// SI: the result has it).
namespace ductile::quasistatic {

/// Lu & Rycroft, App. C: chi_0 + Delta chi sum_{i=1}^{6} exp(-20 R_i) with R_1 = (0.5 sin(pi x) - y)^2 and, for i >= 2,
/// R_i = X_i^2 + (y + s_i)^2, X_i = x - x_i wrapped into the period (in print (C.3) lacks the squares and calls Delta chi chi_1).
/// x and y are in units of half the domain's width and height, so the pattern fits every rectangle.
struct PaperPattern {
    double base = 640.0;      ///< T_base
    double amplitude = 180.0; ///< Delta T
};

struct Uniform {
    double value = 0.0;
};

/// background + amplitude exp(-r^2/(2 radius^2)), r the distance (periodic in x) to the centre.
struct GaussianInclusion {
    double background = 600.0;
    double amplitude = 100.0;
    double x = 0.0, y = 0.0; ///< centre; the origin is the middle of the domain
    double radius = 0.2;
};

/// background + amplitude (1 - tanh((r - radius)/transition))/2, r the distance (periodic in x) to the centre.
struct SoftDisc {
    double background = 600.0;
    double amplitude = 300.0;
    double x = 0.0, y = 0.0; ///< centre; the origin is the middle of the domain
    double radius = 0.3;
    double transition = 0.1;
};

/// Blocks of about the side `length`, in whole numbers across the domain: mean + deviation times a normal number in each. It
/// jumps from block to block, so that no grid shows what happens there any better than a coarser one.
struct RandomBlocks {
    double mean = 640.0;
    double deviation = 20.0;
    double length = 0.1;
    std::uint64_t seed = 1;
};

/// A smooth Gaussian random field: mean, standard deviation, correlation <f(0) f(r)> ~ exp(-r^2/(2 length^2)).
/// A sum of Fourier modes in x and cosines in y with amplitudes drawn from `seed`: the same field on every grid, whatever its
/// resolution. The sample's mean and deviation differ from the nominal ones as those of any finite sample do.
struct RandomField {
    double mean = 640.0;
    double deviation = 20.0;
    double correlation_length = 0.1;
    std::uint64_t seed = 1;
};

using InitialInternal = std::variant<PaperPattern, Uniform, GaussianInclusion, SoftDisc, RandomBlocks, RandomField>;

/// Values at cells, shape [N][M], whose rows lie as `rows` says, or are of equal height. Throws InputError for lengths that are
/// not positive, a negative deviation, a random field too fine to sum (correlation length below 1/500 of the domain), and a value
/// that the variable cannot begin with.
[[nodiscard]] Field initial_internal(const Grid& grid, const RowSpacing& rows, const InitialInternal& initial,
                                     const InternalVariable& variable);
[[nodiscard]] Field initial_internal(const Grid& grid, const InitialInternal& initial, const InternalVariable& variable);

/// The same fields without a variable that limits them.
[[nodiscard]] Field random_field(const Grid& grid, const RowSpacing& rows, const RandomField& random);

} // namespace ductile::quasistatic
