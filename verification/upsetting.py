#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Upsetting: load over deflection for several steps and meshes, Figs. 12 and 13 of Sulsky & Kaul, and what the solvers cost.

The load jumps when particles cross cell edges, so curves are compared by their means over windows of 0.8 mm. Runs are kept in the
work folder.

    verification/upsetting.py         # four minutes
"""

import matplotlib.pyplot as plt
import numpy as np

import common
from results import Run

WINDOW, END = 0.8e-3, 9.5e-3  # [m]
STEPS = (1e-5, 2e-5, 5e-5, 1e-4, 1e-3)
CELLS = (1e-3, 5e-4, 2.5e-4)
FORMS = ("velocity", "momentum")
SHAPES = ("linear", "gimp", "bspline")
SOLVERS = {  # at dt = 1e-4 s
    "default (tangent, energy line search)": {},
    "diagonal": {"preconditioner": "diagonal"},
    "no preconditioner": {"preconditioner": "none", "krylov-vectors": 100},
    "residual line search": {"line-search": "residual"},
    "no line search": {"line-search": "none"},
    "KINSOL": {"solver": "kinsol-gmres"},
    "Newton-CG": {"solver": "newton-cg"},
    "difference quotients": {"jacobian": "difference"},
    "momentum form": {"form": "momentum"},
    "quasi-static": {"method": "quasi-static"},
}
SLOW = ("no preconditioner", "no line search")  # left out on the finest mesh, where the first was not done after ten minutes


def windows(history):
    """Mean load in each window [N], the curve taken as straight from row to row."""
    way, load = (history[name] for name in ("deflection_m", "load_N"))
    edges = np.arange(int(END / WINDOW) + 1) * WINDOW
    places = np.union1d(way, edges)
    load = np.interp(places, way, load)
    work = np.concatenate([[0.0], np.cumsum(np.diff(places) * 0.5 * (load[1:] + load[:-1]))])
    return np.diff(np.interp(edges, places, work)) / WINDOW


def main():
    arguments = common.parser(__doc__, work="out/verification/upsetting").parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    program = arguments.program.parent / "upsetting"

    def run(name, options):
        folder = common.run(program, arguments.work / name, {"snapshots": 0, **options})
        return common.summary(folder), Run(folder).history

    explicit = run("explicit", {"method": "explicit", "dt": "auto", "stable-step": "bar", "history-every": 50})
    shorter = {safety: run(f"explicit-{safety}", {"method": "explicit", "dt": "auto", "stable-step": "bar", "safety": safety, "history-every": 50})
               for safety in (0.45, 0.4, 0.3)}
    # the steps begin at a fifth of their length, at contact, too
    steps = {(form, dt): run(f"{form}-{dt:g}", {"dt": dt, "dt-start": dt / 5, "form": form}) for form in FORMS for dt in STEPS}
    meshes = {cell: run(f"cell-{cell:g}", {"dt": 1e-4, "cell-size": cell}) for cell in CELLS}
    shapes = {shape: run(f"shape-{shape}", {"dt": 1e-4, "shape": shape}) for shape in SHAPES}
    solvers = {cell: {name: run(f"solver-{cell:g}-{number}", {"dt": 1e-4, "cell-size": cell, **options})[0]
                      for number, (name, options) in enumerate(SOLVERS.items()) if cell > CELLS[-1] or name not in SLOW} for cell in CELLS}

    reference = windows(explicit[1])
    rows = []

    def add_row(form, dt, summary, history):
        deviation = windows(history) / reference - 1
        first, second, rest = deviation[0], deviation[1], np.max(np.abs(deviation[2:]))
        # a step of 1e-3 s is longer than a window
        compared = [f"{first:+.3f}", f"{second:+.3f}", f"{rest:.3f}"] if dt != 1e-3 else 3 * [""]
        rows.append([form, f"{dt:g}" if dt else "", summary["steps"], summary["rejected_steps"], summary["newton_iterations"],
                     summary["linear_iterations"], *compared, f"{common.step_seconds(summary) / common.step_seconds(explicit[0]):.4f}",
                     f"{summary['extra']['mean_load_of_last_3_percent_N'] / 1e3:.0f}", f"{summary['extra']['final_radius_m'] * 1e3:.2f}"])

    for (form, dt), outcome in steps.items():
        add_row(form, dt, *outcome)
    for safety, outcome in shorter.items():
        add_row(f"explicit, safety {safety}", None, *outcome)
    header = ["form", "dt [s]", "steps", "failed", "Newton", "linear", "first window", "second", "others", "time", "last 3 % [kN]",
              "radius [mm]"]
    text = f"# Upsetting\n\n{common.provenance()}\n\n"
    extra = explicit[0]["extra"]
    text += (f"Explicit (momentum form): {explicit[0]['steps']} steps, {common.step_seconds(explicit[0]):.2f} s, mean load of the last 3 % "
             f"{extra['mean_load_of_last_3_percent_N'] / 1e3:.0f} kN, radius {extra['final_radius_m'] * 1e3:.2f} mm.\n"
             "Implicit, 1 mm, first steps of dt/5: deviation from the explicit run of the mean load in windows of 0.8 mm, in the first (contact), the "
             "second (the platen reaches the next row of nodes) and the largest of the others; explicit runs with shorter steps beside them; \"time\" is that of the steps, the "
             "explicit run's being 1.\n\n")
    text += common.markdown_table(header, rows)
    for title, runs in (("Cells of 1, 0.5 and 0.25 mm, dt = 1e-4 s", meshes), ("Shape functions, 1 mm, dt = 1e-4 s", shapes)):
        text += f"\n{title}:\n\n" + common.markdown_table(
            ["", "steps", "failed", "Newton", "linear", "seconds", "last 3 % [kN]", "final load [kN]", "radius [mm]"],
            [[key, s["steps"], s["rejected_steps"], s["newton_iterations"], s["linear_iterations"], f"{common.step_seconds(s):.2f}",
              f"{s['extra']['mean_load_of_last_3_percent_N'] / 1e3:.0f}", f"{s['extra']['final_load_N'] / 1e3:.0f}",
              f"{s['extra']['final_radius_m'] * 1e3:.2f}"] for key, (s, _) in runs.items()])
    for cell, runs in solvers.items():
        text += f"\nSolvers, {cell * 1e3:g} mm, dt = 1e-4 s:\n\n" + common.markdown_table(
            ["", "steps", "failed", "Newton", "linear", "seconds"],
            [[name, s["steps"], s["rejected_steps"], s["newton_iterations"], s["linear_iterations"], f"{common.step_seconds(s):.2f}"]
             for name, s in runs.items()])
    common.publish(arguments.results, "upsetting", text, header, rows)

    figure, axes = plt.subplots(1, 2, figsize=(11, 4.2), sharey=True, layout="constrained")
    curves = {"explicit": explicit} | {f"dt = {dt:g} s": run_ for (form, dt), run_ in steps.items() if form == "velocity"}
    for axis, lines in zip(axes, (curves, {f"{cell * 1e3:g} mm": run_ for cell, run_ in meshes.items()})):
        for label, (_, history) in lines.items():
            axis.plot(history["deflection_m"] * 1e3, history["load_N"] / 1e3, linewidth=1, label=label)
        axis.set(xlabel="way of the platen [mm]", ylim=(0, 1200))
        axis.legend()
    axes[0].set(ylabel="load [kN]", title="1 mm")
    axes[1].set(title="dt = 1e-4 s")
    figure.savefig(arguments.results / "upsetting.png", dpi=130)


if __name__ == "__main__":
    main()
