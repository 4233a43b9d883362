#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a discretisation in space costs and gives: error against the number of points and against the time of the steps, on the
paper's grid and on elements, for the paper's scene and others that are smoother, rougher or sharper; of the paper's scene by the
paper's projection scheme with its constant steps, too.

Scenes end before a band's place hangs on what no grid shows. Errors of stress, effective temperature and velocity at the end, at the
points of each run (where elements follow a band, at equal cells), in the norm (59), and of the traction on the walls. The reference of a
scene is a run on elements with a tight tolerance; a second one with other elements, another degree and another number of waves says how
far it can be trusted. Times are those of runs without snapshots, one after the other; each is made --repeat times, and the shortest
counts.

    verification/space.py                    # six minutes
    verification/space.py --scenes paper
"""

import matplotlib.pyplot as plt
import numpy as np

import common
from results import Run

AT_WALL = (-0.00995, -0.00985, -0.0097, -0.0094, -0.0089, -0.008, -0.0065, -0.004, 0.001)
FINER_AT_WALL = (-0.00996, -0.00991, -0.00984, -0.00974, -0.0096, -0.0093, -0.0089, -0.0083, -0.0074, -0.0062, -0.0045, -0.002, 0.002)
SCENES = {  # name: options, what to expect, the two references as (columns, rows, degree) and, unless they are equal, edges
    "paper": ({}, "the paper's problem", ((128, 288, 12), (144, 256, 16))),
    "fronts": ({"initial": "uniform", "initial-base": 640, "initial-stress": 3.4e8, "initial-length": 2e-3, "duration": 0.5},
               "a random eigenstress of 0.4 s_Y: cells yield one after the other", ((128, 384, 12), (144, 320, 16))),
    "random": ({"initial": "random", "initial-amplitude": 20, "initial-length": 1e-3, "duration": 0.6},
               "random chi, correlated over 0.1 L", ((128, 384, 12), (112, 320, 16))),
    "rough": ({"initial": "random", "initial-amplitude": 20, "initial-length": 3e-4, "duration": 0.5},
              "random chi, correlated over 0.03 L", ((256, 768, 12), (224, 640, 16))),
    "disc": ({"initial": "disc", "initial-base": 600, "initial-amplitude": 300, "initial-length": 3e-3, "initial-transition": 1e-3,
              "duration": 1.0}, "a soft disc, 900 K in 600 K: its band is thinner than itself", ((96, 960, 12), (80, 800, 16))),
    "wall": ({"initial": "gaussian", "initial-base": 620, "initial-amplitude": 60, "initial-length": 1.5e-3, "initial-y": -0.01},
             "a soft inclusion at the lower wall", ((128, 160, 16, AT_WALL), (112, 168, 12, FINER_AT_WALL))),
}
STAGGERED = (64, 128, 252, 504)
ELEMENTS = ((24, 48, 8), (32, 64, 8), (40, 96, 8), (48, 128, 16), (60, 96, 16), (64, 192, 8), (64, 192, 16), (96, 256, 16))
LOOSER = (60, 96, 16), 5e-5  # of these the steps' error is not the largest with a tolerance like this
ADAPTED = ((40, 96, 8), (48, 128, 8), (64, 192, 8), (64, 192, 16))
BANDS = ("disc", "wall")  # scenes where elements may follow one
EXACT = {"space": "elements", "scheme": "dormand-prince", "tolerance": "1e-8"}
STYLES = {"projection": "C3v-", "staggered": "ks-", "elements": "C0o", "adapted": "C1^"}
NAMES = {"sigma": r"$E_\sigma/s_Y$", "chi": r"$E_\chi/\chi_\infty$", "v": r"$E_v/U$", "traction": "traction"}


def on_elements(columns, rows, degree, edges=()):
    return {"space": "elements", "cells": f"{columns}x{rows}", "degree": degree,
            **({"element-edges": ",".join(map(str, edges))} if edges else {})}


def candidates(name, options):
    for cells in STAGGERED:
        yield f"staggered {cells} x {cells}", {**options, "cells": f"{cells}x{cells}"}
    for cells in STAGGERED if name == "paper" else ():
        projection = {"scheme": "incremental", "step": "fixed", "dt": repr(common.constant_step(cells)), "advection": "eno2"}
        yield f"projection {cells} x {cells}", {**options, **projection, "cells": f"{cells}x{cells}"}
    for columns, rows, degree in ELEMENTS:
        yield f"elements {columns} x {rows // degree} of degree {degree}", {**options, **on_elements(columns, rows, degree)}
    (columns, rows, degree), tolerance = LOOSER
    yield f"elements {columns} x {rows // degree} of degree {degree}, tolerance {tolerance:g}", {
        **options, **on_elements(columns, rows, degree), "tolerance": tolerance}
    for columns, rows, degree in ADAPTED if name in BANDS else ():
        adapted = {**options, **on_elements(columns, rows, degree), "adapt-elements": "true"}
        yield f"adapted {columns} x {rows // degree} of degree {degree}", adapted


def weights(run):
    """Of the rows of cells in means."""
    edges = run.grid.y_corner
    if run.parameters["space"] == "elements" and not run.parameters["adapt-elements"]:
        edges, (_, gauss) = edges[::run.parameters["degree"]], np.polynomial.legendre.leggauss(run.parameters["degree"])
        rows = np.outer(np.diff(edges), gauss).ravel()
    else:
        rows = np.diff(edges)
    return rows / rows.sum()


class Errors:
    """Of runs against a reference, whose values at the points of a grid are found once."""

    def __init__(self, folder):
        self.run, self.known = Run(folder), {}

    def reference(self, name, x, y):
        key = name, len(x), tuple(y)
        if key not in self.known:
            self.known[key] = self.run.snapshots[-1].at(name, x, y)
        return self.known[key]

    def __call__(self, folder):
        run = Run(folder)
        last, grid, rows = run.snapshots[-1], run.grid, weights(run)[:, None]
        mean_root = lambda square: np.sqrt((rows * square).sum() / square.shape[1])
        internal, unit = ("effective_temperature", common.STEADY) if "effective_temperature" in last.names else ("plastic_strain", 0.01)
        difference = {name: last[name] - self.reference(name, grid.x_centre, grid.y_centre)
                      for name in ("pressure", "s", "tau", "q", internal)}
        p, s, tau, q = (difference[name] / common.YIELD for name in ("pressure", "s", "tau", "q"))
        v = [last[name][:, :-1] - self.reference(name, grid.x_corner[:-1], grid.y_corner) for name in ("velocity_x", "velocity_y")]
        traction = run.history["wall_shear_traction_Pa"][-1] - self.run.history["wall_shear_traction_Pa"][-1]
        return {"sigma": mean_root(3 * p**2 + 2 * s**2 + 2 * tau**2 + 6 * q**2),
                "chi": mean_root((difference[internal] / unit)**2),
                "v": np.sqrt(np.mean(v[0]**2 + v[1]**2)) / common.WALL, "traction": abs(traction) / common.YIELD}


def study(program, work, name, repeat):
    """Rows of one scene, and how far its two references are apart."""
    options, _, references = SCENES[name]
    end = {"snapshots": options.get("duration", common.DURATION), "history-every": 1000, **options}
    folders = [common.run(program, work / f"{name}-reference-{k}", {**end, **EXACT, **on_elements(*shape)}, threads=2)
               for k, shape in enumerate(references)]
    errors, rows = Errors(folders[0]), []
    for label, run_options in candidates(name, end):
        place = work / f"{name}-{label.replace(' ', '-')}"
        folder, seconds = common.run(program, place, run_options, threads=2), []
        for k in range(repeat):  # without what accumulates for snapshots
            timed = common.run(program, place.with_name(f"{place.name}-timed-{k}"), {**run_options, "snapshots": ""}, threads=2, timed=True)
            seconds.append(common.step_seconds(common.summary(timed)))
        summary, run = common.summary(folder), Run(folder)
        cells = str(summary["parameters"]["cells"]).split("x")
        columns, lines = int(cells[0]), int(cells[-1])
        rows.append({"scene": name, "space": label, "points": columns * lines, **errors(folder), "seconds": min(seconds),
                     "solves": summary["elliptic_solves"], "unresolved": max(run.history[f"unresolved_{d}"][-1] for d in "xy"),
                     "flow": summary["extra"]["unresolved_flow"],
                     "warned": any("finest scales" in warning for warning in summary["warnings"])})
    return rows, errors(folders[1])


def draw(path, studies):
    figure, axes = plt.subplots(2, len(studies), figsize=(3.4 * len(studies), 6.4), squeeze=False, sharey="row", layout="constrained")
    for column, (name, (rows, distance)) in zip(axes.T, studies.items()):
        for axis, cost in zip(column, ("points", "seconds")):
            for kind, style in STYLES.items():
                of_kind = [row for row in rows if row["space"].startswith(kind)]
                if of_kind:
                    axis.loglog([row[cost] for row in of_kind], [row["sigma"] for row in of_kind], style, label=kind)
            axis.axhline(distance["sigma"], color="grey", ls=":", label="two references")
            axis.set_xlabel({"points": "points", "seconds": "time of the steps [s]"}[cost])
        column[0].set_title(f"{name}: {SCENES[name][1]}", fontsize=8, wrap=True)
    for row in axes:
        row[0].set_ylabel(NAMES["sigma"])
    axes[0, -1].legend()
    figure.savefig(path, dpi=110)


def headline(path, rows):
    """The paper's scene, from the paper's scheme to elements."""
    labels = {"projection": "the paper's projection, constant steps", "staggered": "error control, the paper's grid",
              "elements": "error control, Fourier series and spectral elements"}
    figure, axis = plt.subplots(figsize=(7.5, 4.5), layout="constrained")
    for kind, label in labels.items():
        of_kind = sorted((row for row in rows if row["space"].startswith(kind)), key=lambda row: row["seconds"])
        axis.loglog([row["seconds"] for row in of_kind], [row["sigma"] for row in of_kind], STYLES[kind], label=label)
        for row in of_kind:
            if kind != "elements" or row["space"] in ("elements 48 x 8 of degree 16", "elements 64 x 12 of degree 16"):
                axis.annotate(row["space"].split(" ", 1)[1], (row["seconds"], row["sigma"]), xytext=(5, 4), textcoords="offset points", fontsize=7)
    axis.set_xlabel("time of the steps, two threads [s]")
    axis.set_ylabel(r"error of the stress, $E_\sigma/s_Y$")
    axis.legend()
    figure.savefig(path, dpi=100)


def main():
    p = common.parser(__doc__, "out/verification/space")
    p.add_argument("--scenes", metavar="NAME", nargs="+", choices=SCENES, default=list(SCENES), help="of these (default: all)")
    p.add_argument("--repeat", type=int, default=3, help="runs of each, the shortest counts (default: %(default)s)")
    a = p.parse_args()
    studies = {name: study(a.program, a.work, name, a.repeat) for name in a.scenes}
    text = f"# Error of the space\n\n{common.provenance()}; two threads.\n"
    for name, (rows, distance) in studies.items():
        text += f"\n## {name}: {SCENES[name][1]}\n\n" + common.markdown_table(
            ["space", "points", *NAMES, "seconds", "solves", "unresolved", "of the flow"],
            [[row["space"], row["points"], *(f"{row[field]:.1e}" for field in NAMES), f"{row['seconds']:.2g}", row["solves"],
              f"{row['unresolved']:.1e}", f"{row['flow']:.2g}" + (", warned" if row["warned"] else "")] for row in rows])
        text += "\nTwo references are apart by " + ", ".join(f"{distance[field]:.1e} ({field})" for field in NAMES) + ".\n"
    header = list(next(iter(studies.values()))[0][0])
    common.publish(a.results, "space", text, header, [[row[key] for key in header] for rows, _ in studies.values() for row in rows])
    draw(a.results / "space.png", studies)
    if "paper" in studies:
        headline(a.results / "headline.png", studies["paper"][0])


if __name__ == "__main__":
    main()
