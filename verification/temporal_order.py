#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Order in time of the integrators of the index-reduced method of lines.

48 x 48 cells are sheared until they flow. At t = 0.6 s the walls change their speed at once; from a checkpoint at that moment fixed
steps go on, over a decade of step lengths and more, against Dormand-Prince steps half as long as the shortest of that method. What
spoils the order is added piece by piece: nothing (reduced model, smoothed yield corner), the corner (all cells cross it, one after
another, when the walls turn back), advection and spin (ENO differences switch between stencils).

    verification/temporal_order.py
"""

import shutil
import subprocess

import matplotlib.pyplot as plt
import numpy as np

import common
from common import FIELDS

CELLS = 48
START = 0.6  # s
FASTER, BACK = 2, -10  # the walls' velocity after START, relative to that before
SCHEMES = {"ralston": 2, "bogacki-shampine": 3, "dormand-prince": 5, "chebyshev": 2}  # design orders
FEWEST = {"ralston": 40, "bogacki-shampine": 40, "dormand-prince": 26, "chebyshev": 40}  # steps from START to the end
LENGTHS = np.geomspace(1, 12, 8)  # numbers of steps relative to the fewest
CASES = {  # options, wall velocity, end [s]
    "reduced, smooth corner, walls twice as fast": ({"model": "reduced", "stz-corner": 0.1}, FASTER, 0.7),
    "reduced, smooth corner, walls turn back": ({"model": "reduced", "stz-corner": 0.1}, BACK, 0.63),
    "reduced, sharp corner, walls turn back": ({"model": "reduced", "stz-corner": 0}, BACK, 0.63),
    "full, smooth corner, walls twice as fast": ({"model": "full", "stz-corner": 0.1}, FASTER, 0.7),
}
FLOOR = {"v": 2e-13, "sigma": 2e-13, "chi": 2e-14}  # times the wall velocity: errors below hold round-off (of time, too)


def steps_of(scheme):
    return [round(FEWEST[scheme] * length) for length in LENGTHS]


def run(program, folder, start, end, scheme, steps):
    """Fixed steps from the checkpoint `start`; returns the final fields."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    shutil.copy(start, folder)
    subprocess.run(common.command(program, {
        "restart": folder / "checkpoint.h5", "scheme": scheme, "step": "fixed", "dt": repr((end - START) / steps), "duration": end,
        "snapshots": end, "threads": 1, "quiet": "true", "velocity-passes": 16, "tolerance": "1e-13"}), check=True)
    return common.load(folder)


def study(program, work):
    """{(case, scheme): [(steps, errors)]}"""
    result = {}
    for number, (case, (options, factor, end)) in enumerate(CASES.items()):
        walls = f"0:{common.WALL!r},{START}:{common.WALL!r},{START}:{factor * common.WALL!r}"
        start = common.run(program, work / str(number), options | {
            "cells": CELLS, "advection": "eno2", "wall-history": walls, "scheme": "bogacki-shampine", "step": "adaptive", "tolerance": "1e-8",
            "duration": START, "snapshots": START}) / "checkpoint.h5"

        def again(scheme, steps):
            return run(program, work / "again", start, end, scheme, steps)

        exact = again("dormand-prince", 2 * steps_of("dormand-prince")[-1])
        for scheme in SCHEMES:
            result[case, scheme] = [(steps, common.norms(again(scheme, steps) - exact)) for steps in steps_of(scheme)]
            print(case, scheme, *(f"{slope(result[case, scheme], field, abs(factor)):.2f}" for field in FIELDS), flush=True)
    return result


def above_floor(runs, field, floor):
    return [(steps, errors[field]) for steps, errors in runs if errors[field] > floor * FLOOR[field]]


def slope(runs, field, floor):
    kept = above_floor(runs, field, floor)
    if len(kept) < 3:
        return np.nan
    steps, errors = zip(*kept)
    return common.slope(1 / np.array(steps), errors)


def table(result):
    rows = []
    for (case, scheme), runs in result.items():
        row, floor = [case, scheme, SCHEMES[scheme]], abs(CASES[case][1])
        for field in FIELDS:
            kept = above_floor(runs, field, floor)
            row += ([f"{slope(runs, field, floor):.2f}", f"{kept[0][0]}..{kept[-1][0]}: {kept[0][1]:.1e}..{kept[-1][1]:.1e}"]
                    if len(kept) > 2 else ["", "round-off"])
        rows.append(row)
    header = ["case", "scheme", "design order"]
    for field in FIELDS:
        header += [f"order of {field}", "steps: errors"]
    return common.markdown_table(header, rows)


def draw(result, path):
    figure, axes = plt.subplots(1, len(CASES), figsize=(16, 4.2), sharey=True, layout="constrained")
    for axis, case in zip(axes, CASES):
        for scheme, colour in zip(SCHEMES, ("C0", "C1", "C2", "C3")):
            runs = result[case, scheme]
            for field, style in zip(("sigma", "v"), ("o-", "^:")):
                axis.loglog([steps for steps, _ in runs], [errors[field] for _, errors in runs], colour + style, markersize=3, linewidth=1,
                            label=f"{scheme}, {field}: {slope(runs, field, abs(CASES[case][1])):.2f}")
        axis.set_title(case, fontsize=9)
        axis.set_xlabel("steps")
        axis.legend(fontsize=6, title="order", title_fontsize=6)
    axes[0].set_ylabel(r"error in time of $\sigma/s_Y$, $v/U$")
    figure.savefig(path, dpi=100)
    plt.close(figure)


def main():
    options = common.parser(__doc__, work="out/verification/temporal_order").parse_args()
    result = study(options.program, options.work)
    text = "\n".join([
        f"# Order in time of the index-reduced integrators\n\n{common.provenance()}\n",
        f"{CELLS} x {CELLS} cells from t = {START} s, fixed steps, errors in the norm (59) divided by U, s_Y, chi_inf. Order: linear "
        "regression of log E on log dt over the errors above round-off.\n", table(result)])
    common.publish(options.results, "temporal_order", text, ["case", "scheme", "steps", *FIELDS],
                   [[case, scheme, steps, *(f"{errors[f]:.4e}" for f in FIELDS)]
                    for (case, scheme), runs in result.items() for steps, errors in runs])
    draw(result, options.results / "temporal_order.png")


if __name__ == "__main__":
    main()
