#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Speed from commit to commit: measures the build as it is, adds a row to history.csv beside this file, and draws all of it as
history.png. Processor seconds of one thread, the least of some repetitions, by the programs' own account: what others do on the machine
counts less than in wall time, but counts. Rows of different machines are not to be compared; a row of the same commit, machine and compiler
is replaced, and of sources that no commit holds there is none.

    verification/benchmarks/history.py          # half a minute
    verification/benchmarks/history.py --draw   # the picture alone
"""

import csv
import datetime
import re
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
import common  # noqa: E402  (the folder above)
import matplotlib.pyplot as plt  # noqa: E402

TABLE = Path(__file__).with_name("history.csv")
KEYS = ("date", "commit", "machine", "compiler")
CASES = {  # column [s]: program, options
    "grid_default": ("shear_band", ["--cells=128", "--snapshots", ""]),
    "grid_snapshots": ("shear_band", ["--cells=128"]),
    "grid_incremental": ("shear_band", ["--cells=64", "--scheme=incremental", "--step=fixed", "--snapshots", ""]),
    "points_explicit": ("upsetting", ["--method=explicit", "--duration=1e-3", "--snapshots=0"]),
    "points_implicit": ("upsetting", ["--method=implicit", "--dt=1e-4", "--shape=gimp", "--snapshots=0"]),
    "points_quasi_static": ("upsetting", ["--dt=5e-5", "--snapshots=0"]),
}


def machine_class(summary):
    """What is alike on machines of one kind: no version of the system, no memory."""
    return ", ".join(re.split(", ", summary["machine"])[:2])


def measure(programs, work, repetitions):
    seconds = dict.fromkeys(CASES, float("inf"))
    for _ in range(repetitions):
        for name, (program, options) in CASES.items():
            folder = work / name
            subprocess.run([programs / program, *options, f"--output={folder}", "--threads=1", "--quiet=true"], check=True)
            summary = common.summary(folder)
            seconds[name] = min(seconds[name], summary["processor_seconds"])
    row = {"date": f"{datetime.date.today():%Y-%m-%d}", "commit": summary["commit"], "machine": machine_class(summary),
           "compiler": summary["compiler"]}
    return {**row, **{name: f"{value:.3g}" for name, value in seconds.items()}}


def read():
    if not TABLE.exists():
        return []
    with open(TABLE, newline="") as file:
        return list(csv.DictReader(file))


def write(rows):
    with open(TABLE, "w", newline="") as file:
        writer = csv.DictWriter(file, [*KEYS, *CASES], lineterminator="\n", restval="")
        writer.writeheader()
        writer.writerows(rows)


def draw(rows, path):
    """A line for each case and machine, over the commits in the order of the table."""
    figure, axis = plt.subplots(figsize=(max(6, 0.6 * len(rows) + 4), 4), layout="constrained")
    for number, name in enumerate(CASES):
        for style, machine in zip(("o-", "s--", "^:", "d-."), dict.fromkeys((row["machine"], row["compiler"]) for row in rows)):
            places = [k for k, row in enumerate(rows) if (row["machine"], row["compiler"]) == machine and row.get(name)]
            axis.semilogy(places, [float(rows[k][name]) for k in places], style, color=f"C{number}",
                          label=name.replace("_", " ") if style == "o-" else None)
    axis.set_xticks(range(len(rows)), [f"{row['commit'][:8]}\n{row['date']}" for row in rows], rotation=45, ha="right")
    axis.set_ylabel("processor time, one thread [s]")
    for ticks in (axis.yaxis.set_major_formatter, axis.yaxis.set_minor_formatter):
        ticks("{x:g}")
    axis.grid(alpha=0.3)
    axis.legend(loc="center left", bbox_to_anchor=(1, 0.5))
    figure.savefig(path, dpi=110)


def main():
    parser = common.parser(__doc__, work="out/verification/history")
    parser.add_argument("--draw", action="store_true", help="measure nothing")
    parser.add_argument("--repetitions", type=int, default=5, help="of each case (default: %(default)s)")
    arguments = parser.parse_args()
    rows = read()
    if not arguments.draw:
        new = measure(arguments.program.parent, arguments.work, arguments.repetitions)
        print("\n".join(f"{key:20} {value}" for key, value in new.items()))
        if new["commit"] == "unknown" or new["commit"].endswith("-dirty"):
            print("history: this build is of no commit; commit, ./ductile build, and measure again to keep it", file=sys.stderr)
            return 1
        same = ("commit", "machine", "compiler")
        rows = [row for row in rows if any(row[key] != new[key] for key in same)] + [new]
        write(rows)
    if rows:
        draw(rows, TABLE.with_suffix(".png"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
