#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Work and precision of the time integrators on the shear band: error against elliptic solves and against processor time.

For 128, 252 and 504 cells a side, full and reduced model: every scheme with several steps or tolerances, each on one thread. Two
errors at t = 35e4 t_s in the norm (59): in time, against a run on the same grid with a tolerance at which the answer no longer
changes; and in total, against 2520 x 2520 cells (the references of convergence.py). Costs are the elliptic solves and the processor
time of the whole process, which other programs on the machine disturb little.

    verification/work_precision.py
"""

import matplotlib.pyplot as plt
import numpy as np

import common
import convergence
from common import FIELDS

GRIDS = (128, 252, 504)
MODELS = ("full", "reduced")
T = common.TIME

# Families: label, options, what varies, its values (on 504 cells every second one); longest runs first. Steps are given relative to the paper's 0.5e4 t_s h/L, or in t_s.
FAMILIES = {
    "Euler projection": ({"scheme": "euler", "step": "fixed"}, "paper's step times", (2, 4, 8)),
    "first-order projection": ({"scheme": "substepped", "step": "fixed"}, "paper's step times", (2, 4, 8)),
    "incremental projection": ({"scheme": "incremental", "step": "fixed"}, "paper's step times", (1, 2, 4, 8, 16)),
    "incremental, adaptive": ({"scheme": "incremental", "step": "adaptive"}, "tolerance", (1e-4, 1e-3, 1e-2, 1e-1)),
    "incremental, extrapolated": ({"scheme": "extrapolated", "step": "fixed"}, "paper's step times", (2, 4, 8, 16, 32)),
    "Ralston": ({"scheme": "ralston", "step": "adaptive"}, "tolerance", (1e-6, 1e-5, 1e-4, 1e-3)),
    "Bogacki-Shampine": ({"scheme": "bogacki-shampine", "step": "adaptive"}, "tolerance", (1e-6, 1e-5, 1e-4, 1e-3)),
    "Dormand-Prince": ({"scheme": "dormand-prince", "step": "adaptive"}, "tolerance", (1e-6, 1e-5, 1e-4, 1e-3)),
    "Chebyshev": ({"scheme": "chebyshev", "step": "adaptive"}, "tolerance", (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)),
    "ARKODE, Bogacki-Shampine": ({"scheme": "arkode-3", "step": "adaptive"}, "tolerance", (1e-6, 1e-5, 1e-4, 1e-3)),
    "ARKODE, Dormand-Prince": ({"scheme": "arkode-5", "step": "adaptive"}, "tolerance", (1e-6, 1e-5, 1e-4, 1e-3)),
    "CVODE, Adams": ({"scheme": "cvode-adams", "step": "adaptive"}, "tolerance", (1e-6, 1e-5, 1e-4, 1e-3)),
    "CVODE, BDF": ({"scheme": "cvode-bdf", "step": "adaptive"}, "tolerance", (1e-5, 1e-4, 1e-3)),
    "MRIStep": ({"scheme": "mri", "step": "fixed"}, "step in t_s", (500, 1000, 2000, 4000)),
}
PAPER = ("incremental projection", 1)  # constant steps of Sec. 8.1
EXACT = {"scheme": "bogacki-shampine", "step": "adaptive", "tolerance": "1e-7"}
CHECK = {"scheme": "dormand-prince", "step": "adaptive", "tolerance": "1e-7"}  # how far two tight runs are apart
STYLES = ["ks-", "k^-", "ko-", "kv:", "C5D-", "C0o-", "C1o-", "C2o-", "C3o-", "C1+:", "C2+:", "C4x-", "C6x-", "C9*-"]


def values_of(family, cells):
    return FAMILIES[family][2][::2 if cells > 300 else 1]


def options_of(family, value, cells, model):
    options, varied, _ = FAMILIES[family]
    if varied == "tolerance":
        chosen = {"tolerance": repr(value)}
    else:
        chosen = {"dt": repr(value * (T if varied == "step in t_s" else common.constant_step(cells)))}
        if options["scheme"] == "mri":
            chosen["tolerance"] = "1e-5"
    return {"cells": cells, "model": model, "advection": "eno2", **options, **chosen, "snapshots": common.DURATION, "history-every": 1000}


def run_name(family, value, cells, model):
    return f"{model}-{cells}-{FAMILIES[family][0]['scheme']}-{FAMILIES[family][0]['step']}-{value:g}"


def all_runs():
    runs = {}
    for cells in GRIDS:
        for model in MODELS:
            common_part = {"cells": cells, "model": model, "advection": "eno2", "snapshots": common.DURATION, "history-every": 1000}
            runs[f"{model}-{cells}-exact"] = EXACT | common_part
            runs[f"{model}-{cells}-check"] = CHECK | common_part
            for family in FAMILIES:
                runs |= {run_name(family, value, cells, model): options_of(family, value, cells, model)
                         for value in values_of(family, cells)}
    return runs


def collect(folders, references):
    """{(cells, model): {(family, value): numbers}}, {(cells, model): distances of the tight runs and of space}"""
    result, limits = {}, {}
    for cells in GRIDS:
        for model in MODELS:
            exact = common.load(folders[f"{model}-{cells}-exact"])
            fine = common.interpolate(common.load(references[model]), cells)
            limits[cells, model] = (common.norms(common.load(folders[f"{model}-{cells}-check"]) - exact), common.norms(exact - fine))
            rows = result[cells, model] = {}
            for family in FAMILIES:
                for value in values_of(family, cells):
                    folder = folders[run_name(family, value, cells, model)]
                    fields, summary = common.load(folder), common.summary(folder)
                    rows[family, value] = {
                        "steps": summary["steps"] + summary["extra"]["inner_steps"], "solves": summary["elliptic_solves"],
                        "seconds": summary["processor_seconds"], "time": common.norms(fields - exact), "total": common.norms(fields - fine)}
    return result, limits


def table(rows, limits, paper):
    lines = []
    for (family, value), run in rows.items():
        lines.append([family, f"{value:g}", run["steps"], run["solves"], f"{run['seconds']:.2f}",
                      *(f"{run['time'][f]:.1e}" for f in FIELDS), *(f"{run['total'][f]:.2e}" for f in FIELDS),
                      f"{paper['solves'] / run['solves']:.1f}", f"{paper['seconds'] / run['seconds']:.1f}"])
    check, space = limits
    note = ("\nTwo tight runs of different methods differ by " + ", ".join(f"{check[f]:.1e} ({f})" for f in FIELDS)
            + "; the error in space is " + ", ".join(f"{space[f]:.2e} ({f})" for f in FIELDS) + ".\n")
    return common.markdown_table(
        ["scheme", "step or tolerance", "steps", "solves", "processor s", *(f"in time: {f}" for f in FIELDS),
         *(f"in total: {f}" for f in FIELDS), "fewer solves than the paper's", "less time"], lines) + note


def draw(result, limits, path, cost, label):
    figure, axes = plt.subplots(len(MODELS), len(GRIDS), figsize=(15, 9), sharey="row", layout="constrained")
    for row, model in zip(axes, MODELS):
        for axis, cells in zip(row, GRIDS):
            rows = result[cells, model]
            for family, style in zip(FAMILIES, STYLES):
                runs = [rows[family, value] for value in values_of(family, cells)]
                axis.loglog([run[cost] for run in runs], [run["time"]["sigma"] for run in runs], style, markersize=4, linewidth=1, label=family)
            axis.axhline(limits[cells, model][1]["sigma"], color="grey", linewidth=0.8, dashes=(6, 3))
            axis.set_title(f"{model} model, {cells} x {cells}")
            axis.set_xlabel(label)
            axis.set_ylim(1e-8, 3e-2)
        row[0].set_ylabel(r"error in time of $\sigma/s_Y$ (dashed: error in space)")
    axes[0, -1].legend(fontsize=7)
    figure.savefig(path, dpi=90)
    plt.close(figure)


def main():
    options = common.reference_option(common.jobs_option(common.parser(__doc__, work="out/verification/work_precision"))).parse_args()
    folders = common.run_all(options.program, options.work, all_runs(), options.jobs, timed=True)
    finest = {}
    for model in MODELS:
        kind = convergence.SERIES[model][0]
        name = convergence.run_name(kind, options.reference)
        finest[name] = convergence.reference(kind, options.reference)
    kept = common.run_all(options.program, options.work.parent / "runs", finest, options.jobs)
    references = {model: kept[convergence.run_name(convergence.SERIES[model][0], options.reference)] for model in MODELS}
    result, limits = collect(folders, references)

    text = [f"# Work and precision of the time integrators\n\n{common.provenance()}\n",
            "Errors at t = 35e4 t_s in the norm (59), divided by U, s_Y, chi_inf. Steps: multiples of the paper's 0.5e4 t_s h/L (projection) or "
            "t_s (MRIStep). One thread, processor time of the whole process.\n"]
    for cells in GRIDS:
        for model in MODELS:
            rows = result[cells, model]
            text.append(f"## {model} model, {cells} x {cells} cells\n\n" + table(rows, limits[cells, model], rows[PAPER]))
    common.publish(options.results, "work_precision", "\n".join(text),
                   ["cells", "model", "scheme", "value", "steps", "solves", "seconds", *(f"time {f}" for f in FIELDS), *(f"total {f}" for f in FIELDS)],
                   [[cells, model, family, f"{value:g}", run["steps"], run["solves"], f"{run['seconds']:.3f}",
                     *(f"{run['time'][f]:.4e}" for f in FIELDS), *(f"{run['total'][f]:.4e}" for f in FIELDS)]
                    for (cells, model), rows in result.items() for (family, value), run in rows.items()])
    draw(result, limits, options.results / "work_precision_solves.png", "solves", "elliptic solves")
    draw(result, limits, options.results / "work_precision_seconds.png", "seconds", "processor seconds")


if __name__ == "__main__":
    main()
