#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""One scene on both carriers: a glass with a soft spot between two walls, drivers/scenes/glass-block.toml, on the grid that stays and
on material points with linear shape functions, GIMP and B-splines, refined. Compared at the end of the run, past yield, with a much finer
grid, between whose cells cubic polynomials interpolate: the traction on the walls, the largest effective temperature, and of all cells or
particles the shear stress and the effective temperature.

Points take backward Euler steps; what is compared is extrapolated in time from two step sizes, so that differences are those in space.
With linear functions particles cross cells at other instants in either, and the finer is taken as it is.

    verification/carriers.py
"""

import os

import matplotlib.pyplot as plt
import numpy as np

import common
from results import Run

SCENE = common.ROOT / "drivers/scenes/glass-block.toml"
REFERENCE = 512
STEPS = ("4e-3", "2e-3")  # [s]
CELLS = (16, 32, 64)
POINTS = {  # options, and sizes
    "linear": ({"shape": "linear"}, CELLS),
    "GIMP": ({"shape": "gimp"}, CELLS),
    "B-splines": ({"shape": "bspline"}, CELLS),
    "linear, 1 a cell": ({"shape": "linear", "particles-per-side": 1}, CELLS[:2]),
    "GIMP, 1 a cell": ({"shape": "gimp", "particles-per-side": 1}, CELLS),
}
QUANTITIES = {"traction": "traction [MPa]", "tau": "tau [MPa]", "chi": "chi [K]", "peak": "largest chi [K]"}


def scenes(work):
    """The file for each carrier: one word differs."""
    text, files = SCENE.read_text(), {}
    work.mkdir(parents=True, exist_ok=True)
    for carrier in ("grid", "points"):
        files[carrier] = work / f"{carrier}.toml"
        files[carrier].write_text(text.replace('carrier = "points"', f'carrier = "{carrier}"'))
    return files


def lagrange(places, count, period):
    """The four nearest of `count` cells on [0, 1] to each place, and their weights: cubic interpolation."""
    t = places * count - 0.5
    first = np.floor(t).astype(int) - 1
    if not period:
        first = np.clip(first, 0, count - 4)
    t = t - first
    weights = [np.prod([(t - m) / (k - m) for m in range(4) if m != k], axis=0) for k in range(4)]
    return [(first + k) % count for k in range(4)], weights


class State:
    """The end of a run, or what two runs whose second takes steps half as long come to without steps: traction [MPa], and of all cells or
    particles x, y (in sides of the block), tau [MPa], chi [K]."""

    def __init__(self, *folders):
        ends = [self.end(folder) for folder in folders]
        self.traction, self.x, self.y, self.tau, self.chi = ends[0] if len(ends) == 1 else (2 * b - a for a, b in zip(*ends))
        self.seconds = common.step_seconds(common.summary(folders[-1]))

    @staticmethod
    def end(folder):
        run = Run(folder)
        traction, last = run.history["wall_shear_traction_Pa"][-1] * 1e-6, run.snapshots[-1]
        chi = last["effective_temperature"]
        if run.carrier == "grid":
            centres = (np.arange(len(chi)) + 0.5) / len(chi)
            x, y = np.meshgrid(centres, centres)
        else:
            x, y = (last["position"] / (2 * common.LENGTH) + 0.5).T
        return traction, x, y, last["tau"] * 1e-6, chi

    def at(self, x, y):
        """tau and chi of a run on the grid at other places."""
        columns, along_x = lagrange(x, self.chi.shape[1], True)
        rows, along_y = lagrange(y, self.chi.shape[0], False)
        sums = [sum(wy * wx * field[j, i] for j, wy in zip(rows, along_y) for i, wx in zip(columns, along_x))
                for field in (self.tau, self.chi)]
        return sums

    def differences(self, grid):
        """From a run on the grid, of tau and chi root mean squares."""
        tau, chi = grid.at(self.x, self.y)
        rms = lambda d: float(np.sqrt(np.mean(d**2)))
        return {"traction": abs(self.traction - grid.traction), "tau": rms(self.tau - tau), "chi": rms(self.chi - chi),
                "peak": abs(float(self.chi.max() - chi.max()))}


def numbers(differences):
    return [f"{differences[q]:.2g}" for q in QUANTITIES]


def draw(path, table, runs, reference):
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.2), layout="constrained")
    for axis, quantity in zip(axes, ("tau", "chi")):
        for name in dict.fromkeys(name for name, _ in table):
            sizes = [cells for other, cells in table if other == name]
            axis.loglog(sizes, [table[name, n][quantity] for n in sizes], "ks-" if name == "grid" else "o-", label=name)
        for order in (1, 2):
            axis.loglog(CELLS, table["grid", CELLS[0]][quantity] * (CELLS[0] / np.array(CELLS))**order, ":", color="gray", lw=1)
        axis.set(xlabel="cells a side (dotted: first and second order)", ylabel=f"difference of {QUANTITIES[quantity]}")
        axis.set_xticks(CELLS, CELLS)
        axis.minorticks_off()
    axes[0].legend(fontsize=8)
    cells, bins = 64, 32
    for name in ("grid", "linear", "GIMP", "B-splines"):
        state = runs[name, cells]
        square = (state.tau - reference.at(state.x, state.y)[0])**2
        rows = np.clip(state.y * bins, 0, bins - 1).astype(int)
        mean = [np.sqrt(square[rows == row].mean()) for row in range(bins)]
        axes[2].semilogy((np.arange(bins) + 0.5) / bins, mean, "k-" if name == "grid" else "-", label=name)
    axes[2].set(xlabel="y over height (0, 1: walls)", ylabel=f"difference of tau [MPa], {cells} cells a side")
    figure.savefig(path, dpi=110)


def main():
    options = common.parser(__doc__, work="out/verification/carriers").parse_args()
    files, scene = scenes(options.work), options.program.parent / "scene"

    def run(carrier, name, **more):
        return common.run([scene, files[carrier]], options.work / name, more, os.cpu_count())

    def on_grid(cells):
        return State(run("grid", f"grid {cells}", cells=cells, tolerance="1e-6"))

    def on_points(name, cells):
        return State(*(run("points", f"{name} {cells}, dt {dt}", cells=cells, dt=dt, **POINTS[name][0])
                       for dt in (STEPS[-1:] if name.startswith("linear") else STEPS)))

    reference = on_grid(REFERENCE)
    runs = {("grid", cells): on_grid(cells) for cells in CELLS}
    runs |= {(name, cells): on_points(name, cells) for name, (_, sizes) in POINTS.items() for cells in sizes}
    table = {key: state.differences(reference) for key, state in runs.items()}
    rows = []
    for (name, cells), state in runs.items():
        coarser = table.get((name, cells // 2))
        order = f"{np.log2(coarser['chi'] / table[name, cells]['chi']):.1f}" if coarser else ""
        beside = numbers(state.differences(runs["grid", cells])) if name != "grid" else [""] * len(QUANTITIES)
        rows.append([name, cells, *numbers(table[name, cells]), order, *beside, f"{state.seconds:.1f}"])
    header = ["carrier", "cells a side", *QUANTITIES.values(), "order of chi",
              *(f"{label}, same size" for label in QUANTITIES.values()), "seconds"]
    time_rows = []
    for name in ("GIMP", "B-splines"):
        for dt in STEPS:
            taken = State(options.work / f"{name} 32, dt {dt}")
            error = {"traction": abs(taken.traction - runs[name, 32].traction), "peak": abs(taken.chi.max() - runs[name, 32].chi.max()),
                     **{q: np.sqrt(np.mean((getattr(taken, q) - getattr(runs[name, 32], q))**2)) for q in ("tau", "chi")}}
            time_rows.append([name, dt, *numbers(error)])
    draw(options.results / "carriers.png", table, runs, reference)
    strain = Run(options.work / f"grid {REFERENCE}").history["wall_strain"][-1]
    text = "\n".join([
        f"# One scene, both carriers\n\n{common.provenance()}, 2 cores with AVX-512 beside other work\n",
        f"`drivers/scenes/glass-block.toml` at the strain {strain:.4f}, where the traction is {reference.traction:.1f} MPa, tau varies by "
        f"{reference.tau.std():.1f} MPa and chi, the effective temperature, by {reference.chi.std():.2f} K (standard deviations) up to "
        f"{reference.chi.max():.1f} K. Differences from {REFERENCE} x {REFERENCE} cells of the grid, then from as many as the run has; of tau and "
        f"chi root mean squares over cells or particles. Points: 2 x 2 a cell unless said, extrapolated from dt = {STEPS[0]} and {STEPS[1]} s "
        f"(linear: the second alone); seconds are those of steps, of the second.\n",
        common.markdown_table(header, rows),
        "What steps of points are from the extrapolated result, 32 cells a side:\n",
        common.markdown_table(["shape functions", "dt [s]", *QUANTITIES.values()], time_rows)])
    common.publish(options.results, "carriers", text, header, rows)


if __name__ == "__main__":
    main()
