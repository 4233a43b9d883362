#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a run pays for things that its scene does not have: pairs of runs that differ in one thing, their processor time (the least of
several in turn) and their counters. Where leaving a thing out saves what it costs, the program skips it.

    verification/skips.py             # some minutes; other work beside it makes it less sharp
"""

import resource
import subprocess

import common

REPEATS = 5
BLOCK = """carrier = "points"
cell-size = 0.025
method = "{method}"
duration = {duration}
snapshots = []
history-every = 1000000
[grid]
width = {width}
height = {width}
finite-rotation = {rotation}
[sides]
left = "free"
right = "free"
bottom = "slip"
top = "free"
[materials.rubber]
law = "linear-elastic"
young-modulus = 1000
poisson-ratio = 0.3
density = 1000
[[bodies]]
name = "block"
material = "rubber"
shape = {{rectangle = [0.1, 0.1, 0.9, 0.9]}}
velocity = [0.0, -0.02]
"""
RIGID = """[[rigid-bodies]]
name = "far"
shape = {rectangle = [0.0, 0.95, 0.05, 1.0]}
velocity = [0.0, 1e-9]
holds = ["x", "y"]
"""
FORCE = """[body-force]
acceleration = [0.0, -1e-9]
"""


def block(work, name, method="explicit", width=1.0, rotation=True, extra=""):
    file = work / f"{name.replace(' ', '_')}.toml"
    file.write_text(BLOCK.format(method=method, duration=3.0 if method == "explicit" else 200.0, width=width,
                                 rotation=str(rotation).lower()) + extra)
    return ["scene", str(file)]


def shear(duration, **options):
    words = {"cells": 128, "scheme": "bogacki-shampine", "step": "fixed", "dt": 1e-3, "duration": duration, "snapshots": duration,
             "history-every": 1000000, **options}
    return ["shear_band", *(f"--{name.replace('_', '-')}={value}" for name, value in words.items())]


def pairs(work):
    """what is absent, then commands without it and with it; a command may be a pair of which the second is taken off."""
    points = ("history-every", 1000000)
    yield "plastic flow (0.2 s of shear before yield, and after it)", [shear(0.2)], [shear(1.2), shear(1.0)]
    yield "advection and spin (reduced model)", [shear(0.3, model="reduced")], [shear(0.3)]
    yield ("moving walls (held at half of yield, adaptive steps)",
           [shear(1.4, step="adaptive", dt="auto", wall_history="0:4.938e-4,0.15:4.938e-4,0.15:0")],
           [shear(1.4, step="adaptive", dt="auto")])
    yield "rows of shear_band", [shear(0.3)], [shear(0.3, history_every=1)]
    bare = {"snapshots": 0, points[0]: points[1], "duration": 5e-4, "method": "explicit"}
    yield "rows of upsetting, explicit, every 20th step", [named("upsetting", bare)], [named("upsetting", {**bare, points[0]: 20})]
    yield "rows of upsetting, explicit, every step", [named("upsetting", bare)], [named("upsetting", {**bare, points[0]: 1})]
    bare = {"snapshots": 0, points[0]: points[1], "duration": 3e-3, "dt": 1e-4}
    yield "rows of upsetting, implicit, every step", [named("upsetting", bare)], [named("upsetting", {**bare, points[0]: 1})]
    yield ("snapshots of shear_band, a hundred", [shear(0.3)], [shear(0.3, snapshots_every=0.003)])
    for method in ("explicit", "implicit"):
        yield (f"rotation, {method}", [block(work, f"still {method}", method, rotation=False)], [block(work, f"turning {method}", method)])
        yield (f"rigid bodies, {method}", [block(work, f"free {method}", method)], [block(work, f"rigid {method}", method, extra=RIGID)])
        yield (f"body force, {method}", [block(work, f"weightless {method}", method)],
               [block(work, f"heavy {method}", method, extra=FORCE)])
        yield (f"cells without particles, {method}: grid as large as needed, and 25 times",
               [block(work, f"tight {method}", method)], [block(work, f"wide {method}", method, width=5.0)])
    linear = block(work, "linear", "implicit")
    yield "a law that is not linear (one linear solve a step, and Newton's loop)", [linear], [[*linear, "--always-newton=true"]]


def named(program, options):
    return [program, *(f"--{name}={value}" for name, value in options.items())]


def processor_seconds(programs, words, output):
    """User time of a run."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([programs / words[0], *words[1:], "--threads=1", "--quiet=true", f"--output={output}"], check=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def main():
    arguments = common.parser(__doc__, work="out/verification/skips").parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    programs, output = arguments.program.parent, arguments.work / "run"
    rows = []
    for what, *ways in pairs(arguments.work):
        least, counts = [[float("inf")] * len(way) for way in ways], [0, 0]
        for _ in range(REPEATS):
            for k, way in enumerate(ways):
                for m, words in enumerate(way):
                    least[k][m] = min(least[k][m], processor_seconds(programs, words, output))
                    if m == 0:
                        counts[k] = common.summary(output)["steps"]
        without, having = (times[0] - sum(times[1:]) for times in least)
        rows.append([what, without, having, having / without, *counts])
        print(*rows[-1], flush=True)
    table = [[what, f"{without:.3f}", f"{having:.3f}", f"{ratio:.2f}", *counts] for what, without, having, ratio, *counts in rows]
    text = ("# What a run pays for what its scene does not have\n\n" + common.provenance() +
            f"\n\nUser seconds, the least of {REPEATS} runs in turn; steps of both.\n\n" +
            common.markdown_table(["absent, and present", "without", "with", "ratio", "steps without", "steps with"], table))
    common.publish(arguments.results, "skips", text, ["absent", "seconds without", "seconds with", "ratio", "steps without", "steps with"],
                   rows)


if __name__ == "__main__":
    main()
