#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive global steps: Sec. 8.2, Figs. 4 and 5 of Lu & Rycroft, beside constant steps.

The full model on 280, 360 and 504 cells a side. The size Q* of the projection is held near F_Q (h/L)^2 with F_Q = 0.001 for
three meanings of Q*: the dimensionless elastic strain that the program documents, and the paper's (51)-(55), which depends
on the unit of stress, counted in s_Y or in mu. Each with the bound dt <= 1000 t_s of Table 2 and without it, and what goes wrong
without. Errors are those of convergence.py, against the same references, whose runs it shares.

    verification/adaptive.py
"""

import matplotlib.pyplot as plt
import numpy as np

import common
import convergence
from common import BULK, FIELDS, GRIDS, SHEAR, YIELD
from results import Run

FACTOR = 1e-3  # F_Q of Table 2
AREA = 4.0     # |Omega| in L^2
ONSET = YIELD / SHEAR * common.LENGTH / common.WALL / common.TIME  # t_s: sbar reaches s_Y everywhere

# What the paper's Q* is, divided by the program's: sqrt(6 K/|Omega|), K in the unit of stress (derivation: `definitions`).
MEANINGS = {
    "strain": ("elastic strain", 1.0),
    "paper-yield": ("paper, stress in s_Y", np.sqrt(6 * BULK / YIELD / AREA)),
    "paper-shear": ("paper, stress in mu", np.sqrt(6 * BULK / SHEAR / AREA)),
}
BOUNDS = {"": "dt <= 1000 t_s", "-unbounded": "no bound"}
CONSTANT = convergence.SERIES["full"][0]

# Knots of a wall history of constant velocity: steps end on them, so that yield (at 0.4602 s) is not stepped over.
KNOTS = ",".join(f"{time:.3f}:{common.WALL!r}" for time in np.arange(0.459, 0.4795, 0.001))
CAUSES = {  # what the bound is for: runs on the coarsest grid, full and reduced
    "dt <= 1000 t_s": {},
    "no bound": {"dt-max": common.DURATION},
    "no bound, but a step ends every 247 t_s from 11.33e4 to 11.83e4 t_s": {"dt-max": common.DURATION, "wall-history": KNOTS},
}
CAUSES_MEANING = "paper-shear"


def adaptive_steps(meaning, bound, cells):
    options = {"cells": cells, "model": "full", "advection": "eno2", "scheme": "incremental", "step": "adaptive",
               "tolerance": repr(float(FACTOR / MEANINGS[meaning][1])), "snapshots": common.DURATION}
    return options | ({"dt-max": common.DURATION} if bound else {})


def cause_name(model, cause):
    return f"cause-{model}-{list(CAUSES).index(cause)}"


def cause_steps(model, cause):
    return adaptive_steps(CAUSES_MEANING, "", GRIDS[0]) | {"model": model} | CAUSES[cause]


def run_name(meaning, bound, cells):
    return f"adaptive-{meaning}{bound}-{cells}"


def all_runs(reference_cells):
    runs = {convergence.run_name(CONSTANT, cells): convergence.constant_steps(CONSTANT, cells) for cells in GRIDS}
    for model in ("full", "reduced"):
        options = convergence.SERIES[model][0]
        runs[convergence.run_name(options, reference_cells)] = convergence.reference(options, reference_cells)
        runs |= {cause_name(model, cause): cause_steps(model, cause) for cause in CAUSES}
    return runs | {run_name(meaning, bound, cells): adaptive_steps(meaning, bound, cells)
                   for meaning in MEANINGS for bound in BOUNDS for cells in GRIDS}


def definitions(folder):
    """Q* of the last step of a constant-step run, evaluated from its last two velocities by the paper's formulas, and by the
    program's times sqrt(6 K/|Omega|). Rows: unit of stress, the former, the latter.

    sigma_P = dt C : D(v_n - v_{n-1}), since v grows by the velocity phi of the projection. (53)-(55):
    Q* = sqrt(6 int K sbar_P^2 + mu p_P^2)/(|Omega| mu). The program has Q*^2 = int (sbar_P^2/mu^2 + p_P^2/(K mu))/|Omega|
    = int (K sbar_P^2 + mu p_P^2)/(|Omega| K mu^2): the ratio of the squares is 6 K/|Omega|."""
    now, before = common.load(folder), common.load(folder, -2)
    phi = (now.v - before.v) * common.WALL * common.TIME / common.LENGTH * (now.time - before.time)  # dt phi in L
    phi = np.concatenate([phi, phi[:, :, :1]], axis=2)
    h = 2 / now.cells
    dx = 0.5 / h * (phi[:, 1:, 1:] - phi[:, 1:, :-1] + phi[:, :-1, 1:] - phi[:, :-1, :-1])
    dy = 0.5 / h * (phi[:, 1:, 1:] - phi[:, :-1, 1:] + phi[:, 1:, :-1] - phi[:, :-1, :-1])
    program = Run(folder).history["step_measure"][-1]
    rows = []
    for name, unit in (("s_Y", YIELD), ("mu", SHEAR)):
        bulk, shear = BULK / unit, SHEAR / unit
        trace = dx[0] + dy[1]
        p, s, tau, q = -bulk * trace, shear * (dx[0] - dy[1]), shear * (dy[0] + dx[1]), -shear * trace / 3
        magnitude_squared = s**2 + tau**2 + 3 * q**2
        paper = np.sqrt(6 * np.sum(bulk * magnitude_squared + shear * p**2) * h**2) / (AREA * shear)
        rows.append([name, paper, np.sqrt(6 * bulk / AREA) * program])
    return rows


def series(folder):
    """Times [t_s], steps [t_s] and Q* of the steps of a run."""
    table = Run(folder).history
    keep = table["dt_s"] > 0
    return tuple(table[name][keep] / unit for name, unit in (("time_s", common.TIME), ("dt_s", common.TIME),
                                                             ("step_measure", 1.0)))


def statistics(folder, cells, meaning, fine):
    """Numbers of one run; Q* in the meaning's unit, relative to FACTOR h^2/L^2."""
    time, dt, measure = series(folder)
    ratio = measure * MEANINGS[meaning][1] / (FACTOR * (2 / cells) ** 2)
    first = time[np.searchsorted(time, ONSET)]  # end of the first step that sees plastic flow
    peak = np.argmax(np.where((time >= first) & (time < first + 0.3e4), ratio, 0))
    after = time > time[peak]
    above = np.flatnonzero(after & (ratio > 1))
    errors = common.norms(common.load(folder) - common.interpolate(fine, cells))
    return {"steps": time.size, "before": int(np.sum(time < ONSET)), "peak": ratio[peak], "at": time[peak],
            "above": above.size / max(1, np.sum(after)), "settled": time[above[-1]] if above.size else time[peak],
            "largest": ratio[after].max(), "longest": dt.max(), **errors}


def collect(folders, reference_cells):
    """{(meaning, bound or "constant", cells): statistics}"""
    fine = common.load(folders[convergence.run_name(CONSTANT, reference_cells)])
    result = {}
    for meaning in MEANINGS:
        for cells in GRIDS:
            result[meaning, "constant", cells] = statistics(folders[convergence.run_name(CONSTANT, cells)], cells, meaning, fine)
            for bound in BOUNDS:
                result[meaning, bound, cells] = statistics(folders[run_name(meaning, bound, cells)], cells, meaning, fine)
    return result


def draw_histories(folders, path):
    """Fig. 4: Q* and dt over time, a column for each meaning of Q*."""
    figure, axes = plt.subplots(2, len(MEANINGS), figsize=(13, 7), sharex=True, sharey="row", layout="constrained")
    for (upper, lower), (meaning, (label, scale)) in zip(axes.T, MEANINGS.items()):
        for cells, colour in zip(GRIDS, ("C0", "C1", "C2")):
            runs = {"constant": (convergence.run_name(CONSTANT, cells), ":"),
                    "adaptive": (run_name(meaning, "", cells), "-")}
            for kind, (name, style) in runs.items():
                time, dt, measure = series(folders[name])
                upper.semilogy(time / 1e4, np.maximum(scale * measure, 1e-12), style, color=colour, linewidth=0.9,
                               label=f"{kind}, N = {cells}")
                lower.plot(time / 1e4, dt, style, color=colour, linewidth=0.9)
            upper.axhline(FACTOR * (2 / cells) ** 2, color=colour, linewidth=0.6, dashes=(6, 3))
        upper.set(title=label, ylim=(1e-11, None))
        lower.set(xlabel=r"$t/(10^4\,t_s)$", yscale="log")
    axes[0, 0].set_ylabel(r"$Q^*$ in this meaning (dashed: $10^{-3}h^2/L^2$)")
    axes[1, 0].set_ylabel(r"$\Delta t/t_s$")
    axes[0, 0].legend(fontsize=7)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def draw_errors(result, path):
    """Fig. 5: errors against the number of steps."""
    labels = {"v": r"$E_v/U$", "sigma": r"$E_\sigma/s_Y$", "chi": r"$E_\chi/\chi_\infty$"}
    figure, (*axes, space) = plt.subplots(1, 4, figsize=(14, 4.2), width_ratios=(1, 1, 1, 0.55), layout="constrained")
    for axis, field in zip(axes, FIELDS):
        def line(meaning, bound, style, label):
            rows = [result[meaning, bound, cells] for cells in GRIDS]
            axis.loglog([row["steps"] for row in rows], [row[field] for row in rows], style, markersize=5, linewidth=1, label=label)
        line("strain", "constant", "ks-", "constant")
        for (meaning, (label, _)), colour in zip(MEANINGS.items(), ("C0", "C1", "C2")):
            for bound, style in zip(BOUNDS, ("o-", "v:")):
                line(meaning, bound, colour + style, f"{label}, {BOUNDS[bound].replace('<=', '≤').replace('t_s', '$t_s$')}")
        axis.set(title=labels[field], xlabel="steps")
    space.axis("off")
    space.legend(*axes[0].get_legend_handles_labels(), loc="center left", fontsize=8)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def steps_table(result):
    rows = []
    for meaning, (label, _) in MEANINGS.items():
        for bound, bound_label in BOUNDS.items():
            for cells in GRIDS:
                run, constant = result[meaning, bound, cells], result[meaning, "constant", cells]
                rows.append([label, bound_label, cells, run["steps"], f"{run['steps'] / constant['steps']:.3f}",
                             f"{run['longest']:.0f}", *(f"{run[f]:.2e} ({run[f] / constant[f]:.2f})" for f in FIELDS)])
    return common.markdown_table(["Q*", "bound", "N", "steps", "of constant", "longest dt/t_s", "v (of constant)", "sigma", "chi"], rows)


def peak_table(result):
    rows = []
    for meaning, (label, _) in MEANINGS.items():
        for bound in ("constant", *BOUNDS):
            for cells in GRIDS:
                run = result[meaning, bound, cells]
                rows.append([label, BOUNDS.get(bound, "constant steps"), cells, f"{run['peak']:.3g}", f"{run['at'] / 1e4:.3f}",
                             f"{run['settled'] / 1e4:.2f}", f"{100 * run['above']:.1f} %", f"{run['largest']:.3g}"])
    return common.markdown_table(["Q*", "steps", "N", "peak/tolerance", "at t/1e4 t_s", "last above at t/1e4 t_s",
                                  "steps above after peak", "largest after peak/tolerance"], rows)


def causes_table(folders, reference_cells):
    rows = []
    for model in ("full", "reduced"):
        fine = common.load(folders[convergence.run_name(convergence.SERIES[model][0], reference_cells)])
        for cause in CAUSES:
            folder = folders[cause_name(model, cause)]
            time = series(folder)[0]
            errors = common.norms(common.load(folder) - common.interpolate(fine, GRIDS[0]))
            rows.append([model, cause, time.size, f"{time[np.searchsorted(time, ONSET)] / 1e4:.3f}",
                         *(f"{errors[f]:.2e}" for f in FIELDS)])
    return common.markdown_table(["model", "steps", "number", "first plastic step ends at t/1e4 t_s", *FIELDS], rows)


def report(result, folders, reference_cells):
    constant = common.markdown_table(["N", "steps", "v", "sigma", "chi"], [
        [cells, run["steps"], *(f"{run[f]:.2e}" for f in FIELDS)]
        for cells in GRIDS for run in [result["strain", "constant", cells]]])
    check = common.markdown_table(["unit of stress", "by (53)-(55)", "sqrt(6 K/area) Q* of the program"], [
        [name, f"{paper:.6e}", f"{program:.6e}"]
        for name, paper, program in definitions(folders[convergence.run_name(CONSTANT, GRIDS[0])])])
    tolerances = common.markdown_table(["Q*", "--tolerance"], [
        [label, f"{FACTOR / scale:.4e}"] for label, scale in MEANINGS.values()])
    return "\n".join([
        f"# Adaptive steps\n\n{common.provenance()}\n",
        f"Full model, errors against N = {reference_cells} as in convergence.md. F_Q = 0.001 in three "
        "meanings of Q*.\n", tolerances,
        "## The paper's Q* from the program's\n\nLast step of the constant run on the coarsest grid:\n", check,
        "## Constant steps\n", constant, "## Steps and errors of adaptive runs\n", steps_table(result),
        f"## Q* at yield onset and after\n\nPeak: the largest Q* in the 0.3e4 t_s from the first step that ends after yield, "
        f"t = {ONSET / 1e4:.3f}e4 t_s.\n", peak_table(result),
        f"## What the bound dt <= 1000 t_s is for\n\nN = {GRIDS[0]}, Q* {MEANINGS[CAUSES_MEANING][0]}.\n",
        causes_table(folders, reference_cells)])


def main():
    options = common.reference_option(common.jobs_option(common.parser(__doc__))).parse_args()
    folders = common.run_all(options.program, options.work, all_runs(options.reference), options.jobs)
    result = collect(folders, options.reference)
    columns = list(next(iter(result.values())))
    common.publish(options.results, "adaptive", report(result, folders, options.reference),
                   ["measure", "steps", "cells", *columns],
                   [[meaning, bound.lstrip("-") or "bounded", cells, *(f"{run[c]:.6g}" for c in columns)]
                    for (meaning, bound, cells), run in result.items()])
    draw_histories(folders, options.results / "adaptive_histories.png")
    draw_errors(result, options.results / "adaptive_errors.png")


if __name__ == "__main__":
    main()
