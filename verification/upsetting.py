#!/usr/bin/env python3
"""Upsetting: load over deflection for several steps and meshes, Figs. 12 and 13 of Sulsky & Kaul, and what the solvers cost.

The load jumps when particles cross cell edges, so curves are compared by their means over windows of 0.8 mm, in which contact has
been made (from the second on). Runs are kept in the work folder.

    verification/upsetting.py         # two minutes
"""

import matplotlib.pyplot as plt
import numpy as np

import common

WINDOW, END = 0.8e-3, 9.5e-3  # [m]
STEPS = (1e-5, 2e-5, 1e-4, 1e-3)
CELLS = (1e-3, 5e-4, 2.5e-4)
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


def seconds(summary):
    """Of the steps alone, without files."""
    return sum(value for phase, value in summary["phase_seconds"].items() if phase != "output")


def windows(history):
    """Mean load in each window [N]."""
    number = np.floor(history["deflection_m"] / WINDOW - 1e-9).astype(int)
    return np.array([history["load_N"][number == k].mean() for k in range(int(END / WINDOW))])


def main():
    arguments = common.parser(__doc__, work="out/verification/upsetting").parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    program = arguments.program.parent / "upsetting"

    def run(name, options):
        folder = common.run(program, arguments.work / name, {"snapshots": 0, **options})
        return common.summary(folder), common.history(folder)

    explicit = run("explicit", {"method": "explicit", "dt": "auto", "history-every": 50})
    steps = {dt: run(f"dt-{dt:g}", {"dt": dt}) for dt in STEPS}
    meshes = {cell: run(f"cell-{cell:g}", {"dt": 1e-4, "cell-size": cell}) for cell in CELLS}
    shapes = {shape: run(f"shape-{shape}", {"dt": 1e-4, "shape": shape}) for shape in SHAPES}
    solvers = {cell: {name: run(f"solver-{cell:g}-{number}", {"dt": 1e-4, "cell-size": cell, **options})[0]
                      for number, (name, options) in enumerate(SOLVERS.items())} for cell in CELLS[:2]}

    reference = windows(explicit[1])
    rows = []
    for dt, (summary, history) in steps.items():
        # a step of 1e-3 s is longer than a window
        deviation = f"{np.max(np.abs(windows(history) / reference - 1)[1:]):.3f}" if dt < 1e-3 else ""
        rows.append([f"{dt:g}", summary["steps"], summary["rejected_steps"], summary["newton_iterations"], summary["linear_iterations"],
                     deviation, f"{seconds(summary) / seconds(explicit[0]):.4f}",
                     f"{summary['extra']['mean_load_of_last_3_percent_N'] / 1e3:.0f}", f"{summary['extra']['final_radius_m'] * 1e3:.2f}"])
    header = ["dt [s]", "steps", "failed", "Newton", "linear", "largest deviation", "time", "last 3 % [kN]", "radius [mm]"]
    text = f"# Upsetting\n\n{common.provenance()}\n\n"
    extra = explicit[0]["extra"]
    text += (f"Explicit: {explicit[0]['steps']} steps, {seconds(explicit[0]):.2f} s, mean load of the last 3 % "
             f"{extra['mean_load_of_last_3_percent_N'] / 1e3:.0f} kN, radius {extra['final_radius_m'] * 1e3:.2f} mm.\n"
             "Implicit, 1 mm; \"largest deviation\" from the explicit run of the mean load in windows of 0.8 mm, from the second on; "
             "\"time\" is that of the steps, the explicit run's being 1.\n\n")
    text += common.markdown_table(header, rows)
    for title, runs in (("Cells of 1, 0.5 and 0.25 mm, dt = 1e-4 s", meshes), ("Shape functions, 1 mm, dt = 1e-4 s", shapes)):
        text += f"\n{title}:\n\n" + common.markdown_table(
            ["", "steps", "failed", "Newton", "linear", "seconds", "last 3 % [kN]", "final load [kN]", "radius [mm]"],
            [[key, s["steps"], s["rejected_steps"], s["newton_iterations"], s["linear_iterations"], f"{seconds(s):.2f}",
              f"{s['extra']['mean_load_of_last_3_percent_N'] / 1e3:.0f}", f"{s['extra']['final_load_N'] / 1e3:.0f}",
              f"{s['extra']['final_radius_m'] * 1e3:.2f}"] for key, (s, _) in runs.items()])
    for cell, runs in solvers.items():
        text += f"\nSolvers, {cell * 1e3:g} mm, dt = 1e-4 s:\n\n" + common.markdown_table(
            ["", "steps", "failed", "Newton", "linear", "seconds"],
            [[name, s["steps"], s["rejected_steps"], s["newton_iterations"], s["linear_iterations"], f"{seconds(s):.2f}"]
             for name, s in runs.items()])
    common.publish(arguments.results, "upsetting", text, header, rows)

    figure, axes = plt.subplots(1, 2, figsize=(11, 4.2), sharey=True, layout="constrained")
    curves = {"explicit": explicit} | {f"dt = {dt:g} s": run_ for dt, run_ in steps.items()}
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
