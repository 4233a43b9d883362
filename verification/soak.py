#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""A long run takes no more memory, files or disk than a short one does: half an hour of each carrier, watched from outside.

Grid: 96 x 96 cells of metallic glass sheared to and fro. Points: a billet that a platen presses, leaves and presses again, with
implicit steps. Both write a checkpoint every five seconds and a snapshot every ten cycles, are looked at every two seconds (resident
memory, open files, sizes of files), and end by SIGTERM. From the first tenth of the time on

  memory       stays within 2 % or 1 MB of what it was then, but for the index of the snapshots, at most 4 kB each
  open files   are as many at the end as then
  history.csv  has rows times the bytes of a row, fields.h5 snapshots times those of a snapshot, each as the first half of the run
               has them, within 5 %: rows grow by a digit or two as numbers do
  checkpoint   keeps its size

A promise that is broken is this script's status 1.

    verification/soak.py                # an hour on one core
    verification/soak.py --minutes 1
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import common

INTERVAL = 2.0  # s between two looks
CYCLES = 10000  # more than the time lasts for
GRID_CYCLE, POINTS_CYCLE = 4.8, 8e-3  # s
SNAPSHOTS_EVERY = 10  # cycles
QUANTITIES = ("time", "memory", "open_files", "rows", "snapshots", "history", "fields", "checkpoint")


def grid_scene():
    knots = [f"{GRID_CYCLE * (k + half / 2)}:{u}"
             for k in range(CYCLES) for half in (0, 1) for u in ((5e-4, -5e-4)[::-1 if half == 0 else 1])]
    return f"""carrier = "grid"
cells = 96
tolerance = 1e-6
duration = {GRID_CYCLE * CYCLES}
snapshots = []
snapshots-every = {SNAPSHOTS_EVERY * GRID_CYCLE}
wall-history = "{",".join(knots[1:])}"
"""


def points_scene():
    knots = [[POINTS_CYCLE * (k + half / 2), 0, v]
             for k in range(CYCLES) for half in (0, 1) for v in ((-0.3, 0.3)[::-1 if half == 0 else 1])]
    return f"""carrier = "points"
cell-size = 1e-3
dt = 1e-5
duration = {POINTS_CYCLE * CYCLES}
snapshots = []
snapshots-every = {SNAPSHOTS_EVERY * POINTS_CYCLE}
[grid]
geometry = "axisymmetric"
width = 0.024
height = 0.018
[sides]
left = "slip"
right = "slip"
bottom = "slip"
top = "slip"
[materials.steel]
law = "von-mises"
young-modulus = 200e9
poisson-ratio = 0.3
density = 7800
yield-stress = 0.7e9
hardening = 0.3e9
[[bodies]]
material = "steel"
shape = {{rectangle = [0, 0, 0.01, 0.015]}}
[[rigid-bodies]]
name = "platen"
shape = {{rectangle = [0, 0.016, 0.024, 0.018]}}
history = {knots[1:]}
"""


def size(*candidates):
    for path in candidates:
        try:
            return path.stat().st_size
        except FileNotFoundError:
            pass
    return 0


def look(process, folder, cycle):
    """The quantities now, or None if the run has not begun to write. Rows are those on the disk, snapshots those up to the last row."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    memory = next(int(line.split()[1]) * 1024 for line in status.splitlines() if line.startswith("VmRSS"))
    history = folder / "history.csv.partial"
    try:
        with open(history, "rb") as file:
            file.seek(max(0, size(history) - 4096))
            data = file.read()
            whole = data[:data.rindex(b"\n") + 1]
            last = whole.splitlines()[-1].split(b",")
            now, step = float(last[0]), int(float(last[1]))
    except (FileNotFoundError, ValueError, IndexError):
        return None
    # bytes of whole rows alone: the end of the file may be a piece of one
    read = size(history) - (len(data) - len(whole))
    return {"memory": memory, "open_files": len(os.listdir(f"/proc/{process.pid}/fd")), "rows": step + 1,
            "snapshots": int(now / (SNAPSHOTS_EVERY * cycle) + 1e-9) + 1, "history": read, "fields": size(folder / "fields.h5.partial"),
            "checkpoint": size(folder / "checkpoint.h5")}


def soak(program, folder, scene, cycle, seconds):
    """Looks at a run of so many seconds; a list of what was seen, and the exit status."""
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "scene.toml"
    file.write_text(scene)
    started = time.monotonic()
    process = subprocess.Popen(common.command([program, file], {"output": folder / "run", "threads": 1, "quiet": "true",
                                                                "checkpoint-every": 5}))
    seen = []
    while time.monotonic() < started + seconds and process.poll() is None:
        time.sleep(INTERVAL)
        if process.poll() is None and (found := look(process, folder / "run", cycle)):
            seen.append({"time": time.monotonic() - started, **found})
    process.send_signal(signal.SIGTERM)
    return seen, process.wait()


def judge(seen, status):
    """Rows of the table, each with its promise kept or not."""
    column = {name: np.array([look[name] for look in seen], dtype=float) for name in QUANTITIES}
    tenth, half = (int(np.searchsorted(column["time"], column["time"][-1] / part)) for part in (10, 2))
    late = slice(tenth, None)
    memory, snapshots = column["memory"], column["snapshots"]
    growth = memory[late] - memory[tenth] - 4096 * (snapshots[late] - snapshots[tenth])
    most = max(1e6, 0.02 * memory[tenth])
    sizes = column["checkpoint"][late]
    rows = [["steps", f"{column['rows'][-1] - 1:.0f}", f"exit status {status}", status == 130],
            ["snapshots", f"{snapshots[-1]:.0f}", "", ""],
            ["memory after the first tenth, at the end", f"{memory[tenth] / 1e6:.2f} MB, {memory[-1] / 1e6:.2f} MB",
             f"growth beside the snapshots' index at most {growth.max() / 1e6:.2f} MB", growth.max() <= most],
            ["open files after the first tenth, at the end", f"{column['open_files'][tenth]:.0f}, {column['open_files'][-1]:.0f}", "",
             np.median(column["open_files"][-tenth - 1:]) <= np.median(column["open_files"][tenth:2 * tenth + 1])],
            ["checkpoint", f"{sizes.min():.0f} to {sizes.max():.0f} B", "", sizes.min() == sizes.max()]]
    for name, count in (("history", column["rows"]), ("fields", snapshots)):
        found = column[name]
        known = max(half, min(int(np.searchsorted(count, count[0] + 3)), len(count) - 1))  # three snapshots at least
        each = (found[known] - found[0]) / max(1.0, count[known] - count[0])
        predicted = found[0] + each * (count - count[0])
        worst = np.abs(found[known:] / predicted[known:] - 1.0).max()
        rows.append([f"{name}, {each:.0f} B a {'row' if name == 'history' else 'snapshot'}", f"{found[-1] / 1e6:.2f} MB",
                     f"off by {100 * worst:.2f} % at most", worst <= 0.05])
    return rows


def main():
    parser = common.parser(__doc__, work="out/verification/soak")
    parser.add_argument("--minutes", type=float, default=30, help="for each carrier (default: %(default)s)")
    arguments = parser.parse_args()
    program = arguments.program.parent / "scene"
    text, numbers, kept = f"# Soak\n\n{common.provenance()}\n", [], True
    figure, axes = plt.subplots(2, 2, figsize=(11, 6), layout="constrained", sharex="col")
    for column, (name, scene, cycle) in enumerate((("grid", grid_scene(), GRID_CYCLE), ("points", points_scene(), POINTS_CYCLE))):
        seen, status = soak(program, arguments.work / name, scene, cycle, 60 * arguments.minutes)
        rows = judge(seen, status)
        kept &= all(promise == "" or bool(promise) for *_, promise in rows)
        text += f"\n{name}, {arguments.minutes:g} minutes:\n\n" + common.markdown_table(
            ["", "found", "", "promise"], [[*row[:3], row[3] if row[3] == "" else "kept" if row[3] else "BROKEN"] for row in rows])
        numbers += [[name, *(f"{look[q]:.6g}" if q == "time" else look[q] for q in QUANTITIES)] for look in seen]
        minutes = [look["time"] / 60 for look in seen]
        axes[0][column].plot(minutes, [look["memory"] / 1e6 for look in seen])
        axes[0][column].set(title=name, ylabel="resident memory [MB]", ylim=(0, 1.2e-6 * max(look["memory"] for look in seen)))
        for file in ("history", "fields", "checkpoint"):
            axes[1][column].plot(minutes, [look[file] / 1e6 for look in seen], label=file)
        axes[1][column].set(xlabel="wall time [min]", ylabel="size [MB]")
        axes[1][column].legend()
    common.publish(arguments.results, "soak", text, ["run", *QUANTITIES], numbers)
    figure.savefig(arguments.results / "soak.png", dpi=110)
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
