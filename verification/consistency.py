#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Ways to make divergence, stiffness and stress update of the index-reduced scheme fit together, compared by a model of its own.

Stress at cell centres has the divergence B^T and the rate C B v of the one-point gradient B. With the fully integrated stiffness (S.20)
K v = -B^T f leaves d(B^T sigma)/dt = (1 - B^T C B K^-1) B^T f: equilibrium is lost and nothing restores it. Compared here, on the reduced
equations with classical Runge-Kutta steps, for a smooth initial chi (App. C) and for the same with 2 % noise from cell to cell:

  full stiffness             no remedy
  full stiffness, relaxed    K v = -B^T (f + sigma/T), which pulls the stress back to equilibrium within T; two values of T
  one-point stiffness        K = B^T C B (the program's default)
  Gauss-point stress         stress and chi at 2 x 2 points a cell, full stiffness: consistent, too

The model is written in NumPy from the equations and shares no code with the program: its one-point scheme is also compared with the
program's result on the same grid.

    verification/consistency.py
"""

import time

import numpy as np

import common

CELLS, FINE, STEPS = 32, 96, 700
MU, BULK = common.SHEAR / common.YIELD, common.BULK / common.YIELD
U, DURATION = 2e-7, 35e4
BOLTZMANN, ZETA, EPSILON, BATH, BARRIER, FORMATION, TAU = 1.3806488e-23, 300e-30, 0.3, 400.0, 8000.0, 21000.0, 1e-13
ACTIVATION = ZETA * EPSILON * common.YIELD / (BOLTZMANN * BATH)
HEAT = 0.4
POINTS = {1: [(0.5, 0.5)], 4: [(0.5 + a, 0.5 + b) for a in (-0.5 / 3**0.5, 0.5 / 3**0.5) for b in (-0.5 / 3**0.5, 0.5 / 3**0.5)]}


class Space:
    """Q1 elements on [-1, 1]^2, periodic in x: gradients at the points of each cell, their transposes, and K^-1 by Fourier in x.
    Stress: [p, s, tau, q][point][row][column]."""

    def __init__(self, cells, stress_points, stiffness_points):
        self.n, self.h = cells, 2 / cells
        self.points, self.stiffness_points = POINTS[stress_points], POINTS[stiffness_points]
        rows = cells - 1
        columns = []
        for component in range(2):
            for row in range(rows):
                v = np.zeros((2, cells + 1, cells))
                v[component, row + 1, 0] = 1
                force = self.divergence(self.elastic(v, self.stiffness_points), self.stiffness_points)
                columns.append(np.fft.fft(force[:, 1:-1], axis=2).reshape(2 * rows, cells))
        self.inverse = np.linalg.inv(np.array(columns).transpose(2, 1, 0))  # [wave][equation][unknown]

    def elastic(self, v, points):
        """C : D(v)."""
        lower, upper = v[:, :-1], v[:, 1:]
        result = []
        for x, y in points:
            dx = ((1 - y) * (np.roll(lower, -1, 2) - lower) + y * (np.roll(upper, -1, 2) - upper)) / self.h
            dy = ((1 - x) * (upper - lower) + x * (np.roll(upper, -1, 2) - np.roll(lower, -1, 2))) / self.h
            trace = dx[0] + dy[1]
            result.append([-BULK * trace, MU * (dx[0] - dy[1]), MU * (dy[0] + dx[1]), -MU / 3 * trace])
        return np.array(result).swapaxes(0, 1)

    def divergence(self, stress, points):
        """The transpose of the gradient applied to the stress: nodal forces [2][n + 1][n]."""
        force = np.zeros((2, self.n + 1, self.n))
        for (x, y), (p, s, tau, q) in zip(points, stress.swapaxes(0, 1)):
            xx, yy = -p + s - q, -p - s - q
            weight = self.h / len(points)  # area/(points h)
            for component, (along_x, along_y) in enumerate(((xx, tau), (tau, yy))):
                for i, j, ax, ay in ((0, 0, -(1 - y), -(1 - x)), (1, 0, 1 - y, -x), (0, 1, -y, 1 - x), (1, 1, y, x)):
                    force[component, j:self.n + j] += weight * np.roll(ax * along_x + ay * along_y, i, axis=1)
        return force

    def solve(self, force):
        """K^-1 force, with zero velocity on the walls."""
        spectrum = np.fft.fft(force[:, 1:-1], axis=2).reshape(-1, self.n)
        v = np.zeros_like(force)
        v[:, 1:-1] = np.fft.ifft(np.einsum("wij,jw->iw", self.inverse, spectrum)).real.reshape(2, self.n - 1, self.n)
        return v


def pattern(x, y):
    """App. C, in units of e_Z/k_B."""
    total = np.exp(-20 * (0.5 * np.sin(np.pi * x) - y) ** 2)
    for centre, shift in ((0.6, 0.65), (0.3, 0.3), (-0.2, -0.4), (-0.4, 0.0), (-0.7, -0.6)):
        total += np.exp(-20 * (((x - centre + 1) % 2 - 1) ** 2 + (y + shift) ** 2))
    return (640 + 180 * total) / FORMATION


def plastic(stress, chi):
    """f and dchi/dt, Eqs. (20), (21), (A.1)-(A.3)."""
    p, s, tau, q = stress
    sbar = np.maximum(np.sqrt(s * s + tau * tau + 3 * q * q), 1e-30)
    flow = np.where(sbar > 1, 0.5 * common.TIME / TAU * np.exp(ACTIVATION * np.maximum(sbar, 1) - 1 / chi - BARRIER / BATH)
                    * (1 - 1 / np.maximum(sbar, 1)), 0)
    rate = -2 * MU * flow / sbar
    return np.array([np.zeros_like(p), rate * s, rate * tau, rate * q]), 2 * sbar * flow * (common.STEADY / FORMATION - chi) / HEAT


def shear(space, noise, relaxation=np.inf):
    """The whole run; returns stress and chi as means over each cell, the largest relative residual of equilibrium, seconds."""
    n = space.n
    corner = -1 + space.h * np.arange(n)
    chi = np.array([pattern(*np.meshgrid(corner + x * space.h, corner + y * space.h)) for x, y in space.points]) * noise
    stress = np.zeros((4, len(space.points), n, n))
    affine = np.zeros((2, n + 1, n))
    affine[0] = U * np.linspace(-1, 1, n + 1)[:, None]
    walls = space.elastic(affine, space.points)

    def rates(stress, chi):
        f, heating = plastic(stress, chi)
        v = space.solve(-space.divergence(f + stress / relaxation, space.points))
        return f + space.elastic(v, space.points) + walls, heating

    dt = DURATION / STEPS
    started, residual = time.process_time(), 0.0
    for _ in range(STEPS):
        k1 = rates(stress, chi)
        k2 = rates(stress + dt / 2 * k1[0], chi + dt / 2 * k1[1])
        k3 = rates(stress + dt / 2 * k2[0], chi + dt / 2 * k2[1])
        k4 = rates(stress + dt * k3[0], chi + dt * k3[1])
        stress = stress + dt / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0])
        chi = chi + dt / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])
        force = space.divergence(stress, space.points)[:, 1:-1]
        residual = max(residual, np.abs(force).max() / (np.abs(stress).max() * space.h))
    seconds = time.process_time() - started
    return stress.mean(1), chi.mean(0) * FORMATION / common.STEADY, residual, seconds


def fields(run, v=None):
    stress, chi = run[:2]
    return common.Fields(np.zeros((2, stress.shape[-1] + 1, stress.shape[-1])) if v is None else v, stress, chi[None])


def checkerboard(stress):
    """Root mean square of what alternates from cell to cell in both directions, in the 3 x 3 stress norm."""
    sign = (-1.0) ** np.add.outer(np.arange(stress.shape[1]), np.arange(stress.shape[2]))
    alternating = stress * sign
    passes = 4  # each mean over 2 x 2 cells removes two more orders of the smooth part
    for _ in range(passes):
        alternating = sum(alternating[:, i:alternating.shape[1] - 1 + i, j:alternating.shape[2] - 1 + j] for i in (0, 1) for j in (0, 1)) / 4
    p, s, tau, q = alternating
    return np.sqrt(np.mean(3 * p**2 + 2 * s**2 + 2 * tau**2 + 6 * q**2))


def main():
    parser = common.parser(__doc__, work="out/verification/consistency")
    options = parser.parse_args()
    # of the reference, what the coarse values mean: values at centres, or means over a cell
    factor = FINE // CELLS
    centres = common.thin(fields(shear(Space(FINE, 1, 1), 1.0)), factor)
    stress, chi = shear(Space(FINE, 4, 4), 1.0)[:2]
    blocks = lambda f: f.reshape(*f.shape[:-2], CELLS, factor, CELLS, factor).mean((-3, -1))
    means = fields((blocks(stress), blocks(chi)))
    full, one_point, gauss = Space(CELLS, 1, 4), Space(CELLS, 1, 1), Space(CELLS, 4, 4)
    variants = {
        "full stiffness": (full, np.inf),
        "full stiffness, relaxed within 1e4 t_s": (full, 1e4),
        "full stiffness, relaxed within 1e3 t_s": (full, 1e3),
        "one-point stiffness": (one_point, np.inf),
        "Gauss-point stress, full stiffness": (gauss, np.inf),
    }
    noise = 1 + 0.02 * np.random.default_rng(1).standard_normal((CELLS, CELLS))
    rows = []
    for name, (space, relaxation) in variants.items():
        smooth, rough = shear(space, 1.0, relaxation), shear(space, noise, relaxation)
        errors = common.norms(fields(smooth) - (means if space is gauss else centres))
        rows.append([name, f"{errors['sigma']:.2e}", f"{errors['chi']:.2e}", f"{smooth[2]:.1e}", f"{rough[2]:.1e}",
                     f"{checkerboard(smooth[0]):.1e}", f"{checkerboard(rough[0]):.1e}", len(space.points), f"{smooth[3]:.1f}"])
        print(*rows[-1], flush=True)

    program = common.load(common.run(options.program, options.work / "program", {
        "cells": CELLS, "model": "reduced", "scheme": "dormand-prince", "step": "adaptive", "tolerance": "1e-8",
        "snapshots": common.DURATION}))
    model = fields(shear(one_point, 1.0), program.v)
    distance = common.norms(model - program)
    header = ["variant", "error of sigma", "error of chi", "residual, smooth", "residual, noise", "checkerboard, smooth",
              "checkerboard, noise", "stress points a cell", "processor s"]
    text = "\n".join([
        f"# Consistency of divergence, stiffness and stress\n\n{common.provenance()}\n",
        f"Reduced equations, {CELLS} x {CELLS} cells, {STEPS} classical Runge-Kutta steps. Errors at t = 35e4 t_s for the smooth start against "
        f"the one-point scheme (Gauss points: the same) on {FINE} x {FINE} cells, norm (59); residual: largest |B^T sigma|/(|sigma| h) of the run; checkerboard: what "
        "alternates from cell to cell in the final stress, in s_Y; processor seconds of this script.\n",
        common.markdown_table(header, rows),
        f"The program's run on the same grid and the one-point row differ by {distance['sigma']:.1e} in sigma and {distance['chi']:.1e} in chi.\n"])
    common.publish(options.results, "consistency", text, header, rows)


if __name__ == "__main__":
    main()
