#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The program's default scheme beside the paper's constant steps, on two threads, and alone on a grid where those are out of reach.

First 128 and 504 cells a side, the two in turn: elliptic solves, wall time, and total errors against 2520 x 2520 cells (the reference
of convergence.py). Then 2520 x 2520 cells: the default to the end, interrupted and restarted on the way, once more with half the
tolerance to see its error in time, and 100 of the paper's steps to say what all 88,200 would cost. The machine must be idle; it takes
about a quarter of an hour.

    verification/default_scheme.py
"""

import shutil
import signal
import statistics
import subprocess
import time

import matplotlib.pyplot as plt

import common
import convergence
from common import FIELDS
from results import Run

THREADS = 2
DEFAULT = {}  # no options: what the program does by itself
PAPER = {"scheme": "incremental", "step": "fixed", "dt": "auto"}
LARGE = 2520
PAPER_STEPS = 100


def fresh(program, folder, options):
    """Runs anew; returns the summary."""
    shutil.rmtree(folder, ignore_errors=True)
    subprocess.run(common.command(program, {**options, "output": folder, "threads": THREADS, "quiet": "true"}), check=True,
                   stdout=subprocess.DEVNULL)
    return common.summary(folder)


def side_by_side(program, work, fine, repetitions):
    rows = []
    for cells in (128, 504):
        runs = {"default": [], "paper": []}
        for repetition in range(repetitions):
            for name, options in (("default", DEFAULT), ("paper", PAPER)):
                if name == "default" or repetition == 0 or cells < 200:
                    runs[name].append(fresh(program, work / f"{name}-{cells}", {
                        "cells": cells, **options, "snapshots": common.DURATION}))
        errors = {name: common.norms(common.load(work / f"{name}-{cells}") - common.interpolate(fine, cells)) for name in runs}
        solves = {name: summaries[0]["elliptic_solves"] for name, summaries in runs.items()}
        seconds = {name: statistics.median(s["wall_seconds"] for s in summaries) for name, summaries in runs.items()}
        for name in runs:
            ratios = (["", "", ""] if name == "paper" else
                      [", ".join(f"{errors[name][f] / errors['paper'][f]:.3f}" for f in FIELDS),
                       f"{solves['paper'] / solves[name]:.1f}", f"{seconds['paper'] / seconds[name]:.1f}"])
            rows.append([cells, name, *(f"{errors[name][f]:.3e}" for f in FIELDS), solves[name],
                         f"{seconds[name]:.3f} ({min(s['wall_seconds'] for s in runs[name]):.3f})", *ratios])
            print(*rows[-1], flush=True)
    return rows


def equilibrium(program, work, path):
    """Draws |B^T sigma|/(|sigma| h) over the default run on 128 x 128 cells, and over the paper's with the fully integrated stiffness,
    which does not keep it; returns a line of text."""
    figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
    largest = {}
    for operator in ("exact", "full"):
        scheme = {} if operator == "exact" else PAPER
        fresh(program, work / f"operator-{operator}", {"cells": 128, "operator": operator, **scheme, "snapshots": common.DURATION})
        history = Run(work / f"operator-{operator}").history
        residual = history["equilibrium_residual"][1:]
        largest[operator] = residual.max()
        axis.semilogy(history["time_s"][1:], residual, label=f"stiffness: {operator}")
        if operator == "exact":
            halves = [part.max() for part in (residual[:residual.size // 2], residual[residual.size // 2:])]
    axis.set(xlabel="t [s]", ylabel=r"largest $|B^T\sigma|/(|\sigma| h)$", title="128 x 128 cells: default, and the paper's scheme and stiffness")
    axis.legend()
    figure.savefig(path, dpi=100)
    plt.close(figure)
    return (f"Equilibrium on 128 x 128 cells: the relative residual |B^T sigma|/(|sigma| h) stays below {largest['exact']:.1e} (first half of the steps "
            f"{halves[0]:.1e}, second half {halves[1]:.1e}); in the paper's scheme with the stiffness (S.20) it reaches {largest['full']:.1e}. "
            f"[Figure]({path.name}).\n")


def interrupted_run(program, folder, options, after):
    """Stops the run by a signal after so many seconds and restarts it; returns the wall times of both parts and the time in the run
    at which it stopped."""
    shutil.rmtree(folder, ignore_errors=True)
    process = subprocess.Popen(common.command(program, {**options, "output": folder, "threads": THREADS, "quiet": "true"}),
                               stdout=subprocess.DEVNULL)
    time.sleep(after)
    process.send_signal(signal.SIGINT)
    if process.wait() != 130:
        raise SystemExit("the run was not interrupted: it ended before, or failed")
    first = common.summary(folder)
    shutil.copy(folder / "checkpoint.h5", folder.parent / "stopped.h5")
    subprocess.run(common.command(program, {"restart": folder / "checkpoint.h5", "threads": THREADS, "quiet": "true"}), check=True,
                   stdout=subprocess.DEVNULL)
    return first["wall_seconds"], common.summary(folder)["wall_seconds"], first["extra"]["simulated_time_s"]


def paper_steps(program, work, start):
    """Wall seconds a step of the paper's constant steps from the checkpoint at `start` s."""
    folder = work / "paper-steps"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    shutil.copy(work / "stopped.h5", folder / "checkpoint.h5")
    done = start + PAPER_STEPS * common.constant_step(LARGE)
    subprocess.run(common.command(program, {**PAPER, "restart": folder / "checkpoint.h5", "duration": repr(done), "snapshots": done,
                                            "threads": THREADS, "quiet": "true", "history-every": 1000}), check=True, stdout=subprocess.DEVNULL)
    summary = common.summary(folder)
    return sum(seconds for phase, seconds in summary["phase_seconds"].items() if phase != "output") / PAPER_STEPS


def large(program, work, fine, after):
    options = {"cells": LARGE, "snapshots": common.DURATION}
    first, second, stopped = interrupted_run(program, work / "large", options, after)
    summary = common.summary(work / "large")
    h = 2 / LARGE
    tolerance = 1e-4 * min(1, (252 * h) ** 3)  # what "auto" is
    half = fresh(program, work / "large-half", options | {"tolerance": repr(tolerance / 2)})
    step = paper_steps(program, work, stopped)
    result, halved = common.load(work / "large"), common.load(work / "large-half")
    change = common.norms(result - halved)
    coarse = common.load(work / "default-504")
    # errors of second order in space: E(504) - E(2520) = C (h_504^2 - h_2520^2)
    space = {f: e / ((LARGE / 504) ** 2 - 1) for f, e in common.norms(coarse - common.interpolate(result, 504)).items()}
    return [
        f"- Default: {summary['steps']} steps, {summary['rejected_steps']} rejected, {summary['elliptic_solves']} elliptic solves, "
        f"{first + second:.0f} s of wall time on {THREADS} threads ({first:.0f} s to the interruption at t = {stopped:.4f} s, {second:.0f} s after "
        f"the restart), peak memory {summary['peak_memory_bytes'] * 1e-9:.2f} GB.",
        f"- With half the tolerance: {half['elliptic_solves']} solves, {half['wall_seconds']:.0f} s. The answers differ by "
        + ", ".join(f"{change[f]:.1e} ({f})" for f in FIELDS) + "; the error in space is about "
        + ", ".join(f"{space[f]:.1e} ({f})" for f in FIELDS) + ": ratios " + ", ".join(f"{change[f] / space[f]:.3f}" for f in FIELDS) + ".",
        f"- {PAPER_STEPS} constant steps of the paper from t = {stopped:.4f} s: {step:.3f} s each; all 88,200 would take {88200 * step / 3600:.1f} hours, "
        f"{88200 * step / (first + second):.0f} times the default, with {88200 / summary['elliptic_solves']:.0f} times as many solves."]


def main():
    parser = common.reference_option(common.parser(__doc__, work="out/verification/default_scheme"))
    parser.add_argument("--repetitions", type=int, default=5)
    parser.add_argument("--interrupt-after", type=float, default=90, metavar="SECONDS", help="(default: %(default)s)")
    options = parser.parse_args()
    kind = convergence.SERIES["full"][0]
    name = convergence.run_name(kind, options.reference)
    reference = common.run_all(options.program, options.work.parent / "runs", {name: convergence.reference(kind, options.reference)}, 1)
    fine = common.load(reference[name])
    options.results.mkdir(parents=True, exist_ok=True)
    rows = side_by_side(options.program, options.work, fine, options.repetitions)
    header = ["N", "run", *(f"error of {f}" for f in FIELDS), "solves", "wall s, median (best)", "error over the paper's: v, sigma, chi",
              "fewer solves", "less time"]
    text = "\n".join([
        f"# The default scheme\n\n{common.provenance()}\n",
        f"Full model, t = 35e4 t_s, {THREADS} threads. Paper: incremental scheme, constant steps 0.5e4 t_s h/L. Errors in the norm (59), divided by "
        f"U, s_Y, chi_inf, against N = {options.reference}.\n",
        common.markdown_table(header, rows),
        equilibrium(options.program, options.work, options.results / "equilibrium_residual.png"), f"## {LARGE} x {LARGE} cells\n",
        *large(options.program, options.work, fine, options.interrupt_after), ""])
    common.publish(options.results, "default_scheme", text, header, rows)


if __name__ == "__main__":
    main()
