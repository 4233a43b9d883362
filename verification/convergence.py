#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Order of accuracy of the incremental scheme with constant steps: Sec. 8.1 and Fig. 3 of Lu & Rycroft.

The shear band on 280, 360 and 504 cells a side with dt = 0.5e4 t_s h/L, by the reduced and the full model, and by the full
model with the paper's stiffness (S.20), each against the same model on 2520 x 2520 cells, integrated in time by an
index-reduced scheme with error control. Errors at the final
time in the norm (59). Besides, the order in time alone, by halving the step on one coarse grid. Every run is kept in the work
folder: an interrupted study goes on where it stopped.

    verification/convergence.py
"""

import matplotlib.pyplot as plt
import numpy as np

import common
from common import FIELDS, GRIDS

SERIES = {  # name: options, name of the reference
    "reduced": ({"model": "reduced", "operator": "exact"}, "reduced"),
    "full": ({"model": "full", "operator": "exact"}, "full"),
    "full, stiffness (S.20)": ({"model": "full", "operator": "full"}, "full"),
}
HALVINGS = range(-2, 3)  # order in time: steps of the paper's size times 2^-k
TIME_CELLS = 100
LABELS = {"v": r"$E_v/U$", "sigma": r"$E_\sigma/s_Y$", "chi": r"$E_\chi/\chi_\infty$", "v centred": r"$E_v/U$, $v$ centred in time"}


def run_name(options, cells):
    return f"{options['model']}-{options['operator']}-{cells}"


def constant_steps(options, cells):
    """Options of a run that ends with the snapshots of its last two steps."""
    before = common.DURATION - common.constant_step(cells)
    return {"cells": cells, **options, "advection": "eno2", "scheme": "incremental", "step": "fixed", "dt": "auto",
            "snapshots": f"{before:.15g},{common.DURATION}"}


def reference(options, cells):
    """The index-reduced scheme is so much cheaper that its error in time can be made negligible; it has no lag in v."""
    return {"cells": cells, **options, "advection": "eno2", "scheme": "bogacki-shampine", "step": "adaptive", "tolerance": "1e-5",
            "snapshots": common.DURATION}


def halved_name(model, halving):
    return f"{model}-exact-{TIME_CELLS}-halved{halving:+d}"


def all_runs(reference_cells):
    runs = {}
    for model in ("reduced", "full"):
        for halving in HALVINGS:
            dt = common.constant_step(TIME_CELLS) * 2.0**-halving
            runs[halved_name(model, halving)] = {"cells": TIME_CELLS, "model": model, "advection": "eno2", "scheme": "incremental", "step": "fixed",
                                                 "dt": repr(dt), "snapshots": common.DURATION}
    for options, reference_series in SERIES.values():
        runs |= {run_name(options, cells): constant_steps(options, cells) for cells in GRIDS}
        options = SERIES[reference_series][0]
        runs[run_name(options, reference_cells)] = reference(options, reference_cells)
    return runs


def errors_of(folder, fine):
    """Errors of the run in `folder` against the fields `fine`, and the lag of its velocity.

    v_{n+1} of the scheme is the velocity at n + 1/2. Its rate in time, from the last two steps, moves it to the final time:
    "v centred"."""
    coarse, before = common.load(folder), common.load(folder, -2)
    error = coarse - common.interpolate(fine, coarse.cells)
    result = common.norms(error)
    moved = (coarse - before).map(lambda change: 0.5 * change)  # by half a step
    error.v += moved.v
    return result | {"v centred": common.norms(error)["v"]}, common.norms(moved)["v"]


def study(folders, reference_cells):
    """{series: ([errors by grid], [lag by grid])}"""
    result = {}
    for series, (options, reference_series) in SERIES.items():
        fine = common.load(folders[run_name(SERIES[reference_series][0], reference_cells)])
        pairs = [errors_of(folders[run_name(options, cells)], fine) for cells in GRIDS]
        result[series] = ([errors for errors, _ in pairs], [lag for _, lag in pairs])
    return result


def slopes(errors, reference_cells):
    """{field: (raw slope, corrected slope)}"""
    h, h_reference = [2 / cells for cells in GRIDS], 2 / reference_cells
    series = {field: [e[field] for e in errors] for field in LABELS}
    return {field: (common.slope(h, e), common.corrected_slope(h, e, h_reference)[0]) for field, e in series.items()}


def orders_without_reference(folders):
    """Rows: series, and for every field the p with which the grids' distances to the finest of them, C (h^p - h_finest^p), agree."""
    rows = []
    for series, (options, _) in SERIES.items():
        *coarse, finest = (folders[run_name(options, cells)] for cells in GRIDS)
        errors = [errors_of(folder, common.load(finest))[0] for folder in coarse]
        h = [2 / cells for cells in GRIDS]
        rows.append([series, *(f"{common.corrected_slope(h[:-1], [e[f] for e in errors], h[-1])[0]:.2f}" for f in FIELDS)])
    return rows


def orders_in_time(folders):
    """Rows: model, dt/t_s, change of every field from dt to dt/2, and log2 of its ratio to the next."""
    rows = []
    for model in ("reduced", "full"):
        runs = [common.load(folders[halved_name(model, halving)]) for halving in HALVINGS]
        changes = [common.norms(a - b) for a, b in zip(runs, runs[1:])]
        for halving, change, following in zip(HALVINGS, changes, [*changes[1:], None]):
            orders = [f"{np.log2(change[f] / following[f]):.2f}" if following else "" for f in FIELDS]
            step = common.constant_step(TIME_CELLS) / common.TIME * 2.0**-halving
            rows.append([model, f"{step:g}", *(f"{change[f]:.2e}" for f in FIELDS), *orders])
    return rows


def interpolation_check(folders, reference_cells):
    """Rows: model, and for every field the bound of interpolation_errors and the change from a lower degree."""
    rows = []
    for model in ("reduced", "full"):
        fine = common.load(folders[run_name(SERIES[model][0], reference_cells)])
        bound = common.interpolation_errors(fine)
        for cells in GRIDS:
            change = common.norms(common.interpolate(fine, cells) - common.interpolate(fine, cells, common.DEGREE - 2))
            rows.append([model, cells, *(f"{change[f]:.1e}" for f in FIELDS), *(f"{bound[f]:.1e}" for f in FIELDS)])
    return rows


def draw(result, reference_cells, path):
    figure, axes = plt.subplots(1, len(SERIES), figsize=(12, 4.2), sharey=True, layout="constrained")
    for axis, (series, (errors, _)) in zip(axes, result.items()):
        order = slopes(errors, reference_cells)
        for (field, label), marker in zip(LABELS.items(), "osd^"):
            axis.loglog(GRIDS, [e[field] for e in errors], marker + "-", linewidth=1, markersize=5,
                        label=f"{label}: {order[field][0]:.2f} ({order[field][1]:.2f})")
        start = 0.6 * min(errors[0][field] for field in LABELS)
        axis.loglog(GRIDS, [start * (GRIDS[0] / n) ** 2 for n in GRIDS], "k--", linewidth=0.8, label="slope 2")
        axis.set(title=series, xlabel="N")
        axis.set_xticks(GRIDS, [str(n) for n in GRIDS])
        axis.minorticks_off()
        axis.legend(loc="upper right", fontsize=8, title="slope (corrected for the reference)", title_fontsize=8)
    axes[0].set_ylabel(f"error against N = {reference_cells}")
    axes[0].set_ylim(top=8 * axes[0].get_ylim()[1])  # room for the legends
    figure.savefig(path, dpi=110)
    plt.close(figure)


def report(result, folders, reference_cells):
    text = [f"# Convergence with constant steps\n\n{common.provenance()}\n",
            "Errors at t = 35e4 t_s in the norm (59), divided by U, s_Y, chi_inf; dt = 0.5e4 t_s h/L, incremental scheme, "
            f"against N = {reference_cells} with the same model, index-reduced Bogacki-Shampine steps with tolerance 1e-5.\n"
            "\"v centred\": the velocity moved from the middle of the last step, where the scheme has it, to the final time.\n\"lag\": the distance of this move for the coarse grid, first order in time.\n",
            "Slope: linear regression of log E on log h. Corrected: p of E = C (h^p - h_ref^p), least squares of log E over p "
            "and C; right if the reference's error has the shape of the coarse grids' errors.\n"]
    for series, (errors, lags) in result.items():
        order = slopes(errors, reference_cells)
        rows = [[cells, *(f"{e[field]:.3e}" for field in LABELS), f"{lag:.2e}"] for cells, e, lag in zip(GRIDS, errors, lags)]
        rows.append(["slope", *(f"{order[field][0]:.2f}" for field in LABELS), ""])
        rows.append(["corrected", *(f"{order[field][1]:.2f}" for field in LABELS), ""])
        text.append(f"## {series}\n\n" + common.markdown_table(["N", "v", "sigma", "chi", "v centred", "lag of v"], rows))
    text.append("## Orders from the three grids alone\n\n"
                f"Distances to the run on {GRIDS[-1]} cells instead of the reference, the same correction: two equations for p and "
                "C.\n\n" + common.markdown_table(["", *FIELDS], orders_without_reference(folders)))
    text.append(f"## Order in time alone\n\nN = {TIME_CELLS}; change of the final fields when the step is halved, and the order "
                f"from one change to the next. The step of the other tables would be {1e4 / TIME_CELLS:g} t_s.\n\n"
                + common.markdown_table(["model", "dt/t_s", *FIELDS, *(f"order of {f}" for f in FIELDS)], orders_in_time(folders)))
    if all(common.nested(reference_cells, cells) for cells in GRIDS):
        text.append("The grids nest in the reference: nothing is interpolated.\n")
    else:
        text.append("## Interpolation of the reference\n\n"
                    f"Fourier in x, polynomials of degree {common.DEGREE} in y. Change: against degree {common.DEGREE - 2}, on the grid "
                    "of the errors. Bound: the reference thinned to every third point, interpolated back, minus itself.\n\n"
                    + common.markdown_table(["reference", "N", "change v", "sigma", "chi", "bound v", "sigma", "chi"],
                                            interpolation_check(folders, reference_cells)))
    return "\n".join(text)


def main():
    options = common.reference_option(common.jobs_option(common.parser(__doc__))).parse_args()
    folders = common.run_all(options.program, options.work, all_runs(options.reference), options.jobs)
    result = study(folders, options.reference)
    common.publish(options.results, "convergence", report(result, folders, options.reference),
                   ["series", "cells", *LABELS, "lag of v"],
                   [[series, cells, *(f"{e[field]:.6e}" for field in LABELS), f"{lag:.6e}"]
                    for series, (errors, lags) in result.items() for cells, e, lag in zip(GRIDS, errors, lags)])
    draw(result, options.reference, options.results / "convergence.png")


if __name__ == "__main__":
    main()
