#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What time integrators do to energy: the colliding disks (Fig. 3 of Sulsky & Kaul) and the vibrating bar, against the step.

    verification/energy.py            # a minute
"""

import matplotlib.pyplot as plt

import common
from results import Run

METHODS = {"explicit": {"method": "explicit"}, "mu = 1": {"method": "implicit", "mu": 1}, "mu = 0.75": {"method": "implicit", "mu": 0.75},
           "mu = 0.5": {"method": "implicit", "mu": 0.5}, "midpoint": {"method": "midpoint"}}
DISK_STEPS = (0.02438, 0.06, 0.12, 0.2438, 0.6, 2.438)
BAR_STEPS = (0.0125, 0.025, 0.05, 0.1, 0.2)
SHAPES = ("linear", "gimp", "bspline")


def main():
    arguments = common.parser(__doc__, work="out/verification/energy").parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)

    def run(program, name, options):
        folder = common.run(arguments.program.parent / program, arguments.work / name, {"snapshots": 0, **options})
        return common.summary(folder)["extra"], Run(folder).history

    disks = {(method, dt): run("colliding_disks", f"disks-{number}-{dt}", {**options, "dt": dt})
             for number, (method, options) in enumerate(METHODS.items()) for dt in DISK_STEPS
             if method != "explicit" or dt == DISK_STEPS[0]}
    bars = {(method, shape, dt): run("vibrating_bar", f"bar-{number}-{shape}-{dt}", {**options, "dt": dt, "shape": shape})[0]
            for number, (method, options) in enumerate(METHODS.items()) for shape in SHAPES for dt in BAR_STEPS
            if method != "explicit" or dt <= 0.05}

    text = f"# Energy\n\n{common.provenance()}\n\nColliding disks, energy left at t = 150 s of that at the start:\n\n"
    rows = [[method, *(f"{disks[method, dt][0]['energy_kept']:.4f}" if (method, dt) in disks else "" for dt in DISK_STEPS)]
            for method in METHODS]
    text += common.markdown_table(["dt [s]", *map(str, DISK_STEPS)], rows)
    numbers = [["disks", *row] for row in rows]
    for quantity, title in (("energy_kept", "energy left after ten periods"), ("period_s", "period, exactly 10 s")):
        rows = [[f"{method}, {shape}", *(f"{bars[method, shape, dt][quantity]:.5f}" if (method, shape, dt) in bars else "" for dt in BAR_STEPS)]
                for method in METHODS for shape in SHAPES]
        text += f"\nVibrating bar, 25 cells, {title}:\n\n" + common.markdown_table(["dt [s]", *map(str, BAR_STEPS)], rows)
        numbers += [[f"bar {quantity}", *row] for row in rows]
    common.publish(arguments.results, "energy", text, ["", "dt [s]", *DISK_STEPS], numbers)

    shown = [("explicit", 0.02438), ("mu = 1", 0.02438), ("mu = 1", 0.2438), ("mu = 1", 2.438), ("midpoint", 0.2438)]
    figure, axes = plt.subplots(1, len(shown), figsize=(16, 3.4), sharey=True, layout="constrained")
    for axis, (method, dt) in zip(axes, shown):
        history = disks[method, dt][1]
        for column, style in (("kinetic", "--"), ("strain", "-."), ("total", "-")):
            axis.plot(history["time_s"], history[f"{column}_energy_J"], style, linewidth=1, label=column)
        axis.set(title=f"{method}, dt = {dt} s", xlabel="time [s]")
    axes[0].set(ylabel="energy [J/m]")
    axes[0].legend()
    figure.savefig(arguments.results / "energy.png", dpi=110)


if __name__ == "__main__":
    main()
