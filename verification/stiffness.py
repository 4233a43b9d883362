#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which scheme for stiff flow: hot glass, fast and slow walls.

On 32 x 32 cells, from rest to 14 % of shear, with the standard tolerance; elliptic solves and errors of every scheme with error control
against `chebyshev` with a tolerance of 1e-7. A run of more than 20 s is ended and counted as not finished.

    verification/stiffness.py
"""

import concurrent.futures
import shutil
import subprocess

import common

CELLS = 32
SECONDS = 20
SCHEMES = ("auto", "bogacki-shampine", "chebyshev", "cvode-bdf", "ida")
REFERENCE = {"scheme": "chebyshev", "tolerance": "1e-7"}
CASES = {  # options, speed of the walls over the paper's
    "paper, 640 K": ({}, 1),
    "300 K": ({"initial-base": 300}, 1),
    "900 K": ({"initial-base": 900}, 1),
    "1100 K": ({"initial-base": 1100}, 1),
    "1200 K": ({"initial-base": 1200}, 1),
    "1500 K": ({"initial-base": 1500}, 1),
    "640 K, walls 1000 times slower": ({}, 1e-3),
    "640 K, walls 1000 times faster": ({}, 1e3),
    "1200 K, walls 1000 times faster": ({"initial-base": 1200}, 1e3),
}


def run(program, folder, options, seconds=SECONDS):
    """The summary, or None where it takes too long or fails."""
    shutil.rmtree(folder, ignore_errors=True)
    try:
        subprocess.run(common.command(program, options | {"output": folder, "threads": 1, "quiet": "true"}), check=True,
                       timeout=seconds, capture_output=True)
    except (subprocess.TimeoutExpired, subprocess.CalledProcessError):
        return None
    return common.summary(folder)


def case_options(options, speed):
    duration = common.DURATION / speed
    return {"cells": CELLS, **options, "wall-velocity": repr(common.WALL * speed), "duration": repr(duration), "snapshots": repr(duration)}


def main():
    p = common.jobs_option(common.parser(__doc__, "out/verification/stiffness"))
    arguments = p.parse_args()
    tasks = {}
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        for case, (options, speed) in CASES.items():
            base = case_options(options, speed)
            for name, more in {**{s: {"scheme": s} for s in SCHEMES}, "reference": REFERENCE}.items():
                folder = arguments.work / f"{list(CASES).index(case)}-{name}"
                tasks[case, name] = folder, pool.submit(run, arguments.program, folder, base | more, SECONDS * (10 if name == "reference" else 1))
    rows = []
    for case in CASES:
        reference, done = tasks[case, "reference"]
        exact = common.load(reference) if done.result() else None
        for name in SCHEMES:
            folder, future = tasks[case, name]
            summary = future.result()
            if not summary:
                rows.append([case, name, "not finished", "", "", "", ""])
                continue
            extra = summary["extra"]
            share = f"{extra['steps_by_chebyshev']} of {summary['steps']}" if "steps_by_chebyshev" in extra else ""
            errors = common.norms(common.load(folder) - exact) if exact else {}
            rows.append([case, name, summary["elliptic_solves"], f"{summary['wall_seconds']:.2f}", share,
                         *(f"{errors[f]:.1e}" if errors else "" for f in ("sigma", "chi"))])
    header = ["case", "scheme", "elliptic solves", "wall s", "steps of chebyshev", "error of sigma", "error of chi"]
    text = (f"# Stiff flow\n\n{common.provenance()}\n\n{CELLS} x {CELLS} cells, one thread, errors in the norm (59) at the end, divided by s_Y, "
            f"chi_inf; not finished: not within {SECONDS} s.\n\n{common.markdown_table(header, rows)}")
    common.publish(arguments.results, "stiffness", text, header, rows)


if __name__ == "__main__":
    main()
