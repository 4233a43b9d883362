#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What --accuracy delivers: the error at the end of a run that was asked for 1e-3, 1e-4 and 1e-5, and the error that it states, over
the error there is, against a run on many more elements with a tolerance of 1e-8. Seconds are those of the whole program, one after the
other, the search included.

Scenes end before a band has sharpened so far that its place hangs on what no grid shows, except for the last one, which goes on: there
it must refuse, or warn.

    verification/accuracy.py             # some ten minutes, most of them for the scene that is refused
"""

import subprocess
import time

import common
from space import Errors, on_elements

ASKED = (1e-3, 1e-4, 1e-5)
EXACT = {**on_elements(128, 256, 16), "scheme": "bogacki-shampine", "tolerance": "1e-8"}
U = common.WALL
EIGENSTRESS = {"initial": "uniform", "initial-base": 640, "initial-stress": 3.4e8, "initial-length": 2e-3}
RANDOM = {"initial": "random", "initial-amplitude": 20, "initial-length": 1e-3}
DISC = {"initial": "disc", "initial-base": 600, "initial-amplitude": 300, "initial-length": 3e-3, "initial-transition": 1e-3}
SCENES = {
    "the paper's": {},
    "reduced model": {"model": "reduced"},
    "inclusion of 60 K": {"initial": "gaussian", "initial-amplitude": 60, "duration": 1.0},
    "reversal": {"wall-history": f"0:{U},0.7:{U},0.8:{-U}", "duration": 1.2},
    "opening": {"wall-history": f"0:{U}:{0.05 * U}", "duration": 0.8},
    "creep": {"shear-traction": "9e8", "duration": 0.2},
    "Perzyna": {"plasticity": "perzyna", "initial": "gaussian", "initial-amplitude": 0.01, "perzyna-hardening": 1e9, "duration": 1.0},
    "wide": {"width": 0.04, "initial": "gaussian", "initial-amplitude": 60, "duration": 0.8},
    "eigenstress, 0.5 s": {**EIGENSTRESS, "duration": 0.5},
    "random, 0.6 s": {**RANDOM, "duration": 0.6},
    "disc, 0.6 s": {**DISC, "duration": 0.6},
    "disc, 1 s": {**DISC, "duration": 1.0},
    "eigenstress, 0.9 s": {**EIGENSTRESS, "duration": 0.9},
}
FIELDS = {"sigma": "stress", "chi": "internal", "v": "velocity", "traction": "traction"}


def exact_of(name, options):
    """As many points a length wherever the domain is wide; where a band is thin, elements that are narrow there from the start."""
    columns = round(128 * float(options.get("width", 0.02)) / 0.02)
    if name == "disc, 1 s":
        half = (0.00025, 0.0005, 0.00085, 0.0012, 0.00185, 0.0025, 0.004, 0.0055, 0.00775)
        edges = [-y for y in reversed(half)] + [0, *half]
        return {**options, **EXACT, "cells": f"{columns}x320", "element-edges": ",".join(map(str, edges))}
    return {**options, **EXACT, "cells": f"{columns}x256"}


def speed_of(run, options):
    """What --accuracy takes for the unit of velocities: the largest speed of the walls, at least the largest at the end."""
    last = max(abs(run.snapshots[-1][name]).max() for name in ("velocity_x", "velocity_y"))
    return last if "shear-traction" in options else max(U, last)


def study(program, work, name, asked, errors, options):
    folder = work / f"{name}-{asked:g}".replace(" ", "-").replace("'", "").replace(",", "")
    command = common.command(program, {**options, "accuracy": asked, "output": folder, "threads": 2, "quiet": "true"})
    begin = time.perf_counter()
    ended = subprocess.run(command, capture_output=True, text=True)
    seconds = time.perf_counter() - begin
    if ended.returncode < 0:
        raise SystemExit(f"{folder}: ended by signal {-ended.returncode}")
    if ended.returncode != 0:
        return [name, asked, "refused", "", "", "", "", "", f"{seconds:.1f}"], ended.stderr
    summary, found = common.summary(folder), errors(folder)
    found["v"] *= U / speed_of(errors.run, options)
    stated = {field: summary["extra"][f"estimated_error_{label}"] for field, label in FIELDS.items()}
    warned = any("--accuracy asked for" in warning for warning in summary["warnings"])
    worst = max(found, key=found.get)
    return [name, asked, summary["parameters"]["cells"], f"{max(found.values()) / asked:.2g}" + (", warned" if warned else ""),
            f"{stated['sigma'] / found['sigma']:.2g}", f"{stated['chi'] / found['chi']:.2g}", f"{stated['v'] / found['v']:.2g}",
            f"{max(stated.values()) / found[worst]:.2g}", f"{seconds:.1f}"], ""


def main():
    p = common.parser(__doc__, "out/verification/accuracy")
    p.add_argument("--scenes", metavar="NAME", nargs="+", choices=SCENES, default=list(SCENES), help="of these (default: all)")
    a = p.parse_args()
    rows = []
    for name in a.scenes:
        options = {"duration": common.DURATION, **SCENES[name]}
        options["snapshots"] = options["duration"]
        reference = common.run(a.program, a.work / f"{name}-exact".replace(" ", "-").replace("'", "").replace(",", ""),
                               {**exact_of(name, options), "history-every": 1000}, threads=2)
        errors = Errors(reference)
        for asked in ASKED:
            row, message = study(a.program, a.work, name, asked, errors, options)
            print(*row, message, sep="\t", flush=True)
            rows.append(row)
            if message:  # less would be refused, too
                break
    header = ["scene", "asked", "points", "error over asked", "stated over true: sigma", "chi", "v", "largest", "seconds"]
    text = f"# What --accuracy delivers\n\n{common.provenance()}; two threads.\n\n" + common.markdown_table(header, rows)
    common.publish(a.results, "accuracy", text, header, rows)


if __name__ == "__main__":
    main()
