#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Speed and memory of constant steps in the plastic phase. Run it alone on an idle machine; it takes about five minutes.

504 x 504 cells, full model, incremental scheme: an adaptive run to t = 0.6 s leaves a checkpoint, from which constant steps
go on, on one thread and two in turn. Between the repetitions benchmark_equilibrium measures the bandwidth of a triad and the
rate of the Fourier solver. Last, the peak memory of a few steps on 2520 x 2520 cells.

    verification/benchmarks/stepping.py

A step reads and writes 32 numbers of 8 bytes a cell if nothing stays in cache between its sweeps: the predictor reads p, s,
tau, q, chi, u, v and writes sigma*, chi* and the two components of the force; the solve reads and writes two numbers twice
(two sweeps); the update reads phi and reads and writes p, s, tau, q and the velocity. Divided by the triad's bandwidth this is the
bound that rates are compared with; caches can beat it.
"""

import re
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
import common  # noqa: E402  (the folder above)

CELLS = 504
START = 0.6  # s, half a second of plastic flow after the onset at 0.46 s
BYTES = 32 * 8
PHASES = ("predictor", "elliptic solve", "update", "output")


def checkpoint(program, work):
    folder = common.run(program, work / f"start-{CELLS}", {"cells": CELLS, "scheme": "incremental", "step": "adaptive", "duration": START, "snapshots": START})
    return folder / "checkpoint.h5"


def timed(program, work, start, threads, steps):
    """Nanoseconds a step and cell by phase, and "step": the sum without output."""
    folder = work / "timed"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    shutil.copy(start, folder)
    subprocess.run(common.command(program, {
        "restart": folder / "checkpoint.h5", "scheme": "incremental", "step": "fixed", "dt": "auto", "snapshots": START, "threads": threads, "quiet": "true",
        "duration": START + steps * common.constant_step(CELLS)}), check=True)
    summary = common.summary(folder)
    done = summary["steps"] - common.summary(start.parent)["steps"]
    seconds = summary["phase_seconds"]
    result = {phase: seconds[phase] * 1e9 / (done * CELLS**2) for phase in PHASES}
    result["step"] = sum(result[phase] for phase in PHASES[:3])
    return result


def machine(program):
    """Triad by threads [GB/s] and the Fourier solver's rates on 512 x 512 [million unknowns/s] from benchmark_equilibrium,
    which is stopped when it has printed them."""
    triad, rate = {}, {}
    with subprocess.Popen([program.parent / "benchmark_equilibrium"], stdout=subprocess.PIPE, text=True) as process:
        for line in process.stdout:
            if found := re.match(r"triad, (\d) threads?: ([\d.]+)", line):
                triad[int(found[1])] = float(found[2])
            if found := re.match(r" *fourier +512 +(\d) +[\d.]+ +([\d.]+)", line):
                rate[int(found[1])] = float(found[2])
            if len(rate) == 2:
                process.terminate()
    return triad, rate


def memory(program, work, cells=2520, steps=4):
    """Peak memory [GB] of a few steps with two snapshots: by the program's own account and by /usr/bin/time."""
    duration = steps * common.constant_step(cells)
    started = common.command(program, {"cells": cells, "scheme": "incremental", "step": "fixed", "duration": duration, "snapshots": f"0,{duration}", "quiet": "true",
                                       "output": work / "memory"})
    outside = Path("/usr/bin/time")
    done = subprocess.run(([outside, "-f", "%M"] if outside.exists() else []) + started, check=True, capture_output=True, text=True)
    own = common.summary(work / "memory")["peak_memory_bytes"] * 1e-9
    (work / "memory" / "fields.h5").unlink()
    return own, int(done.stderr.split()[-1]) * 1024e-9 if outside.exists() else None


def report(times, triad, rates, peak, steps):
    rows, speed = [], {}
    for threads, runs in times.items():
        bandwidth = max(t[threads] for t in triad)
        bound = BYTES / bandwidth
        for name, choose in (("minimum", min), ("median", statistics.median)):
            step = choose(run["step"] for run in runs)
            speed[threads, name] = 1e3 / step
            rows.append([threads, name, *(f"{choose(run[phase] for run in runs):.1f}" for phase in PHASES), f"{step:.1f}",
                         f"{1e3 / step:.1f}", f"{bandwidth:.1f}", f"{bound:.1f}", f"{step / bound:.2f}"])
    solver = [[threads, f"{max(r[threads] for r in rates):.0f}", f"{statistics.median(r[threads] for r in rates):.0f}"]
              for threads in times]
    repetitions = len(times[1])
    return "\n".join([
        f"# Speed and memory of constant steps\n\n{common.provenance()}\n",
        f"{CELLS} x {CELLS} cells, full model, plastic phase (t > {START} s), {repetitions} repetitions of {steps} steps, one "
        "thread and two in turn. Nanoseconds a cell and step; rate without output (a history row every step, the checkpoint at "
        f"the end); bound: {BYTES} bytes a cell and step at the best triad of this run.\n",
        common.markdown_table(["threads", "of repetitions", *PHASES, "step", "million cell-steps/s", "triad GB/s", "bound ns",
                               "step/bound"], rows),
        f"Two threads over one: {speed[2, 'minimum'] / speed[1, 'minimum']:.2f} (minimum), "
        f"{speed[2, 'median'] / speed[1, 'median']:.2f} (median).\n",
        "Fourier solver on 512 x 512, million unknowns a second:\n", common.markdown_table(["threads", "best", "median"], solver),
        "Peak memory at 2520 x 2520 cells, two snapshots and a checkpoint included: "
        f"{peak[0]:.2f} GB by the program" + (f", {peak[1]:.2f} GB by /usr/bin/time.\n" if peak[1] else ".\n")])


def main():
    parser = common.parser(__doc__, work="out/verification/stepping")
    parser.add_argument("--repetitions", type=int, default=5)
    parser.add_argument("--steps", type=int, default=300, help="steps of a repetition (default: %(default)s)")
    options = parser.parse_args()
    start = checkpoint(options.program, options.work)
    times, triad, rates = {1: [], 2: []}, [], []
    for repetition in range(options.repetitions):
        for threads, runs in times.items():
            runs.append(timed(options.program, options.work, start, threads, options.steps))
            print(f"repetition {repetition + 1}, {threads} thread(s): {runs[-1]['step']:.1f} ns a cell and step", flush=True)
        if repetition in (0, options.repetitions - 1):
            measured = machine(options.program)
            triad.append(measured[0])
            rates.append(measured[1])
    peak = memory(options.program, options.work)

    common.publish(options.results, "stepping", report(times, triad, rates, peak, options.steps), ["threads", *PHASES, "step"],
                   [[threads, *(f"{run[name]:.4g}" for name in (*PHASES, "step"))]
                    for threads, runs in times.items() for run in runs])


if __name__ == "__main__":
    main()
